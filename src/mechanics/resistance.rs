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

/// A corner of a table: a row at which the slope of the force jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ResistanceCorner {
    /// The row's angle in the turn in which the crank passes it, rad.
    pub(crate) crank_rad: f64,
    /// Slope above the angle less slope below it, N/rad.
    pub(crate) slope_jump_n_per_rad: f64,
}

/// Corners that the crank passes between two angles, which may be in either order. One at the larger angle counts, one at the smaller does
/// not, so that steps that follow one another pass each once. Of a way longer than a turn, those of the first turn from below.
pub(crate) fn corners_between(resistance: &Resistance, one_rad: f64, other_rad: f64) -> impl Iterator<Item = ResistanceCorner> {
    let rows: &[[f64; 2]] = match resistance {
        Resistance::Constant(_) => &[],
        Resistance::Table(rows) => rows,
    };
    let (low, high) = (one_rad.min(other_rad), one_rad.max(other_rad));
    let turn = (low / TAU).floor();
    let first = rows.partition_point(|row| turn * TAU + row[0] <= low);
    (first..first + rows.len())
        .map(move |row| match row.checked_sub(rows.len()) {
            None => corner(rows, row, turn),
            Some(row) => corner(rows, row, turn + 1.0),
        })
        .take_while(move |corner| corner.crank_rad <= high)
        .filter(move |corner| corner.crank_rad > low)
}

/// The corner at a row, in a turn of the crank.
fn corner(rows: &[[f64; 2]], row: usize, turn: f64) -> ResistanceCorner {
    let before = row.checked_sub(1).unwrap_or(rows.len() - 1);
    ResistanceCorner {
        crank_rad: turn * TAU + rows[row][0],
        slope_jump_n_per_rad: slope_after(rows, row) - slope_after(rows, before),
    }
}

/// Slope from a row to the next one, behind the last one to the first one of the next turn, N/rad.
fn slope_after(rows: &[[f64; 2]], row: usize) -> f64 {
    let from = rows[row];
    let to = if row + 1 == rows.len() { [rows[0][0] + TAU, rows[0][1]] } else { rows[row + 1] };
    (to[1] - from[1]) / (to[0] - from[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: [[f64; 2]; 4] = [[0.0, 16.0], [0.785, 11.0], [2.0, -3.0], [5.498, 20.0]];

    fn passed_rad(table: &Resistance, one_rad: f64, other_rad: f64) -> Vec<f64> {
        corners_between(table, one_rad, other_rad).map(|corner| corner.crank_rad).collect()
    }

    /// Angles of all rows over eight turns.
    fn all_rad() -> Vec<f64> {
        (-4..4).flat_map(|turn| ROWS.map(|row| f64::from(turn) * TAU + row[0])).collect()
    }

    #[test]
    fn prop_steps_pass_each_corner_once_in_either_direction() {
        let (table, all) = (Resistance::Table(ROWS.to_vec()), all_rad());
        for steps in [20, 137, 1000] {
            let angle = |n: i32| -4.0 * TAU - 0.1 + 8.0 * TAU * f64::from(n) / f64::from(steps);
            let up: Vec<f64> = (0..steps).flat_map(|n| passed_rad(&table, angle(n), angle(n + 1))).collect();
            let down: Vec<f64> = (0..steps).flat_map(|n| passed_rad(&table, angle(n + 1), angle(n))).collect();
            assert_eq!(up, all, "{steps} steps");
            assert_eq!(down, all, "{steps} steps back");
        }
    }

    #[test]
    fn prop_a_corner_belongs_to_the_step_below_it() {
        let table = Resistance::Table(ROWS.to_vec());
        for pair in all_rad().windows(2) {
            assert_eq!(passed_rad(&table, pair[0], pair[1]), [pair[1]]);
            assert_eq!(passed_rad(&table, pair[1], pair[0]), [pair[1]]);
            assert!(passed_rad(&table, pair[1], pair[1]).is_empty());
        }
    }

    #[test]
    fn val_the_slope_jumps_at_a_corner_as_the_force_has_it() {
        let table = Resistance::Table(ROWS.to_vec());
        for corner in corners_between(&table, -7.0, 6.0) {
            let [above, below] = [1e-6, -1e-6].map(|off| resistance(&table, corner.crank_rad + off)[1]);
            assert!((corner.slope_jump_n_per_rad - (above - below)).abs() < 1e-9, "{corner:?}");
        }
        let turn: f64 = corners_between(&table, 1.0, 1.0 + TAU).map(|corner| corner.slope_jump_n_per_rad).sum();
        assert!(turn.abs() < 1e-9, "{turn}");
    }

    #[test]
    fn prop_a_long_way_passes_the_table_once() {
        let table = Resistance::Table(ROWS.to_vec());
        assert_eq!(passed_rad(&table, 1e3, -1e3).len(), ROWS.len());
        for [one, other] in [[f64::NAN, 1.0], [f64::NAN, f64::NAN], [f64::NEG_INFINITY, f64::INFINITY]] {
            assert!(passed_rad(&table, one, other).is_empty(), "{one} {other}");
        }
        assert!(passed_rad(&Resistance::Constant(3.0), 0.0, 7.0).is_empty());
        assert!(passed_rad(&Resistance::Table(Vec::new()), 0.0, 7.0).is_empty());
    }

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
