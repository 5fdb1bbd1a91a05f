//! Whether a motion is at rest, as far as its numbers tell.

/// A change of a value by less than this part of the value is rounding.
const PART: f64 = 1e-9;
/// So is a change by less than this, in the unit of the value: rad, m, or a part of a link's length.
const LEAST: f64 = 1e-15;

/// Whether each value is what it was before, but for rounding.
pub fn is_at_rest(before: &[f64], now: &[f64]) -> bool {
    before.iter().zip(now).all(|(before, now)| (now - before).abs() <= PART * before.abs() + LEAST)
}
