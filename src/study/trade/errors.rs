//! Errors of sampled runs against each other, and of their energy.

use super::output_group::{CHANNELS, OutputGroup, Sample};
use super::ringing::Ringing;

const N: usize = CHANNELS.len();

/// Differences from another run: absolute, and over each channel's scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Root mean square over the instants, in each channel's unit.
    pub rms: [f64; N],
    /// Largest, in each channel's unit.
    pub max: [f64; N],
    /// Largest over the channel's scale.
    pub relative: [f64; N],
    /// Largest error of the energy balance over the most energy.
    pub energy: f64,
}

impl Errors {
    /// Errors of `run` against `reference` in everything but energy. A quantity that the run does not compute has infinite error.
    pub(super) fn between(run: &[Sample], reference: &[Sample], scales: &[f64; N]) -> Self {
        let (mut squares, mut max) = ([0.0; N], [0.0_f64; N]);
        for (a, b) in run.iter().zip(reference) {
            for k in 0..N {
                let off = (a[k][0] - b[k][0]).hypot(a[k][1] - b[k][1]);
                let off = if off.is_nan() { f64::INFINITY } else { off };
                squares[k] += off * off;
                max[k] = max[k].max(off);
            }
        }
        let rms = squares.map(|square| (square / run.len().max(1) as f64).sqrt());
        Errors { rms, max, relative: std::array::from_fn(|k| max[k] / scales[k]), energy: 0.0 }
    }

    /// Errors where something may ring. Of links, deflections and forces are unknown, angle and place of the end nearly right. Of the
    /// base, all are unknown but deflections of links none of which `bends`.
    pub(super) fn of_unknown(ringing: Ringing, bends: bool) -> Self {
        let is_unknown = |output| match output {
            OutputGroup::Deflection => bends,
            OutputGroup::Forces => true,
            _ => ringing == Ringing::Base,
        };
        let relative = CHANNELS.map(|channel| if is_unknown(channel.output) { 1.0 } else { 0.0 });
        Errors { rms: [0.0; N], max: [0.0; N], relative, energy: 0.0 }
    }

    /// The larger of each.
    pub(super) fn or_larger(&self, other: &Errors) -> Self {
        let larger = |one: &[f64; N], other: &[f64; N]| std::array::from_fn(|k| one[k].max(other[k]));
        Errors {
            rms: larger(&self.rms, &other.rms),
            max: larger(&self.max, &other.max),
            relative: larger(&self.relative, &other.relative),
            energy: self.energy.max(other.energy),
        }
    }

    /// The largest relative error of one output.
    pub fn of(&self, output: OutputGroup) -> f64 {
        let channels = CHANNELS.iter().zip(self.relative).filter(|(channel, _)| channel.output == output).map(|(_, e)| e);
        channels.fold(if output == OutputGroup::Energy { self.energy } else { 0.0 }, f64::max)
    }

    /// The largest relative error among `outputs`.
    pub fn worst(&self, outputs: &[OutputGroup]) -> f64 {
        outputs.iter().map(|output| self.of(*output)).fold(0.0, f64::max)
    }
}
