//! The times between the samples of a recorded topic.

use crate::plot::SIMULATED_TIME;
use crate::study::Table;

/// Part of the intervals between samples that are no gaps.
const REGULAR: f64 = 0.9;
/// Intervals longer than this many regular ones are gaps.
const GAP: f64 = 1.5;
/// Steps that differ by more than this factor do not differ by rounding.
const CHANGED: f64 = 1.01;
/// Steps longer than this part of the time between samples were all published.
pub(super) const EVERY_STEP: f64 = 0.75;

/// The time between a sample and the one before it.
pub(super) struct Interval {
    /// Row of the later sample.
    pub row: usize,
    /// Simulated time, s.
    pub duration_s: f64,
}

impl Interval {
    /// The values of a column at its beginning and at its end.
    pub fn ends(&self, values: &[f64]) -> Option<[f64; 2]> {
        Some([*values.get(self.row - 1)?, *values.get(self.row)?])
    }
}

/// The intervals within epochs.
pub(super) fn intervals(table: &Table) -> Vec<Interval> {
    let [times_s, epochs] = [SIMULATED_TIME, "stamp.epoch"].map(|name| table.column(name).unwrap_or_default());
    let is_in_epoch = |row: &usize| epochs.get(*row) == epochs.get(*row - 1);
    let interval = |row: usize| Interval { row, duration_s: times_s[row] - times_s[row - 1] };
    (1..times_s.len()).filter(is_in_epoch).map(interval).filter(|interval| interval.duration_s > 0.0).collect()
}

/// The longest interval that is no gap, s. Intervals differ where the rate does not fit the step, and where the step was changed: one that
/// leaves out no step is no gap, however long.
pub(super) fn regular_s(table: &Table) -> Option<f64> {
    let all = intervals(table);
    let mut durations_s: Vec<f64> = all.iter().map(|interval| interval.duration_s).collect();
    durations_s.sort_by(f64::total_cmp);
    let last = durations_s.len().checked_sub(1)?;
    let steps = table.column("stamp.step").unwrap_or_default();
    let leaves_out_none = |interval: &&Interval| interval.ends(steps).is_some_and(|[from, to]| to - from == 1.0);
    let of_a_step_s = all.iter().filter(leaves_out_none).map(|interval| interval.duration_s);
    durations_s.get((REGULAR * last as f64) as usize).copied().into_iter().chain(of_a_step_s).reduce(f64::max)
}

/// The intervals that are no gaps.
pub(super) fn regular_intervals(table: &Table) -> Vec<Interval> {
    let gap_s = GAP * regular_s(table).unwrap_or_default();
    intervals(table).into_iter().filter(|interval| interval.duration_s < gap_s).collect()
}

/// The step of a scene, or the steps of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    /// The longest, s.
    pub(super) longest_s: f64,
    /// Whether there are shorter ones, as at another level.
    pub(super) is_changed: bool,
}

/// The step between samples.
pub(super) fn step(table: &Table) -> Option<Step> {
    let steps = table.column("stamp.step")?;
    let step_s = |Interval { row, duration_s }| duration_s / (steps[row] - steps[row - 1]);
    let all_s = || intervals(table).into_iter().map(step_s).filter(|step_s| *step_s > 0.0);
    let [shortest_s, longest_s] = [all_s().reduce(f64::min)?, all_s().reduce(f64::max)?];
    let is_changed = longest_s > CHANGED * shortest_s;
    Some(Step { longest_s: if is_changed { longest_s } else { shortest_s }, is_changed })
}
