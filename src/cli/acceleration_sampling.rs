//! Accelerations of links that a recording has too few samples to show.
//!
//! The rates of a link betray them: their change over an interval, divided by its duration, is the mean acceleration. The line
//! from sample to sample of the acceleration has another mean where it misses a vibration. The acceleration of a vibration grows
//! with the square of its frequency, and so do forces: lines may miss them where they draw deflections right.

use super::sample_intervals::{EVERY_STEP, Interval, regular_intervals, regular_s, step};
use super::suggested_rate::coarse_s;
use super::vibration_sampling::momentary_hz;
use crate::study::Table;

/// How names of columns of accelerations end.
pub(super) const ACCELERATION: &str = ".acceleration_rad_per_s2";
/// Most that the mean of a line from sample to sample may be off, over the range of the acceleration. Three lines in a row of a
/// vibration over the whole range exceed it with fewer than 4.4 samples in a period. In 355 recordings of 26 scenes, every curve
/// that is named is off by 0.07 of its range or more in four lines at least.
const MISSED: f64 = 0.05;
/// Fewer lines in a row may be off. The edge of a torque makes one line wrong, a short pulse two, and both leave others right.
const FEWEST: usize = 3;
/// Ranges of the acceleration up to this are those of links at rest, rad/s².
const REST: f64 = 1e-5;
/// Ranges of the acceleration up to this part of the squared rate are those of links that turn evenly.
const EVEN: f64 = 1e-6;

/// A sentence about the topic `angles` of a recording if lines between its samples miss accelerations of links. Where every step
/// was recorded, no rate could help.
pub(super) fn rare_accelerations(angles: &Table) -> Option<String> {
    let step_s = step(angles)?.longest_s;
    let leaves_out_steps = step_s <= EVERY_STEP * regular_s(angles)?;
    let regular = leaves_out_steps.then(|| regular_intervals(angles))?;
    let link = |name: &str| Some(name.strip_prefix("links.")?.strip_suffix(ACCELERATION)?.to_owned());
    let missed = |link: String| Some((missed_hz(angles, &link, &regular)?, format!("the {link}")));
    let links = angles.columns().filter_map(|(name, _)| link(name));
    let (frequencies_hz, links): (Vec<f64>, Vec<String>) = links.filter_map(missed).unzip();
    let fastest_hz = frequencies_hz.into_iter().reduce(f64::max)?;
    // The frequency may be too high.
    let steps = if step_s > coarse_s(fastest_hz) { ", perhaps with a shorter solver.step_s," } else { "" };
    let links = links.join(" and ");
    let so = "so that curves of them, and perhaps of forces, have wrong swings and peaks";
    Some(format!("samples are too rare for accelerations of {links}, {so}; record with --publish-hz all{steps} for right ones"))
}

/// The frequency of a vibration, Hz, if lines from sample to sample miss too much of the acceleration of a link.
fn missed_hz(angles: &Table, link: &str, regular: &[Interval]) -> Option<f64> {
    let column = |ending: &str| angles.column(&format!("links.{link}{ending}")).unwrap_or_default();
    let [rates, accelerations] = [".rate_rad_per_s", ACCELERATION].map(column);
    let fastest = rates.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
    let [least, most] = accelerations
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| [least.min(*value), most.max(*value)]);
    let range = (most - least).max(REST).max(EVEN * fastest.powi(2));
    let is_off = |interval: &Interval| off(rates, accelerations, interval).is_some_and(|off| off > MISSED * range);
    let missed: Vec<bool> = regular.iter().map(is_off).collect();
    let missed_rows = regular.iter().zip(&missed).filter_map(|(interval, missed)| missed.then_some(interval.row));
    let rows: Vec<usize> = missed_rows.collect();
    let is_vibration = rows.chunk_by(|row, next| row + 1 == *next).any(|run| run.len() >= FEWEST);
    is_vibration.then(|| momentary_hz([rates, accelerations], regular, &missed))
}

/// The amount by which the mean of the line between two samples is off, rad/s²: `|Δω/h − (α₀ + α₁)/2|` with rates `ω` and
/// accelerations `α` at both ends of the interval `h`.
fn off(rates: &[f64], accelerations: &[f64], interval: &Interval) -> Option<f64> {
    let ([rate_before, rate_after], [before, after]) = (interval.ends(rates)?, interval.ends(accelerations)?);
    Some(((rate_after - rate_before) / interval.duration_s - 0.5 * (before + after)).abs())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::plot::SIMULATED_TIME;

    const STEP_S: f64 = 1e-4;
    const VIBRATION_HZ: f64 = 97.0;

    /// Samples of a rod at these steps, with rate and acceleration as functions of time.
    fn samples(step_s: f64, steps: &[u32], motion: &dyn Fn(f64) -> [f64; 2]) -> Table {
        let times_s: Vec<f64> = steps.iter().map(|step| step_s * f64::from(*step)).collect();
        let mut table = Table::default();
        table.push("stamp.epoch", vec![0.0; steps.len()]);
        table.push("stamp.step", steps.iter().map(|step| f64::from(*step)).collect());
        table.push("links.rod.rate_rad_per_s", times_s.iter().map(|t| motion(*t)[0]).collect());
        table.push("links.rod.acceleration_rad_per_s2", times_s.iter().map(|t| motion(*t)[1]).collect());
        table.push(SIMULATED_TIME, times_s);
        table
    }

    /// A vibration with this amplitude of its acceleration.
    fn vibration(amplitude: f64) -> impl Fn(f64) -> [f64; 2] {
        let omega = TAU * VIBRATION_HZ;
        move |t: f64| [3.0 - amplitude / omega * (omega * t + 0.7).cos(), amplitude * (omega * t + 0.7).sin()]
    }

    fn every(steps: u32) -> Vec<u32> {
        (0..200).map(|row| steps * row).collect()
    }

    fn vibrating(steps: &[u32]) -> Option<String> {
        rare_accelerations(&samples(STEP_S, steps, &vibration(10.0)))
    }

    /// The sentence with this rate.
    fn said(how: &str) -> String {
        let so = "so that curves of them, and perhaps of forces, have wrong swings and peaks; record with --publish-hz";
        format!("samples are too rare for accelerations of the rod, {so} {how} for right ones")
    }

    #[test]
    fn regress_accelerations_that_samples_are_too_rare_for_are_named() {
        for steps in [24, 50, 60, 99, 100, 400] {
            assert_eq!(vibrating(&every(steps)), Some(said("all")), "every {steps} steps");
        }
        assert_eq!(rare_accelerations(&Table::default()), None);
        assert_eq!(vibrating(&every(50)[..2]), None, "one line");
    }

    /// Six samples in a period of 97 Hz are 1.7 ms apart.
    #[test]
    fn regress_accelerations_that_even_every_step_may_be_too_rare_for_have_shorter_steps_named() {
        for (step_s, how) in [(2e-3, "all, perhaps with a shorter solver.step_s,"), (1.5e-3, "all")] {
            let rare = rare_accelerations(&samples(step_s, &every(2), &vibration(10.0)));
            assert_eq!(rare, Some(said(how)), "{step_s} s");
        }
    }

    /// The middle of a line over the top of a vibration with `n` samples in a period is off by `1 − cos(π/n)` of half the range.
    #[test]
    fn regress_a_curve_of_accelerations_that_is_off_by_an_eighth_of_its_range_is_named() {
        for steps in 2..=30_u32 {
            let off = 0.5 * (1.0 - (0.5 * TAU * VIBRATION_HZ * STEP_S * f64::from(steps)).cos());
            let said = vibrating(&every(steps));
            assert!(said.is_some() || off < 0.125, "every {steps} steps: off by {off}");
            assert!(said.is_none() || off > 0.05, "every {steps} steps: off by {off}, and {said:?}");
        }
    }

    #[test]
    fn regress_edges_of_torques_are_no_vibration() {
        // Two pulses whose edges lie between samples. Those of short pulses lie in neighbouring intervals.
        for duration_s in [0.16, 0.0095, 0.0075, 0.005] {
            let is_on = |t: f64, start_s: f64| (start_s..start_s + duration_s).contains(&t);
            let pulse = |t: f64, start_s: f64| [(t - start_s).clamp(0.0, duration_s), f64::from(is_on(t, start_s))];
            let pulses = |t: f64| {
                let [[first_rate, first], [second_rate, second]] = [pulse(t, 0.1013), pulse(t, 0.5013)];
                [first_rate - second_rate, first - second]
            };
            assert_eq!(rare_accelerations(&samples(STEP_S, &every(50), &pulses)), None, "{duration_s} s");
        }
    }

    #[test]
    fn regress_rest_and_even_turning_are_no_vibration() {
        assert_eq!(rare_accelerations(&samples(STEP_S, &every(50), &vibration(1e-9))), None);
        let even = |t: f64| [100.0 + 1e-8 * (1e4 * t).sin(), 1e-4 * (1e4 * t).cos()];
        assert_eq!(rare_accelerations(&samples(STEP_S, &every(50), &even)), None);
    }

    #[test]
    fn regress_samples_of_every_step_leave_nothing_out() {
        assert_eq!(rare_accelerations(&samples(5e-3, &every(1), &vibration(10.0))), None);
    }
}
