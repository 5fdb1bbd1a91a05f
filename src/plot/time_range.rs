//! A part of the recorded time.

use std::fmt;

use super::error::PlotError;
use super::recorded::SIMULATED_TIME;
use super::selection::Named;
use crate::study::Table;

/// Slack at either end for times that are sums of steps, s.
const SLACK_S: f64 = 1e-9;

/// A range of simulated time, ends included; an end that is `None` is open.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TimeRange {
    /// Begin of the range, s.
    pub from_s: Option<f64>,
    /// End of the range, s.
    pub to_s: Option<f64>,
}

impl fmt::Display for TimeRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.from_s, self.to_s) {
            (Some(from), Some(to)) => write!(f, "from {from} s to {to} s"),
            (Some(from), None) => write!(f, "from {from} s on"),
            (None, Some(to)) => write!(f, "up to {to} s"),
            (None, None) => write!(f, "at any time"),
        }
    }
}

impl TimeRange {
    /// Removes the rows outside the range from tables that have a column [`SIMULATED_TIME`].
    ///
    /// # Errors
    /// [`PlotError::Outside`] if no row remains.
    pub fn cut(&self, place: &str, tables: &mut [Named]) -> Result<(), PlotError> {
        let all = recorded_time(tables);
        let inside = |time: &f64| {
            self.from_s.is_none_or(|from| *time >= from - SLACK_S) && self.to_s.is_none_or(|to| *time <= to + SLACK_S)
        };
        for table in tables.iter_mut().map(|named| &mut named.table) {
            let Some(times) = table.column(SIMULATED_TIME) else { continue };
            let inside: Vec<bool> = times.iter().map(inside).collect();
            let mut cut = Table::default();
            for (name, values) in table.columns() {
                let kept = values.iter().zip(&inside).filter(|(_, inside)| **inside).map(|(value, _)| *value);
                cut.push(name, kept.collect());
            }
            *table = cut;
        }
        if recorded_time(tables).is_some() {
            return Ok(());
        }
        let recorded = match all {
            Some([first, last]) => format!("the recording covers {first} s to {last} s"),
            None => format!("there is no column `{SIMULATED_TIME}`"),
        };
        Err(PlotError::Outside { place: place.to_owned(), range: self.to_string(), recorded })
    }
}

/// First and last simulated time of tables, s.
pub fn recorded_time(tables: &[Named]) -> Option<[f64; 2]> {
    let times = || tables.iter().filter_map(|named| named.table.column(SIMULATED_TIME)).flatten().copied();
    let ends = [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)];
    (ends[0] <= ends[1]).then_some(ends)
}
