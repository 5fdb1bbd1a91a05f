//! A part of the recorded time.

use super::error::PlotError;
use super::rows::SIMULATED_TIME;
use super::selection::Named;
use crate::shown::shown_s;
use crate::study::Table;

/// Slack at either end for times that are sums of steps, s.
const SLACK_S: f64 = 1e-9;

/// Removes the rows outside a range of simulated time from tables that have a column [`SIMULATED_TIME`].
///
/// # Errors
/// [`PlotError::Request`] if no row remains.
pub fn cut(place: &str, tables: &mut [Named], from_s: Option<f64>, to_s: Option<f64>) -> Result<(), PlotError> {
    let all = recorded_time(tables);
    let inside = |time: &f64| from_s.is_none_or(|from| *time >= from - SLACK_S) && to_s.is_none_or(|to| *time <= to + SLACK_S);
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
    let covers = all.map_or_else(
        || format!("there is no column `{SIMULATED_TIME}`"),
        |[first, last]| format!("the recording covers {} s to {} s", shown_s(first), shown_s(last)),
    );
    Err(PlotError::Request(format!("{place}: nothing was recorded between --from and --to; {covers}")))
}

/// First and last simulated time of tables, s.
pub fn recorded_time(tables: &[Named]) -> Option<[f64; 2]> {
    let times = || tables.iter().filter_map(|named| named.table.column(SIMULATED_TIME)).flatten().copied();
    let ends = [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)];
    (ends[0] <= ends[1]).then_some(ends)
}
