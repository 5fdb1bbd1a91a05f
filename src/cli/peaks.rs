//! Peaks of a frequency response: natural frequencies, and those whose peak is not met.

use std::f64::consts::TAU;

use super::aligned_table::figure;
use crate::small_motion::Mode;

/// Vibrations that are less damped have a peak that no frequency meets.
pub(super) const UNDAMPED: f64 = 1e-8;

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

#[cfg(test)]
mod tests {
    use super::unmet;

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
