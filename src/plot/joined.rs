//! Columns of different topics of a recording, joined by simulated time.

use std::collections::HashMap;

use super::error::PlotError;
use super::rows::SIMULATED_TIME;
use super::selection::Named;
use super::session_time::EPOCH;
use crate::shown::shown_name;
use crate::study::Table;
use crate::wire::Topic;

/// Fewer points make no curve.
const FEWEST: usize = 2;

/// A column of a topic.
pub(super) struct Column<'a> {
    pub topic: &'a Named,
    pub name: &'a str,
}

impl Column<'_> {
    /// Its values with their instants: epoch and simulated time, to the bit. Messages without a stamp have no instant.
    fn values(&self) -> impl Iterator<Item = ([u64; 2], f64)> {
        let table = &self.topic.table;
        let column = |name: &str| table.column(name).unwrap_or_default();
        let (values, times_s, epochs) = (column(self.name), column(SIMULATED_TIME), column(EPOCH));
        let stamped = values.iter().zip(times_s).enumerate().filter(|(_, (_, time_s))| time_s.is_finite());
        stamped.map(move |(row, (value, time_s))| {
            let epoch = epochs.get(row).copied().unwrap_or_default();
            ([epoch.to_bits(), time_s.to_bits()], *value)
        })
    }

    /// Whether its topic has samples. Topics of one rate have them at the same instants.
    fn is_of_samples(&self) -> bool {
        Topic::of_key(&self.topic.name).is_some_and(Topic::is_telemetry)
    }

    /// Its name and its topic's.
    fn described(&self) -> String {
        format!("`{}` of {}", shown_name(self.name), shown_name(self.topic_name()))
    }

    /// The last part of its topic's name.
    fn topic_name(&self) -> &str {
        self.topic.name.rsplit('/').next().unwrap_or(&self.topic.name)
    }
}

/// A table of two columns of different topics, of the simulated time and of the epoch. It has a row for each message of `y` with one
/// of `x` at the same instant.
///
/// # Errors
/// [`PlotError::Request`] for fewer than two rows.
pub(super) fn joined(x: &Column<'_>, y: &Column<'_>) -> Result<Table, PlotError> {
    let xs_at: HashMap<[u64; 2], f64> = x.values().collect();
    let (mut epochs, mut times_s) = (Vec::new(), Vec::new());
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for (instant, value) in y.values() {
        if let Some(x) = xs_at.get(&instant) {
            epochs.push(f64::from_bits(instant[0]));
            times_s.push(f64::from_bits(instant[1]));
            xs.push(*x);
            ys.push(value);
        }
    }
    if times_s.len() < FEWEST {
        return Err(too_few(x, y));
    }
    let mut table = Table::default();
    table.push(SIMULATED_TIME, times_s);
    table.push(EPOCH, epochs);
    table.push(x.name, xs);
    table.push(y.name, ys);
    Ok(table)
}

/// The refusal of columns with too few instants in common, with the way to others.
fn too_few(x: &Column<'_>, y: &Column<'_>) -> PlotError {
    let advice = match (x.is_of_samples(), y.is_of_samples()) {
        (true, true) => "record with --publish-hz all (of a what-if, its original), so that both have every step".to_owned(),
        (false, true) => "choose an x column of samples: of angles, displacements, loads or energies".to_owned(),
        (_, false) => format!("choose an x column of {}", shown_name(y.topic_name())),
    };
    PlotError::Request(format!("{} and {} have fewer than two instants in common; {advice}", x.described(), y.described()))
}
