//! The response to a step of one input: its samples, and its largest values, which lie between them.

use super::failure::CommandResult;
use crate::small_motion::StateSpace;

/// Samples, but for that at 0.
pub(super) const SAMPLES: usize = 1000;
/// Parts of an interval between samples, at its beginning, where fast vibrations are largest, and about the largest samples.
pub(super) const PARTS: usize = 200;
/// Number of an output's largest crests that are looked at between samples.
const CRESTS: usize = 4;
/// A value between samples is told if it is larger than all of them by this part.
const MISSED: f64 = 0.01;
/// It counts from this part on: less is rounding.
const LARGER: f64 = 1e-6;

/// The step response of some outputs.
pub(super) struct AfterStep {
    pub times_s: Vec<f64>,
    /// Samples of each output.
    pub samples: Vec<Vec<f64>>,
    /// Time, s, and value of each output where it is largest in magnitude.
    pub peaks: Vec<(f64, f64)>,
}

impl AfterStep {
    /// Of these outputs of a space in continuous time.
    pub(super) fn new(space: &StateSpace, input: usize, outputs: &[usize], until_s: f64) -> CommandResult<Self> {
        let step_s = until_s / SAMPLES as f64;
        let (coarse, fine) = (space.zero_order_hold(step_s)?, space.zero_order_hold(step_s / PARTS as f64)?);
        let samples = coarse.step_response(input, SAMPLES + 1)?;
        let beginning = fine.step_response(input, SAMPLES + 1)?;
        let samples: Vec<Vec<f64>> = outputs.iter().map(|output| samples.row(*output).iter().copied().collect()).collect();
        let mut intervals: Vec<usize> = samples.iter().flat_map(|samples| about_crests(samples)).collect();
        intervals.sort_unstable();
        intervals.dedup();
        let within = coarse.step_response_within((&fine, PARTS), input, &intervals)?;
        let finer = || std::iter::once((0, &beginning)).chain(intervals.iter().copied().zip(&within));
        let peak = |(samples, output): (&Vec<f64>, &usize)| {
            let (at, value) = largest(samples);
            let finer = finer().flat_map(|(first, values)| {
                let values = values.row(*output).iter().copied().enumerate().collect::<Vec<_>>();
                values.into_iter().map(move |(part, value)| (first as f64 + part as f64 / PARTS as f64, value))
            });
            let keep =
                |most: (f64, f64), next: (f64, f64)| if next.1.abs() > (1.0 + LARGER) * most.1.abs() { next } else { most };
            let (at, value) = finer.fold((at as f64, value), keep);
            (at * step_s, value)
        };
        let peaks = samples.iter().zip(outputs).map(peak).collect();
        let times_s = (0..=SAMPLES).map(|sample| step_s * sample as f64).collect();
        Ok(AfterStep { times_s, samples, peaks })
    }

    /// Time, s, of an output's largest value, if no sample is nearly as large.
    pub(super) fn missed_s(&self, output: usize) -> Option<f64> {
        let (at_s, peak) = self.peaks[output];
        (peak.abs() > (1.0 + MISSED) * largest(&self.samples[output]).1.abs()).then_some(at_s)
    }

    /// A length of the step response whose samples show values at the times.
    pub(super) fn until_s(&self, missed_s: &[f64]) -> Option<f64> {
        let step_s = *self.times_s.get(1)?;
        let latest_s = missed_s.iter().copied().fold(0.0, f64::max);
        let until_s = (step_s * (SAMPLES / PARTS) as f64).max(1.1 * latest_s);
        (until_s < 0.5 * step_s * SAMPLES as f64).then_some(until_s)
    }

    /// Whether an output is largest at the end.
    pub(super) fn ends_largest(&self) -> bool {
        self.samples.iter().any(|samples| largest(samples).0 + 1 == samples.len())
    }
}

/// Intervals beside the largest of the samples that are no smaller than their neighbours.
fn about_crests(samples: &[f64]) -> Vec<usize> {
    let size = |at: usize| samples.get(at).map_or(0.0, |value| value.abs());
    let mut crests: Vec<usize> = (1..samples.len()).filter(|&at| size(at) >= size(at - 1) && size(at) >= size(at + 1)).collect();
    crests.sort_by(|one, other| size(*other).total_cmp(&size(*one)));
    crests.truncate(CRESTS);
    crests.into_iter().flat_map(|at| [at - 1, at]).filter(|interval| interval + 1 < samples.len()).collect()
}

/// First place and value of the finite number largest in magnitude.
pub(super) fn largest(values: &[f64]) -> (usize, f64) {
    let finite = values.iter().copied().enumerate().filter(|(_, value)| value.is_finite());
    finite.reduce(|most, next| if next.1.abs() > most.1.abs() { next } else { most }).unwrap_or((0, f64::NAN))
}
