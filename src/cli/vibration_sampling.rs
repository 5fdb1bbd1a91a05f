//! Vibrations of links that a recording has too few samples to show.
//!
//! Samples that are too rare show a vibration at another, lower frequency (aliasing), but velocities betray it: the cubic through
//! two deflections with their rates leaves the line between them. Spectra, and changes from sample to sample, show how fast the
//! link vibrates: those of a deflection and of its rate have the ratio ω.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::sample_intervals::{EVERY_STEP, Interval, regular_intervals, regular_s, step};
use super::sampled_deflection::{Deflection, links};
use super::suggested_rate::{coarse_s, smooth_s, suggested_rate};
use crate::study::Table;

/// Samples of a stretch whose spectra are computed.
const STRETCH: usize = 64;
/// Most that a line from sample to sample may be off, over the range of the deflection. Lines of a vibration over the whole range
/// exceed it with fewer than 5.4 samples in a period, and are off by 0.024 with 10. In recordings of the built-in scenes at the
/// default rate, lines are off by less than 0.03, or more than 0.15.
const MISSED: f64 = 0.08;
/// Fewer lines may be off, as at a single knock.
const FEWEST: usize = 2;
/// Where a cubic is compared with a line, over the interval.
const COMPARED: [f64; 3] = [0.25, 0.5, 0.75];

/// Sentences about the topic `displacements` of a recording if lines between its samples miss vibrations of links, of those in which
/// `is_drawn`: one about links that a rate shows, and one about those that need shorter steps. `natural_hz` gives the frequency that
/// the vibration of a link has, of which this one was found: beside slow motion, it is found too low.
pub(super) fn rare_samples(
    displacements: &Table,
    is_drawn: impl Fn(&str) -> bool,
    natural_hz: impl Fn(&str, f64) -> Option<f64>,
) -> Vec<String> {
    let (Some(interval_s), Some(step)) = (regular_s(displacements), step(displacements)) else { return Vec::new() };
    let (regular, step_s) = (regular_intervals(displacements), step.longest_s);
    let mut missed = [const { Vec::new() }; 2];
    for link in links(displacements) {
        let all = Deflection::all_of(displacements, &link).into_iter().filter(|([_, place], _)| is_drawn(place));
        for ([name, _], deflection) in all {
            let Some(found_hz) = deflection.missed_hz(&regular, interval_s) else { continue };
            let natural_hz = natural_hz(&link, found_hz);
            if natural_hz.is_some_and(|hz| deflection.hardly_swings(&regular, hz)) {
                continue;
            }
            // Where every step was recorded, no rate could help.
            let is_step_too_long = step_s > EVERY_STEP * interval_s || natural_hz.is_some_and(|hz| step_s > coarse_s(hz));
            missed[usize::from(is_step_too_long)].push((natural_hz.unwrap_or(found_hz), name));
        }
    }
    let [by_rate, by_step] = missed;
    // However uncertain the frequency, twice the recorded rate or more.
    let sentence = |missed: Vec<(f64, String)>, coarse_s: f64| {
        let (frequencies_hz, links): (Vec<f64>, Vec<String>) = missed.into_iter().unzip();
        let smooth_s = smooth_s(frequencies_hz.into_iter().reduce(f64::max)?).min(0.5 * interval_s);
        let how = suggested_rate(smooth_s, coarse_s, step);
        let links = links.join(" and ");
        let so = "so that curves have wrong swings and peaks";
        Some(format!("samples are too rare for the vibration of {links}, {so}; record with --publish-hz {how} for right ones"))
    };
    [sentence(by_rate, f64::INFINITY), sentence(by_step, 0.0)].into_iter().flatten().collect()
}

/// The rows between gaps and resets.
fn runs(regular: &[Interval]) -> Vec<Range<usize>> {
    let rows: Vec<usize> = regular.iter().map(|interval| interval.row).collect();
    let run = |rows: &[usize]| Some(rows.first()? - 1..rows.last()? + 1);
    rows.chunk_by(|row, next| row + 1 == *next).filter_map(run).collect()
}

/// The parts of a run whose spectra are computed. Each begins in the middle of another, as the window is low at its ends.
fn stretches(run: &Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let length = STRETCH.min(run.len());
    let last = run.end - length;
    let starts = (run.start..last).step_by(STRETCH / 2).chain([last]);
    starts.map(move |start| start..start + length)
}

impl Deflection<'_> {
    /// The frequency of a vibration, Hz, if lines from sample to sample miss too much of it.
    fn missed_hz(&self, regular: &[Interval], interval_s: f64) -> Option<f64> {
        let is_missed = |interval: &Interval| self.off_m(interval).is_some_and(|off_m| off_m > MISSED * self.range_m);
        let missed: Vec<bool> = regular.iter().map(is_missed).collect();
        let count = missed.iter().filter(|missed| **missed).count();
        // Spectra are of a whole stretch, in which a vibration may die away; changes are of a moment. Both are too low at times.
        let momentary_hz = || momentary_hz([self.deflections_m, &self.rates_m_per_s], regular, &missed);
        (count >= FEWEST).then(|| self.spectral_hz(regular, interval_s).max(momentary_hz()))
    }

    /// Whether a vibration of this frequency, Hz, is too small for lines to be off by much, however few the samples: with the amplitude
    /// `A = |ẇ − Δw/h|/ω` they are off by at most `2 A`, where the cubic is off by some `0.15 ω h A`.
    fn hardly_swings(&self, regular: &[Interval], frequency_hz: f64) -> bool {
        let excess_m_per_s = |interval: &Interval| {
            let [before_m, after_m] = interval.ends(self.deflections_m)?;
            let slope = (after_m - before_m) / interval.duration_s;
            interval.ends(&self.rates_m_per_s)?.into_iter().map(|rate| (rate - slope).abs()).reduce(f64::max)
        };
        let most_m_per_s = regular.iter().filter_map(excess_m_per_s).fold(0.0, f64::max);
        2.0 * most_m_per_s / (TAU * frequency_hz) <= MISSED * self.range_m
    }

    /// The most by which the line between two samples is off the cubic through them, m: with `w` and `ẇ` at both ends of the
    /// interval `h`, that is `s (1 − s) ((1 − s) (h ẇ₀ − Δw) − s (h ẇ₁ − Δw))` at the part `s` of the interval.
    fn off_m(&self, interval: &Interval) -> Option<f64> {
        let [before_m, after_m] = interval.ends(self.deflections_m)?;
        let [first_m, last_m] = interval.ends(&self.rates_m_per_s)?.map(|rate| interval.duration_s * rate - (after_m - before_m));
        let off_m = |s: f64| (s * (1.0 - s) * ((1.0 - s) * first_m - s * last_m)).abs();
        Some(COMPARED.map(off_m).into_iter().fold(0.0, f64::max))
    }

    /// The frequency of the stretch of which lines miss most, Hz.
    fn spectral_hz(&self, regular: &[Interval], interval_s: f64) -> f64 {
        let missed = |rows: Range<usize>| self.missed(rows, interval_s);
        let runs = runs(regular);
        let stretches = runs.iter().flat_map(stretches).filter_map(missed);
        stretches.max_by(|one, other| one.0.total_cmp(&other.0)).map_or(0.0, |(_, hz)| hz)
    }

    /// The root mean square that lines miss of a stretch, m, and its frequency, Hz; `None` where a deflection is not known.
    fn missed(&self, rows: Range<usize>, interval_s: f64) -> Option<(f64, f64)> {
        let (deflections_m, rates_m_per_s) = (self.deflections_m.get(rows.clone())?, self.rates_m_per_s.get(rows)?);
        let is_known = deflections_m.iter().chain(rates_m_per_s).all(|value| value.is_finite());
        is_known.then(|| missed(deflections_m, rates_m_per_s, interval_s))
    }
}

/// The frequency of a vibration, Hz, by the changes of slope of a quantity and of its rate next to the missed intervals: slow
/// motion has hardly any. It may be far off where samples are nearly a whole number of periods apart.
pub(super) fn momentary_hz([values, rates]: [&[f64]; 2], regular: &[Interval], missed: &[bool]) -> f64 {
    let slopes = |interval: &Interval| {
        let slope = |[before, after]: [f64; 2]| (after - before) / interval.duration_s;
        Some([slope(interval.ends(values)?), slope(interval.ends(rates)?)])
    };
    let mut squares = [0.0_f64; 2];
    for (pair, missed) in regular.windows(2).zip(missed.windows(2)) {
        if let ([before, after], [true, _] | [_, true]) = (pair, missed)
            && before.row + 1 == after.row
            && let (Some(before), Some(after)) = (slopes(before), slopes(after))
        {
            let changes: [f64; 2] = std::array::from_fn(|k| after[k] - before[k]);
            if changes.iter().all(|change| change.is_finite()) {
                squares.iter_mut().zip(changes).for_each(|(square, change)| *square += change.powi(2));
            }
        }
    }
    let [of_values, of_rates] = squares;
    (of_rates / of_values).sqrt() / TAU
}

/// The root mean square that lines from sample to sample miss of a deflection, m, and its frequency, Hz.
fn missed(deflections_m: &[f64], rates_m_per_s: &[f64], interval_s: f64) -> (f64, f64) {
    let count = deflections_m.len();
    let [deflections, rates] = [deflections_m, rates_m_per_s].map(windowed);
    let [mut missed_m2, mut moved_m2] = [0.0_f64; 2];
    for k in 0..=count / 2 {
        let seen_rad = TAU * k as f64 / count as f64;
        let [deflection_m2, rate_m2_per_s2] = [&deflections, &rates].map(|values| power(values, seen_rad));
        if deflection_m2 > 0.0 {
            // No vibration is slower than it is seen.
            let turned_rad = seen_rad.max(interval_s * (rate_m2_per_s2 / deflection_m2).sqrt());
            let both_sides = if k == 0 || 2 * k == count { 1.0 } else { 2.0 };
            let part_m2 = both_sides * deflection_m2 * missed_by_lines(turned_rad);
            missed_m2 += part_m2;
            moved_m2 += part_m2 * turned_rad.powi(2);
        }
    }
    (missed_m2.sqrt(), (moved_m2 / missed_m2).sqrt() / (TAU * interval_s))
}

/// Mean square that lines between samples of `exp(iωt)` miss, with `ωh` from sample to sample: the mean over `0 < s < 1` of
/// `|(1 − s) + s exp(iωh) − exp(iωhs)|²`.
fn missed_by_lines(turned_rad: f64) -> f64 {
    // Smaller angles are lost in rounding.
    let half_rad = 0.5 * turned_rad.max(1e-3);
    5.0 / 3.0 + (2.0 * half_rad).cos() / 3.0 - 2.0 * (half_rad.sin() / half_rad).powi(2)
}

/// Values under half a period of a sine, which keeps what is slow out of the spectrum at other frequencies.
fn windowed(values: &[f64]) -> Vec<f64> {
    let count = values.len() as f64;
    values.iter().enumerate().map(|(i, value)| value * (PI * (i as f64 + 0.5) / count).sin()).collect()
}

/// Power of windowed values at one frequency, by Goertzel's algorithm. The sum over all frequencies is the mean square.
fn power(values: &[f64], turned_rad: f64) -> f64 {
    let twice = 2.0 * turned_rad.cos();
    let [last, before] = values.iter().fold([0.0_f64; 2], |[last, before], value| [value + twice * last - before, last]);
    let square = last * last + before * before - twice * last * before;
    (2.0 * square / (values.len() as f64).powi(2)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the samples alone.
    fn rare_samples(displacements: &Table) -> Option<String> {
        super::rare_samples(displacements, |_| true, |_, _| None).pop()
    }
    use crate::plot::SIMULATED_TIME;

    /// A rod of 1 m that turns at 2 rad/s and vibrates at 100 Hz with this amplitude, at these steps of these epochs.
    fn samples(amplitude_m: f64, step_s: f64, stamps: &[[u32; 2]]) -> Table {
        decaying(amplitude_m, 0.0, step_s, stamps)
    }

    /// The same, with a vibration that dies away at this rate.
    fn decaying(amplitude_m: f64, decay_per_s: f64, step_s: f64, stamps: &[[u32; 2]]) -> Table {
        beside([0.0, amplitude_m], decay_per_s, step_s, stamps)
    }

    /// The same, beside a slow deflection of the first amplitude.
    fn beside([slow_m, amplitude_m]: [f64; 2], decay_per_s: f64, step_s: f64, stamps: &[[u32; 2]]) -> Table {
        let times_s: Vec<f64> = stamps.iter().map(|[_, step]| step_s * f64::from(*step)).collect();
        let mut table = Table::default();
        table.push("stamp.epoch", stamps.iter().map(|[epoch, _]| f64::from(*epoch)).collect());
        table.push("stamp.step", stamps.iter().map(|[_, step]| f64::from(*step)).collect());
        table.push(SIMULATED_TIME, times_s.clone());
        let [omega, turning] = [TAU * 100.0, 2.0_f64];
        for node in 0..=2_u32 {
            let along_m = 0.5 * f64::from(node);
            let [slow_m, inner_m] = if node == 1 { [slow_m, amplitude_m] } else { [0.0; 2] };
            let motion = |t: f64| {
                let (sin, cos) = (turning * t).sin_cos();
                let [vibration, rate] = [(omega * t + 0.7).sin(), omega * (omega * t + 0.7).cos()];
                let fast = [vibration, rate - decay_per_s * vibration].map(|part| inner_m * (-decay_per_s * t).exp() * part);
                let [w, dw] = [fast[0] + slow_m * sin, fast[1] + slow_m * turning * cos];
                // Velocities along the link and across it.
                let [along, across] = [-turning * w, turning * along_m + dw];
                let position = [along_m * cos - w * sin, along_m * sin + w * cos];
                [position[0], position[1], along * cos - across * sin, along * sin + across * cos, w]
            };
            for (k, field) in ["x_m", "y_m", "vx_m_per_s", "vy_m_per_s", "deflection_m"].into_iter().enumerate() {
                table.push(format!("nodes.rod.{node}.{field}"), times_s.iter().map(|t| motion(*t)[k]).collect());
            }
        }
        table
    }

    fn every(steps: u32) -> Vec<[u32; 2]> {
        (0..200).map(|row| [0, steps * row]).collect()
    }

    /// The sentence with this rate.
    fn rate(how: &str) -> Option<String> {
        let so = "so that curves have wrong swings and peaks; record with --publish-hz";
        Some(format!("samples are too rare for the vibration of the rod, {so} {how} for right ones"))
    }

    #[test]
    fn regress_samples_too_rare_for_a_vibration_are_named_with_a_rate_that_suffices() {
        // Two samples in a period, four, ten, and fewer than two, whose vibration is seen to be slow or is not seen at all.
        for (steps, said) in [(50, "1300"), (24, "1200"), (60, "1200"), (99, "1300"), (100, "1300"), (400, "1300")] {
            assert_eq!(rare_samples(&samples(1e-3, 1e-4, &every(steps))), rate(said), "every {steps} steps");
        }
        assert_eq!(rare_samples(&samples(0.0, 1e-4, &every(50))), None);
        assert_eq!(rare_samples(&samples(1e-8, 1e-4, &every(50))), None, "a link that bends so little is straight");
        assert_eq!(rare_samples(&Table::default()), None);
    }

    /// The middle of a line over the top of a vibration with `n` samples in a period is off by `1 − cos(π/n)` of half the range.
    #[test]
    fn regress_a_curve_that_is_off_by_a_tenth_of_its_range_is_named() {
        for steps in 1..=30_u32 {
            let off = 0.5 * (1.0 - (PI * f64::from(steps) / 100.0).cos());
            let said = rare_samples(&samples(1e-3, 1e-4, &every(steps)));
            assert!(said.is_some() || off < 0.1, "every {steps} steps: off by {off}");
            assert!(said.is_none() || off > 0.05, "every {steps} steps: off by {off}, and {said:?}");
        }
    }

    /// A vibration of 3 % beside slow motion: with 84 ms between samples, of its rates a cubic is off by a tenth of the range.
    #[test]
    fn regress_a_vibration_that_is_too_small_to_matter_is_not_named() {
        for (amplitude_m, is_named) in [(3e-5, false), (3e-4, true)] {
            let table = beside([1e-3, amplitude_m], 0.0, 1e-4, &every(845));
            assert!(rare_samples(&table).is_some(), "by the samples alone");
            assert_eq!(super::rare_samples(&table, |_| true, |_, _| Some(100.0)).is_empty(), !is_named, "{amplitude_m}");
        }
    }

    #[test]
    fn regress_a_vibration_that_dies_away_after_some_samples_is_named() {
        for (steps, said) in [(50, rate("1200")), (25, rate("1200")), (10, None)] {
            assert_eq!(rare_samples(&decaying(1e-3, 60.0, 1e-4, &every(steps))), said, "every {steps} steps");
        }
    }

    /// Samples that are so many steps apart, without some that were lost.
    fn lost(steps: u32) -> Vec<[u32; 2]> {
        every(steps).into_iter().filter(|[_, step]| !(50..70).contains(&(step / steps % 100))).collect()
    }

    /// The first of them, before and after a reset.
    fn reset(steps: u32, count: usize) -> Vec<[u32; 2]> {
        let begun = every(steps).into_iter().take(count);
        begun.clone().chain(begun.map(|[_, step]| [1, step])).collect()
    }

    /// At 200 samples a second, 190 Hz is a perfect sine of 10 Hz. A mass that stays, and one that samples show, are not named.
    #[test]
    fn regress_a_mass_that_samples_are_too_rare_for_is_named() {
        let stamps = every(250);
        let mut table = Table::default();
        table.push("stamp.step", stamps.iter().map(|[_, step]| f64::from(*step)).collect());
        table.push("stamp.epoch", stamps.iter().map(|[epoch, _]| f64::from(*epoch)).collect());
        let times_s: Vec<f64> = stamps.iter().map(|[_, step]| 2e-5 * f64::from(*step)).collect();
        table.push("stamp.sim_time_s", times_s.clone());
        for (mass, (hz, amplitude_m)) in [(190.0, 1e-3), (4.0, 1e-3), (190.0, 1e-18)].into_iter().enumerate() {
            let omega = TAU * hz;
            table.push(format!("nodes.mass.{mass}.x_m"), times_s.iter().map(|t| 1.0 + amplitude_m * (omega * t).cos()).collect());
            let rates = times_s.iter().map(|t| -amplitude_m * omega * (omega * t).sin()).collect();
            table.push(format!("nodes.mass.{mass}.vx_m_per_s"), rates);
        }
        let said = super::rare_samples(&table, |_| true, |_, _| None);
        assert!(said.len() == 1 && said[0].contains("the vibration of mass 1, so that"), "{said:?}");
        assert_eq!(super::rare_samples(&table, |place| place == "mass.1", |_, _| None), [""; 0], "the other is drawn");
    }

    #[test]
    fn regress_gaps_and_resets_are_no_vibration() {
        for (smooth, rough) in [(lost(10), lost(50)), (reset(10, 97), reset(50, 97))] {
            assert_eq!(rare_samples(&samples(1e-3, 1e-4, &smooth)), None);
            assert_eq!(rare_samples(&samples(1e-3, 1e-4, &rough)), rate("1300"));
        }
        assert_eq!(rare_samples(&samples(1e-3, 1e-4, &reset(50, 9))), rate("1300"));
        assert_eq!(rare_samples(&samples(1e-3, 1e-4, &every(50)[..2])), None, "one line");
    }

    #[test]
    fn regress_samples_of_every_step_need_shorter_steps() {
        assert_eq!(rare_samples(&samples(1e-3, 3.3e-3, &every(1))), rate("all and solver.step_s = 0.0009"));
    }

    /// Every twentieth step of 0.5 ms: a rate shows 100 Hz, and no steps of 0.5 ms show 5500 Hz.
    #[test]
    fn regress_each_link_that_is_drawn_is_judged_by_itself() {
        let mut both = samples(1e-3, 5e-4, &every(20));
        let of_rod: Vec<(String, Vec<f64>)> = both.columns().map(|(name, values)| (name.to_owned(), values.to_vec())).collect();
        for (name, values) in of_rod.into_iter().filter(|(name, _)| name.starts_with("nodes.rod.")) {
            both.push(name.replace("rod", "crank"), values);
        }
        let natural_hz = |link: &str, _: f64| Some(if link == "crank" { 5500.0 } else { 100.0 });
        let said = |drawn: &[&str]| super::rare_samples(&both, |link| drawn.contains(&link), natural_hz);
        let of_rod = rate("1000").unwrap();
        let of_crank = rate("all and solver.step_s = 0.00001").unwrap().replace("rod", "crank");
        assert_eq!(said(&["rod"]), [of_rod.as_str()]);
        assert_eq!(said(&["crank"]), [of_crank.as_str()]);
        assert_eq!(said(&["crank", "rod"]), [of_rod, of_crank]);
        assert_eq!(said(&[]), [""; 0]);
    }

    #[test]
    fn val_lines_miss_the_mean_square_that_sums_give() {
        for turned_rad in [0.1_f64, TAU / 10.0, TAU / 4.0, PI, 4.0, 20.0] {
            let missed = |s: f64| {
                let sin = s * turned_rad.sin() - (s * turned_rad).sin();
                let cos = 1.0 - s + s * turned_rad.cos() - (s * turned_rad).cos();
                sin * sin + cos * cos
            };
            let sum = (0..1000).map(|i| missed((f64::from(i) + 0.5) / 1000.0)).sum::<f64>() / 1000.0;
            assert!((missed_by_lines(turned_rad) - sum).abs() < 1e-4 * sum, "{turned_rad}: {sum}");
        }
    }
}
