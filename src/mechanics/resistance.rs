//! The resistance force on the slider.

use std::f64::consts::TAU;

use crate::scene::Resistance;

/// Force along −x at a crank chord angle and its slope, N and N/rad. Tables are linear between their rows and periodic over a
/// turn.
pub(crate) fn resistance(resistance: &Resistance, crank_rad: f64) -> [f64; 2] {
    let rows = match resistance {
        Resistance::Constant(force_n) => return [*force_n, 0.0],
        Resistance::Table(rows) => rows,
    };
    let angle = crank_rad.rem_euclid(TAU);
    let after = rows.partition_point(|row| row[0] <= angle);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return [0.0; 2] };
    let from = if after == 0 { [last[0] - TAU, last[1]] } else { rows[after - 1] };
    let to = if after == rows.len() { [first[0] + TAU, first[1]] } else { rows[after] };
    let slope = (to[1] - from[1]) / (to[0] - from[0]);
    [from[1] + slope * (angle - from[0]), slope]
}

/// The force alone, N.
pub(crate) fn resistance_n(resistance: &Resistance, crank_rad: f64) -> f64 {
    self::resistance(resistance, crank_rad)[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_table_is_linear_and_periodic() {
        let table = Resistance::Table(vec![[1.0, 10.0], [3.0, 30.0]]);
        for (angle, force) in [(1.0, 10.0), (2.0, 20.0), (3.0, 30.0), (2.0 + TAU, 20.0), (2.0 - 3.0 * TAU, 20.0)] {
            assert!((resistance_n(&table, angle) - force).abs() < 1e-12, "at {angle}");
        }
        let seam = resistance_n(&table, 0.0);
        assert!((seam - (30.0 - 20.0 * (TAU - 3.0) / (TAU - 2.0))).abs() < 1e-12, "between the last row and the first");
    }
}
