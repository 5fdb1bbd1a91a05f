//! Formatting of counts and quantities.

/// A count with its noun, singular or plural.
pub(super) fn counted(count: u64, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// Below this, a quantity is rounding.
const ROUNDING: f64 = 1e-12;

/// A quantity with so many decimals, unless these would show fewer than three of its digits.
pub(super) fn decimal(value: f64, decimals: usize) -> String {
    let least = 10_f64.powi(2 - decimals as i32);
    if value.abs() < ROUNDING || value.abs() >= least { format!("{value:.decimals$}") } else { format!("{value:.2e}") }
}

/// An angle in degrees; one that is rounding, as of a balance found at 0, is 0.
pub(super) fn degrees(angle_rad: f64) -> f64 {
    if angle_rad.abs() < ROUNDING { 0.0 } else { angle_rad.to_degrees() }
}

#[cfg(test)]
mod tests {
    use super::{decimal, degrees};

    /// `check` said of a balance that its crank is at -1.55301e-18°.
    #[test]
    fn regress_an_angle_that_is_rounding_is_zero() {
        assert_eq!([-2.7e-20, 1e-3].map(degrees).map(|angle| angle.to_string()), ["0", "0.057295779513082325"]);
    }

    /// Torques and loads of a mechanism of millimetres and grams were printed as 0.
    #[test]
    fn regress_small_quantities_keep_their_digits() {
        for (value, shown) in [
            (0.0, "0.000000"),
            (1e-17, "0.000000"),
            (-1.5, "-1.500000"),
            (1e-4, "0.000100"),
            (9.9e-5, "9.90e-5"),
            (-2.84e-6, "-2.84e-6"),
        ] {
            assert_eq!(decimal(value, 6), shown);
        }
        assert_eq!([decimal(0.02, 4), decimal(2.6e-3, 4)], ["0.0200", "2.60e-3"]);
    }
}
