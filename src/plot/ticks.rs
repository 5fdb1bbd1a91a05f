//! Ticks of an axis: positions and labels.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Ticks of an axis, and what its label has to add so that the numbers stay short.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Ticks {
    /// Values and texts.
    pub major: Vec<(f64, String)>,
    /// Power of ten that the numbers are to be multiplied by.
    pub exponent: i32,
    /// Offset subtracted from the values; usually 0.
    pub offset: f64,
}

/// Values that vary by less than this part of their size are shown less an offset.
const OFFSET_BELOW: f64 = 1e-3;
/// Fewest ticks of an axis: one alone shows no scale.
const FEWEST: usize = 2;

/// At most about `most` ticks from `low` to `high` at 1, 2 or 5 times a power of ten.
pub(super) fn linear(low: f64, high: f64, most: usize) -> Ticks {
    let size = low.abs().max(high.abs());
    let offset = if high - low < OFFSET_BELOW * size { round_to((low + high) / 2.0, high - low) } else { 0.0 };
    let (low, high) = (low - offset, high - offset);
    let step = linear_step(low, high, most);
    let exponent = common_exponent(low.abs().max(high.abs()));
    let unit = 10_f64.powi(exponent);
    let decimals = (-((step / unit).log10() + 1e-9).floor()).clamp(0.0, 15.0) as usize;
    let values = multiples(low, high, step).map(|k| k as f64 * step);
    let major = values.map(|value| (value + offset, number(value / unit, decimals))).collect();
    Ticks { major, exponent, offset }
}

/// The step that leaves at most `most` steps from `low` to `high`, or up to five where that would leave a single tick, as around
/// zero.
fn linear_step(low: f64, high: f64, most: usize) -> f64 {
    let step = nice_step((high - low) / most.max(1) as f64);
    if multiples(low, high, step).count() < FEWEST { nice_step((high - low) / 5.0) } else { step }
}

/// The whole multiples of `step` from `low` to `high`.
fn multiples(low: f64, high: f64, step: f64) -> RangeInclusive<i64> {
    (low / step - 1e-9).ceil() as i64..=(high / step + 1e-9).floor() as i64
}

/// The smallest of 1, 2, 5 times a power of ten that is not under `least`.
fn nice_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].iter().map(|factor| factor * power).find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// `value` with no more digits than a span of `span` asks for.
fn round_to(value: f64, span: f64) -> f64 {
    let digits = (-span.log10().ceil()) as i32;
    // Dividing by an exact power of ten rounds rightly where multiplying by its inverse does not.
    if digits >= 0 { (value * 10_f64.powi(digits)).round() / 10_f64.powi(digits) } else { value.round() }
}

/// The power of ten, a multiple of three, that brings `size` between 1 and 1000; 0 while plain decimals are short.
fn common_exponent(size: f64) -> i32 {
    if size == 0.0 || (0.02..1e5).contains(&size) { 0 } else { 3 * ((size * (1.0 + 1e-9)).log10() / 3.0).floor() as i32 }
}

fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.')) {
        return "0".to_owned();
    }
    text.replace('-', "−")
}

/// Steps of angles, °.
const ANGLES: [f64; 7] = [45.0, 90.0, 180.0, 360.0, 720.0, 1800.0, 3600.0];
/// Where more ticks than one in so many degrees have room, ticks at 1, 2 or 5 times a power of ten are finer, °.
const FINE: f64 = 15.0;

/// Multiples of 45°, 90°, 180° or whole turns, where they are neither too close nor too far apart.
pub(super) fn degrees(low: f64, high: f64, most: usize) -> Ticks {
    let least = (high - low) / most.max(1) as f64;
    let step = ANGLES.into_iter().find(|step| *step >= least * (1.0 - 1e-9));
    let Some(step) = step.filter(|step| least > FINE && high - low >= 2.0 * step && low.abs() < 1e6) else {
        return linear(low, high, most);
    };
    let major = multiples(low, high, step).map(|k| k as f64 * step).map(|value| (value, number(value, 0))).collect();
    Ticks { major, ..Ticks::default() }
}

/// Multiples of π, or of a simple part of it, where they are neither too close nor too far apart.
pub(super) fn pi(low: f64, high: f64, most: usize) -> Ticks {
    let least = (high - low) / most.max(1) as f64 / PI;
    let parts = [(1_i64, 8_i64), (1, 4), (1, 2), (1, 1), (2, 1), (4, 1), (10, 1)];
    let part = parts.into_iter().find(|(num, den)| *num as f64 / *den as f64 >= least * (1.0 - 1e-9));
    let Some((num, den)) = part.filter(|_| least > 0.02 && low.abs() < 1e6) else { return linear(low, high, most) };
    let step = PI * num as f64 / den as f64;
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    let major: Vec<_> = (first..=last).map(|k| (k as f64 * step, fraction_of_pi(k * num, den))).collect();
    if major.len() < FEWEST { linear(low, high, most) } else { Ticks { major, ..Ticks::default() } }
}

/// `num / den · π` for a power of two `den`.
fn fraction_of_pi(mut num: i64, mut den: i64) -> String {
    while den > 1 && num % 2 == 0 {
        (num, den) = (num / 2, den / 2);
    }
    let factor = match num {
        0 => return "0".to_owned(),
        1 => String::new(),
        -1 => "−".to_owned(),
        num => number(num as f64, 0),
    };
    if den == 1 { format!("{factor}π") } else { format!("{factor}π/{den}") }
}

/// Powers of ten, and 2 and 5 times them where there are few; ticks as on a linear axis where fewer than two of these lie on it.
pub(super) fn log(low: f64, high: f64, most: usize) -> Ticks {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let every = ((last - first).max(1) as usize).div_ceil(most.max(1)) as i32;
    let factors: &[i32] = if last - first <= 2 { &[1, 2, 5] } else { &[1] };
    let powers = (first..=last).filter(|exponent| exponent.rem_euclid(every) == 0);
    let all = powers.flat_map(|exponent| factors.iter().map(move |factor| (*factor, exponent)));
    let tick = |(factor, exponent): (i32, i32)| {
        let factor_text = if factor == 1 { String::new() } else { format!("{factor}·") };
        (f64::from(factor) * 10_f64.powi(exponent), format!("{factor_text}10{}", superscript(exponent)))
    };
    let inside = |(value, _): &(f64, String)| *value >= low * (1.0 - 1e-9) && *value <= high * (1.0 + 1e-9);
    let major: Vec<_> = all.map(tick).filter(inside).collect();
    if major.len() < FEWEST { linear(low, high, most) } else { Ticks { major, ..Ticks::default() } }
}

/// A whole number as superscript.
pub(super) fn superscript(number: i32) -> String {
    let high = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => digit.to_digit(10).and_then(|digit| char::from_u32(0x2070 + digit)).unwrap_or(digit),
    };
    number.to_string().chars().map(high).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::{FEWEST, Ticks, degrees, linear, log, pi};

    /// Whether the ticks lie on the axis, are enough, and can be told apart.
    fn shows_a_scale(ticks: &Ticks, low: f64, high: f64, fewest: usize) -> bool {
        let rounding = 1e-6 * (high - low);
        let labels: BTreeSet<&str> = ticks.major.iter().map(|(_, label)| label.as_str()).collect();
        let is_inside = |value: f64| (low - rounding..=high + rounding).contains(&value);
        labels.len() == ticks.major.len() && labels.len() >= fewest && ticks.major.iter().all(|(value, _)| is_inside(*value))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(4000) })]

        #[test]
        fn prop_every_axis_has_two_ticks_and_three_around_zero(
            size in -12.0..12.0_f64,
            middle in -3.0..3.0_f64,
            decades in 0.17..20.0_f64,
            most in 4..40_usize,
        ) {
            let length = 10_f64.powf(size);
            for (middle, fewest) in [(middle, FEWEST), (0.0, 3)] {
                let [low, high] = [middle - 0.5, middle + 0.5].map(|end| end * length);
                for ticks in [linear(low, high, most), degrees(low, high, most), pi(low, high, most)] {
                    prop_assert!(shows_a_scale(&ticks, low, high, fewest), "{low} to {high}, at most {most}: {ticks:?}");
                }
            }
            for decades in [decades, decades / 20.0 + 0.17] {
                let (low, high) = (length, length * 10_f64.powf(decades));
                let ticks = log(low, high, most);
                prop_assert!(shows_a_scale(&ticks, low, high, FEWEST), "{low} to {high}, at most {most}: {ticks:?}");
            }
        }
    }

    #[test]
    fn regress_a_low_panel_around_zero_has_more_ticks_than_zero() {
        let labels = |ticks: Ticks| ticks.major.into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(labels(linear(-0.43, 0.43, 4)), ["−0.4", "−0.2", "0", "0.2", "0.4"]);
        assert_eq!(labels(pi(-0.3, 0.3, 4)), ["−0.2", "0", "0.2"]);
        assert_eq!(labels(log(5.5, 9.5, 4)), ["6", "7", "8", "9"]);
    }

    #[test]
    fn val_angles_have_ticks_at_simple_parts_of_a_turn() {
        let texts = |low, high, most| degrees(low, high, most).major.into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(texts(-810.0, 10.0, 4), ["−720", "−360", "0"]);
        assert_eq!(texts(-187.0, 7.0, 4), ["−180", "−90", "0"]);
        assert_eq!(texts(0.0, 360.0, 10), ["0", "45", "90", "135", "180", "225", "270", "315", "360"]);
        assert_eq!(texts(0.0, 5.0, 5), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(texts(100.0, 160.0, 4), ["100", "120", "140", "160"]);
    }
}
