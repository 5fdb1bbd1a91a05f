//! Times of a recording with resets: simulated time begins again at each of them, and the time of the session goes on.

use super::figure::Axis;
use super::rows::SIMULATED_TIME;
use super::selection::Named;
use crate::study::Table;

/// Column of the time since a recording with resets began, s.
pub const SESSION_TIME: &str = "stamp.session_time_s";
/// Column of the epoch: each reset begins another.
pub(super) const EPOCH: &str = "stamp.epoch";
/// Column of the log time, s since 1970, and the finest part of a second that a number of this size tells.
const LOG_TIME: &str = "log_time";
const PARTS_OF_A_SECOND: f64 = 1e6;

/// Adds a column [`SESSION_TIME`] to the topics of a whole recording, if a reset began another epoch in it.
///
/// Where there is such a column, [`recorded`](super::recorded()), [`cut`](super::cut()) and pictures of the mechanism go by it,
/// and otherwise by simulated time.
pub fn add_session_time(topics: &mut [Named]) {
    if !has_resets(topics) {
        return;
    }
    let log_times = topics.iter().filter_map(|topic| topic.table.column(LOG_TIME)).flatten().copied();
    let began_s = log_times.fold(f64::INFINITY, f64::min);
    let since_began = |log_s: &f64| ((log_s - began_s) * PARTS_OF_A_SECOND).round() / PARTS_OF_A_SECOND;
    for table in topics.iter_mut().map(|topic| &mut topic.table) {
        let times: Option<Vec<f64>> = table.column(LOG_TIME).map(|log_times| log_times.iter().map(since_began).collect());
        if let Some(times) = times {
            table.push(SESSION_TIME, times);
        }
    }
}

/// Whether topics have messages of several epochs. Messages without a stamp are of none.
fn has_resets(topics: &[Named]) -> bool {
    let epochs = topics.iter().filter_map(|topic| topic.table.column(EPOCH)).flatten().copied();
    let mut stamped = epochs.filter(|epoch| epoch.is_finite());
    let first = stamped.next();
    stamped.any(|epoch| Some(epoch) != first)
}

/// Name of the column of time over which the topics of a recording are drawn.
pub fn time_column(topics: &[Named]) -> &'static str {
    if topics.iter().any(|topic| column_of(&topic.table) == SESSION_TIME) { SESSION_TIME } else { SIMULATED_TIME }
}

/// Name of the column of time of a topic.
fn column_of(topic: &Table) -> &'static str {
    if topic.column(SESSION_TIME).is_some() { SESSION_TIME } else { SIMULATED_TIME }
}

/// Times of the rows of a topic, s: since the recording began if that has resets, or else simulated ones; `None` without either.
pub(super) fn times(topic: &Table) -> Option<&[f64]> {
    topic.column(column_of(topic))
}

/// The axis of the times of a topic.
pub(super) fn axis_of(topic: &Table) -> Axis {
    axis(column_of(topic)).unwrap_or_default()
}

/// The axis of a column of time; `None` for others.
pub(super) fn axis(column: &str) -> Option<Axis> {
    match column {
        SIMULATED_TIME => Some(Axis::new("time", "s")),
        SESSION_TIME => Some(Axis::new("time since the recording began", "s")),
        _ => None,
    }
}

/// Whether a reset came just before a row: its epoch is another than that of the row before, or simulated time has run back.
pub(super) fn follows_reset(table: &Table) -> impl Fn(usize) -> bool {
    let [epochs, times_s] = [EPOCH, SIMULATED_TIME].map(|name| table.column(name).unwrap_or_default());
    let pair = |values: &[f64], row: usize| Some([*values.get(row.checked_sub(1)?)?, *values.get(row)?]);
    move |row| {
        let is_other_epoch = pair(epochs, row).is_some_and(|[before, now]| before != now && (before + now).is_finite());
        is_other_epoch || pair(times_s, row).is_some_and(|[before, now]| now < before)
    }
}

/// The points of a curve through the rows of a table, with a gap at each reset: nothing moves from the last state to the new one.
pub(super) fn broken_at_resets(table: &Table, xs: &[f64], ys: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let follows_reset = follows_reset(table);
    let points = xs.iter().copied().zip(ys.iter().copied()).enumerate();
    let with_gap = |(row, (x, y)): (usize, (f64, f64))| follows_reset(row).then_some((x, f64::NAN)).into_iter().chain([(x, y)]);
    points.flat_map(with_gap).unzip()
}
