//! The response over frequency to one input: its samples, and with them the frequencies at which an output is largest.

use nalgebra::{Complex, DVector};

use super::peaks::largest_between;
use super::phases::unwrap;
use super::progress::bar;
use super::unmoved::moves;
use crate::small_motion::StateSpace;

/// The frequency response of some outputs.
pub(super) struct OverFrequency {
    pub frequencies_hz: Vec<f64>,
    /// Magnitudes and phases (degrees, unwrapped) of each output; NaN at the frequency of a vibration without damping.
    pub magnitudes: Vec<Vec<f64>>,
    pub phases_deg: Vec<Vec<f64>>,
    /// The largest angle of all outputs of the space, rad.
    pub largest_rad: f64,
    /// Whether each output moves with the input by more than rounding.
    pub moves: Vec<bool>,
}

/// A frequency, Hz, and all outputs there, if there is a response.
type Sample = (f64, Option<DVector<Complex<f64>>>);

impl OverFrequency {
    /// Computes these outputs at these frequencies, and where each is largest between them. `natural` are the frequencies, Hz, and damping
    /// ratios of the space, `length_m` is the length of the chain, if there is one.
    pub(super) fn new(
        space: &StateSpace,
        (input, outputs): (usize, &[usize]),
        mut frequencies_hz: Vec<f64>,
        (natural, length_m): (&[[f64; 2]], Option<f64>),
    ) -> Self {
        let sample = |hz: f64| (hz, space.frequency_response(input, hz).ok());
        let progress = bar(frequencies_hz.len() as u64, "{wide_bar} {pos}/{len} frequencies{left}");
        let mut samples: Vec<Sample> = Vec::new();
        for hz in &frequencies_hz {
            samples.push(sample(*hz));
            progress.inc(1);
        }
        let between = |output: &usize| {
            let size = |hz: f64| magnitude(&sample(hz), *output);
            let magnitudes: Vec<f64> = samples.iter().map(|sample| magnitude(sample, *output)).collect();
            largest_between([&frequencies_hz, &magnitudes], natural, size)
        };
        let further: Vec<Sample> = outputs.iter().filter_map(between).map(sample).collect();
        progress.finish_and_clear();
        samples.extend(further);
        samples.sort_by(|one, other| one.0.total_cmp(&other.0));
        samples.dedup_by(|one, other| one.0 == other.0);
        frequencies_hz = samples.iter().map(|(hz, _)| *hz).collect();
        let magnitudes: Vec<Vec<f64>> =
            outputs.iter().map(|output| samples.iter().map(|sample| magnitude(sample, *output)).collect()).collect();
        let phase =
            |(_, found): &Sample, output: usize| found.as_ref().map_or(f64::NAN, |found| found[output].arg().to_degrees());
        let mut phases_deg: Vec<Vec<f64>> =
            outputs.iter().map(|output| samples.iter().map(|sample| phase(sample, *output)).collect()).collect();
        phases_deg.iter_mut().zip(&magnitudes).for_each(|(phases, magnitudes)| unwrap(phases, magnitudes));
        let angles: Vec<usize> = (0..space.outputs.len()).filter(|&output| space.outputs[output].ends_with("_rad")).collect();
        let angles_rad = samples.iter().flat_map(|sample| angles.iter().map(|angle| magnitude(sample, *angle)));
        let moves = moves(space, (input, outputs), &frequencies_hz, length_m);
        let largest_rad = angles_rad.fold(0.0, f64::max);
        OverFrequency { frequencies_hz, magnitudes, phases_deg, largest_rad, moves }
    }
}

fn magnitude((_, found): &Sample, output: usize) -> f64 {
    found.as_ref().map_or(f64::NAN, |found| found[output].norm())
}
