//! Peaks of a frequency response: natural frequencies, those whose peak is not met, and where an output is largest.

use std::f64::consts::TAU;

use super::after_step::largest;
use super::aligned_table::figure;
use crate::small_motion::Mode;

/// Vibrations that are less damped have a peak that no frequency meets.
pub(super) const UNDAMPED: f64 = 1e-8;
/// Crests of less than this part of the largest value among the frequencies computed cannot be the largest.
const NEARLY_LARGEST: f64 = 0.9;
/// Golden sections that find a crest to 1e-7 of the interval about it: its magnitude is then exact but for rounding.
const SECTIONS: usize = 34;
/// Less is rounding.
const LARGER: f64 = 1e-12;

/// Natural frequencies, Hz, and damping ratios.
pub(super) fn natural_hz(found: &[Mode]) -> Vec<[f64; 2]> {
    let vibrations = found.iter().filter(|mode| mode.eigenvalue.im > 0.0);
    vibrations.map(|mode| [mode.eigenvalue.norm() / TAU, mode.damping_ratio()]).collect()
}

/// The remark on vibrations of a range whose peaks no frequency meets.
pub(super) fn unmet(natural: &[[f64; 2]], frequencies_hz: &[f64]) -> Option<String> {
    let [low, high] = [frequencies_hz.first()?, frequencies_hz.last()?];
    let in_range = || natural.iter().filter(|[hz, _]| (low..=high).contains(&hz));
    let unmet: Vec<String> =
        in_range().filter(|[_, damping]| *damping <= UNDAMPED).map(|[hz, _]| format!("{} Hz", figure(*hz))).collect();
    let named = if unmet.len() > 1 && unmet.len() == in_range().count() { "all vibrations".to_owned() } else { unmet.join(", ") };
    (!unmet.is_empty()).then(|| {
        format!(
            "  {named}: damped by less than {UNDAMPED:e} of the critical damping, so that the largest response there is not known"
        )
    })
}

/// The frequency at which an output is largest, Hz, if it lies between those computed: by golden sections about the larger crests of
/// its magnitudes. None of a crest beside a natural frequency whose peak no frequency meets.
pub(super) fn largest_between(
    [frequencies_hz, magnitudes]: [&[f64]; 2],
    natural: &[[f64; 2]],
    size: impl Fn(f64) -> f64,
) -> Option<f64> {
    let (_, largest) = largest(magnitudes);
    let last = magnitudes.len().checked_sub(1)?;
    let is_met = |[from_hz, to_hz]: &[f64; 2]| {
        !natural.iter().any(|[hz, damping]| *damping <= UNDAMPED && (from_hz..=to_hz).contains(&hz))
    };
    let about = |at: usize| [at.saturating_sub(1), (at + 1).min(last)];
    let is_crest = |at: &usize| {
        let size = magnitudes[*at];
        let beside = about(*at).map(|beside| magnitudes[beside]);
        // Not of what is the same everywhere.
        size >= NEARLY_LARGEST * largest && beside.iter().all(|other| size >= *other) && beside.iter().any(|other| size > *other)
    };
    let intervals = (0..=last).filter(is_crest).map(|at| about(at).map(|beside| frequencies_hz[beside]));
    let crests = intervals
        .filter(is_met)
        .map(|interval| crest_hz(interval, &size))
        .map(|hz| (hz, size(hz)))
        .filter(|(_, size)| size.is_finite());
    let (hz, highest) = crests.max_by(|one, other| one.1.total_cmp(&other.1))?;
    (highest > (1.0 + LARGER) * largest).then_some(hz)
}

/// The frequency in an interval with one crest at which it lies, Hz.
fn crest_hz([mut low_hz, mut high_hz]: [f64; 2], size: impl Fn(f64) -> f64) -> f64 {
    let part = 0.5 * (5.0_f64.sqrt() - 1.0);
    let inside = |low_hz: f64, high_hz: f64| [high_hz - part * (high_hz - low_hz), low_hz + part * (high_hz - low_hz)];
    let [mut lower_hz, mut upper_hz] = inside(low_hz, high_hz);
    let [mut lower, mut upper] = [lower_hz, upper_hz].map(&size);
    for _ in 0..SECTIONS {
        if lower >= upper {
            (high_hz, upper_hz, upper) = (upper_hz, lower_hz, lower);
            lower_hz = inside(low_hz, high_hz)[0];
            lower = size(lower_hz);
        } else {
            (low_hz, lower_hz, lower) = (lower_hz, upper_hz, upper);
            upper_hz = inside(low_hz, high_hz)[1];
            upper = size(upper_hz);
        }
    }
    0.5 * (low_hz + high_hz)
}

#[cfg(test)]
mod tests {
    use super::{largest_between, unmet};

    /// A vibration of 2 Hz and its largest response, `1/(2 ζ √(1 − ζ²))` at `2 √(1 − 2 ζ²)`, beside a smaller one, among few
    /// frequencies; at an end of the range; and without damping.
    #[test]
    fn val_the_largest_response_lies_between_the_frequencies() {
        let [damping, hz] = [0.2_f64, 2.0];
        let one = |f: f64, hz: f64, damping: f64| {
            let part = f / hz;
            ((1.0 - part * part).powi(2) + (2.0 * damping * part).powi(2)).sqrt().recip()
        };
        let largest = |frequencies_hz: &[f64], natural: &[[f64; 2]], size: &dyn Fn(f64) -> f64| {
            let magnitudes: Vec<f64> = frequencies_hz.iter().map(|hz| size(*hz)).collect();
            largest_between([frequencies_hz, &magnitudes], natural, size)
        };
        let single = |f: f64| one(f, hz, damping);
        let at_hz = hz * (1.0 - 2.0 * damping * damping).sqrt();
        let few: Vec<f64> = (0..30).map(|k| 0.5 + 0.15 * f64::from(k)).collect();
        let found = largest(&few, &[[hz, damping]], &single);
        assert!(found.is_some_and(|found| (found - at_hz).abs() < 1e-6), "{found:?}");
        // Two crests, of which the frequencies meet the smaller one exactly.
        let two = |f: f64| single(f).max(0.999 * single(at_hz) * one(f, 4.1, 0.1) / one(4.1 * 0.98_f64.sqrt(), 4.1, 0.1));
        let mut met: Vec<f64> = few.iter().copied().chain([4.1 * 0.98_f64.sqrt()]).collect();
        met.sort_by(f64::total_cmp);
        let found = largest(&met, &[], &two);
        assert!(found.is_some_and(|found| (found - at_hz).abs() < 1e-6), "{found:?}");
        // Largest at an end, and everywhere alike.
        assert_eq!(largest(&few[12..], &[], &single), None);
        assert_eq!(largest(&few[..8], &[], &single), None);
        for flat in [1.0, 0.0] {
            assert_eq!(largest(&few, &[], &|_| flat), None);
        }
        // Frequencies that hardly differ: sections between them cannot be shorter than rounding.
        let close: Vec<f64> = (0..30).map(|k| at_hz * (1.0 + 2e-11 * f64::from(k - 15))).collect();
        assert!(largest(&close, &[], &single).is_none_or(|found| (found / at_hz - 1.0).abs() < 1e-9));
        // Without damping, no frequency is the largest.
        assert_eq!(largest(&few, &[[hz, 0.0]], &|f| one(f, hz, 0.0)), None);
    }

    /// Only vibrations of the range count.
    #[test]
    fn regress_vibrations_whose_peaks_are_not_met_are_named() {
        let natural = [[10.0, 1e-3], [20.0, 5e-11], [300.0, 0.0]];
        assert!(unmet(&natural, &[1.0, 100.0]).is_some_and(|remark| remark.starts_with("  20 Hz: damped by less than 1e-8")));
        assert!(unmet(&natural, &[1.0, 300.0]).is_some_and(|remark| remark.starts_with("  20 Hz, 300 Hz: ")));
        assert_eq!(unmet(&natural, &[1.0, 19.0]), None);
        assert!(unmet(&natural[1..], &[1.0, 300.0]).is_some_and(|remark| remark.starts_with("  all vibrations: damped by less")));
    }
}
