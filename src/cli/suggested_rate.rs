//! The argument of `--publish-hz` that shows a motion.

use super::aligned_table::figure;
use super::sample_intervals::Step;
use super::suggested_step::one_digit;
use crate::shown::shown_s;
use crate::simulation::PublishRate;

/// Suggested rates are multiples of this, Hz.
const ROUND_HZ: f64 = 100.0;
/// Error of a rate, over [`ROUND_HZ`], that is due to the rounding of times.
const ROUNDING: f64 = 1e-6;
/// Samples in a period that draw a vibration as a smooth curve. Lines between them miss peaks by 5 %.
const SMOOTH: f64 = 10.0;
/// Samples in a period that show a vibration roughly. Lines between them miss peaks by up to 13 %, and `plot` warns of fewer than 5.4.
const ROUGH: f64 = 6.0;

/// The rate with samples no further apart than `smooth_s`. Only whole steps are published, and steps longer than `coarse_s` do not
/// suffice.
pub(super) fn suggested_rate(smooth_s: f64, coarse_s: f64, step: Step) -> String {
    let step_s = step.longest_s;
    let steps = (smooth_s / step_s).floor();
    if step_s > coarse_s {
        let everywhere = if step.is_changed {
            ", and at every level and after every change a solver.step_s of at most"
        } else {
            " and solver.step_s ="
        };
        format!("all{everywhere} {}", shown_s(one_digit(smooth_s)))
    } else if steps < 2.0 {
        "all".to_owned()
    } else {
        ((1.0 / (steps * step_s * ROUND_HZ) - ROUNDING).ceil() * ROUND_HZ).to_string()
    }
}

/// The longest time between samples that show a vibration roughly, s.
pub(super) fn coarse_s(vibration_hz: f64) -> f64 {
    1.0 / (ROUGH * vibration_hz)
}

/// The longest time between samples that draw a vibration as a smooth curve, s.
pub(super) fn smooth_s(vibration_hz: f64) -> f64 {
    1.0 / (SMOOTH * vibration_hz)
}

/// A remark of `check` on the lowest frequency of a kind of vibration, bending or of masses, if samples at the default rate do not show it.
pub(super) fn beyond_default(what: &str, vibration_hz: f64, step_s: f64) -> Option<String> {
    let PublishRate::Hz(rate_hz) = PublishRate::DEFAULT else { return None };
    // Longer steps are all published.
    let rate_hz = rate_hz.min(1.0 / step_s);
    let coarse_s = coarse_s(vibration_hz);
    let shows = || suggested_rate(smooth_s(vibration_hz), coarse_s, Step { longest_s: step_s, is_changed: false });
    let [rate, vibration] = [rate_hz, vibration_hz].map(figure);
    let remark = || format!("{rate} times a second; {what} at {vibration} Hz shows with --publish-hz {}", shows());
    (coarse_s * rate_hz < 1.0).then(remark)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The step of the scene was named, where that of a level was too long.
    #[test]
    fn regress_a_step_that_was_changed_is_told_from_that_of_the_scene() {
        let how = |is_changed| suggested_rate(2e-3, 4e-3, Step { longest_s: 1e-2, is_changed });
        assert_eq!(how(false), "all and solver.step_s = 0.002");
        assert_eq!(how(true), "all, and at every level and after every change a solver.step_s of at most 0.002");
    }

    #[test]
    fn regress_a_bending_frequency_that_the_default_rate_does_not_show_is_named() {
        let shows = |how: &str| Some(format!("200 times a second; bending at 201 Hz shows with --publish-hz {how}"));
        for (bending_hz, step_s, expected) in [
            (201.0, 1e-5, shows("2100")),
            (201.0, 4e-4, shows("all")),
            (201.0, 8e-4, shows("all")),
            // Five samples in a period are too rare for `plot`.
            (201.0, 1e-3, shows("all and solver.step_s = 0.0004")),
            (201.0, 2e-3, shows("all and solver.step_s = 0.0004")),
            (33.0, 4e-4, None),
            (11.0, 2e-3, None),
        ] {
            assert_eq!(beyond_default("bending", bending_hz, step_s), expected, "{bending_hz} Hz, {step_s} s");
        }
        let every_step = "100 times a second; bending at 49 Hz shows with --publish-hz all and solver.step_s = 0.002";
        assert_eq!(beyond_default("bending", 49.0, 1e-2).as_deref(), Some(every_step));
    }
}
