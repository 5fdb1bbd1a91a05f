//! A part of the recorded time.

use super::error::PlotError;
use super::rows::SIMULATED_TIME;
use super::selection::Named;
use super::session_time::{SESSION_TIME, follows_reset, times};
use crate::shown::shown_s;
use crate::study::Table;

/// Slack at either end for times that are sums of steps, s.
const SLACK_S: f64 = 1e-9;

/// Removes the rows outside a range of time from tables that have a column [`SESSION_TIME`](super::SESSION_TIME), or else
/// [`SIMULATED_TIME`]. A range that begins at a reset leaves out the state before it, of the same time.
///
/// # Errors
/// [`PlotError::Request`] if no row remains.
pub fn cut(place: &str, tables: &mut [Named], from_s: Option<f64>, to_s: Option<f64>) -> Result<(), PlotError> {
    let all = recorded_time(tables);
    let inside = |time: &f64| from_s.is_none_or(|from| *time >= from - SLACK_S) && to_s.is_none_or(|to| *time <= to + SLACK_S);
    for table in tables.iter_mut().map(|named| &mut named.table) {
        let Some(times) = times(table) else { continue };
        let first = row_after_reset_at(table, times, from_s);
        let inside: Vec<bool> = times.iter().enumerate().map(|(row, time)| row >= first && inside(time)).collect();
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
    Err(PlotError::Request(match all {
        None => format!(
            "{place}: --from and --to cut by a column `{SIMULATED_TIME}`, and there is none: give its column of times that name"
        ),
        Some([first, last]) => format!(
            "{place}: nothing was recorded between --from and --to; the recording covers {} s to {} s",
            shown_s(first),
            shown_s(last)
        ),
    }))
}

/// The row after the last reset up to the beginning of a range; the first without such a reset.
fn row_after_reset_at(table: &Table, times: &[f64], from_s: Option<f64>) -> usize {
    let follows_reset = follows_reset(table);
    let is_reset = |row: &usize| from_s.is_some_and(|from| times[*row] <= from + SLACK_S) && follows_reset(*row);
    // Tables without session time may have later rows of an earlier time.
    let has_session_time = table.column(SESSION_TIME).is_some();
    (0..times.len()).rev().find(is_reset).filter(|_| has_session_time).unwrap_or(0)
}

/// First and last time of tables, s: since the recording began if that has resets, or else simulated ones.
pub fn recorded_time(tables: &[Named]) -> Option<[f64; 2]> {
    let all = || tables.iter().filter_map(|named| times(&named.table)).flatten().copied();
    let ends = [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)];
    (ends[0] <= ends[1]).then_some(ends)
}
