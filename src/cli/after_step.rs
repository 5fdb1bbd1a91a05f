//! The response to a step of one input: its samples, and its largest values, which lie between them.

use super::failure::CommandResult;
use crate::small_motion::StateSpace;

/// Samples, but for that at 0.
pub(super) const SAMPLES: usize = 1000;
/// Each length of the response is so many times the next shorter one: fast vibrations are largest where they begin.
const SHORTER: usize = 4;
/// Intervals about the largest samples are looked at by the steps of the length so many places further: 64 times as short.
const FURTHER: usize = 3;
/// A step of less than this part of `1/|λ|` resolves what decays or vibrates by λ.
const RESOLVED: f64 = 0.2;
/// Most lengths.
const LENGTHS: usize = 24;
/// Number of an output's largest crests that are looked at between samples.
const CRESTS: usize = 4;
/// Samples follow a crest if their second difference is below this part of it: some 100 in a period.
const NEAR: f64 = 3e-3;
/// A value between samples is told if it is larger than all of them by this part.
const MISSED: f64 = 0.01;
/// A response so many times as long as it takes to the latest of them shows them.
const SHOWN: f64 = 4.0;
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
    /// Of these outputs of a space in continuous time, whose modes have eigenvalues up to `fastest_per_s` in size.
    ///
    /// The largest values are looked for in responses of ever shorter lengths, down to one whose steps resolve all modes: a vibration that
    /// dies in one step of the whole is largest at the beginning. About the largest samples of each, shorter steps are taken.
    pub(super) fn new(
        space: &StateSpace,
        input: usize,
        outputs: &[usize],
        (until_s, fastest_per_s): (f64, f64),
    ) -> CommandResult<Self> {
        let step_s = until_s / SAMPLES as f64;
        let steps_s = |place: usize| step_s / (SHORTER as f64).powi(place as i32);
        let number = (FURTHER..LENGTHS).find(|place| steps_s(*place) * fastest_per_s <= RESOLVED).unwrap_or(LENGTHS);
        let holds = (0..=number).map(|place| space.zero_order_hold(steps_s(place))).collect::<Result<Vec<_>, _>>()?;
        let mut samples: Vec<Vec<f64>> = Vec::new();
        let mut peaks = vec![(0.0, f64::NAN); outputs.len()];
        for (place, hold) in holds.iter().enumerate() {
            let found = hold.step_response(input, SAMPLES + 1)?;
            let found: Vec<Vec<f64>> = outputs.iter().map(|output| found.row(*output).iter().copied().collect()).collect();
            let mut intervals: Vec<usize> = found.iter().flat_map(|samples| about_crests(samples)).collect();
            intervals.sort_unstable();
            intervals.dedup();
            let finer = (place + FURTHER).min(number);
            let parts = SHORTER.pow((finer - place) as u32);
            let within = hold.step_response_within((&holds[finer], parts), input, &intervals)?;
            for (output, (samples, peak)) in found.iter().zip(&mut peaks).enumerate() {
                let (at, value) = crest(samples);
                *peak = larger(*peak, (at * steps_s(place), value));
                for (first, values) in intervals.iter().zip(&within) {
                    let values: Vec<f64> = values.row(outputs[output]).iter().copied().collect();
                    let (part, value) = crest(&values);
                    *peak = larger(*peak, ((*first as f64 + part / parts as f64) * steps_s(place), value));
                }
            }
            if place == 0 {
                samples = found;
            }
        }
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
        let until_s = SHOWN * latest_s;
        (until_s < 0.5 * step_s * SAMPLES as f64).then_some(until_s)
    }

    /// Whether an output is largest at the end.
    pub(super) fn ends_largest(&self) -> bool {
        self.samples.iter().any(|samples| largest(samples).0 + 1 == samples.len())
    }
}

/// The time and value that is larger in magnitude; the first, if the other is larger by rounding alone.
fn larger(one: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    if one.1.is_nan() || other.1.abs() > (1.0 + LARGER) * one.1.abs() { other } else { one }
}

/// Place and value of the number largest in magnitude, at the crest of the parabola through it and its neighbours: where these are near
/// enough for one.
fn crest(values: &[f64]) -> (f64, f64) {
    let (at, value) = largest(values);
    let [Some(before), Some(after)] = [at.checked_sub(1), Some(at + 1)].map(|at| at.and_then(|at| values.get(at))) else {
        return (at as f64, value);
    };
    let (slope, curve) = (0.5 * (after - before), after - 2.0 * value + before);
    let is_near = curve.abs() <= NEAR * value.abs() && curve * value < 0.0;
    if is_near { (at as f64 - slope / curve, value - 0.5 * slope * slope / curve) } else { (at as f64, value) }
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

#[cfg(test)]
mod tests {
    use std::error::Error;

    use super::AfterStep;
    use crate::scene::SceneSource;
    use crate::small_motion::{StateSpace, Subject, modes};

    /// An arm of two carbon tubes that hangs down from a servo, x pointing down.
    const ARM: &str = "[crank]\nlength_m = 0.45\nsection = { shape = \"tube\", outer_m = 0.030, inner_m = 0.027 }\n\
                       density_kg_per_m3 = 1550.0\nyoungs_modulus_pa = 7.0e10\nelements = 8\ndamping_s = 1e-5\n[rod]\n\
                       length_m = 0.40\nsection = { shape = \"tube\", outer_m = 0.022, inner_m = 0.020 }\n\
                       density_kg_per_m3 = 1550.0\nyoungs_modulus_pa = 7.0e10\nelements = 8\ndamping_s = 1e-5\n[tip]\n\
                       mass_kg = 0.3\n[base]\ntorsion_spring_nm_per_rad = 40.0\ndamper_nm_s_per_rad = 0.05\n[gravity]\n\
                       x_m_per_s2 = 9.81\n[solver]\nmodel = \"modal\"\nintegrator = \"esdirk\"\nstep_s = 0.001\n";

    /// Its rod bends most after a millisecond, and that dies within a tenth of a second. Of a response of 300 s, half of it was told. The
    /// figures are those of sums over all eigenvalues, `Σ cₖ bₖ (e^(λₖt) − 1)/λₖ`, on a grid of millions of points.
    #[test]
    fn val_the_largest_value_after_a_step_is_found_at_every_length() -> Result<(), Box<dyn Error>> {
        let subject = Subject::new(&SceneSource::parse("arm.toml", ARM, &[])?.scene, None)?;
        let point = subject.at_rest(0.0)?;
        let space = StateSpace::new(&subject, &point)?;
        let output = |name: &str| space.outputs.iter().position(|other| other == name).ok_or(name.to_owned());
        let outputs = [output("rod_deflection_m")?, output("crank_deflection_m")?];
        let fastest_per_s = modes(&subject, &point, 10)?.iter().map(|mode| mode.eigenvalue.norm()).fold(0.0, f64::max);
        for until_s in [300.0, 100.0, 30.0, 12.8, 0.002] {
            let found = AfterStep::new(&space, 0, &outputs, (until_s, fastest_per_s)).map_err(|_| "no response")?;
            for ((at_s, value), (expected_s, expected)) in
                found.peaks.iter().zip([(1.1522e-3, -1.66857e-5), (0.6945e-3, 1.88741e-5)])
            {
                assert!((value / expected - 1.0).abs() < 2e-5, "{until_s} s: {value} for {expected}");
                assert!((at_s - expected_s).abs() < 2e-6, "{until_s} s: at {at_s} s for {expected_s} s");
            }
        }
        Ok(())
    }
}
