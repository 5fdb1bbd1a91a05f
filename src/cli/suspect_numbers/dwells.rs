//! Warnings of dwells of a prescribed motion in which the crank does not stand still.

use crate::scene::{Drive, Motion, Scene};
use crate::shown::figure;
use crate::simulation::Loads;

/// Looks at the spline between two rows.
const LOOKS: u32 = 16;
/// Steps by Newton's method to the furthest point, whose rate is a parabola.
const CLOSER: usize = 5;
/// A crank that stands still in a dwell leaves its angle by less than this part of the table's range.
const SMALL_PART: f64 = 1e-3;
/// Two rows at the top of a curve may have one angle by chance. Its spline leaves that by less than this part, with ten rows a turn.
const CURVED_PART: f64 = 0.05;

/// A warning of two rows of one angle between which the spline leaves it: the two between which it leaves it the furthest.
pub(super) fn moving_dwell(scene: &Scene) -> Option<String> {
    let Drive::Motion(Motion::Table(rows)) = &scene.drive else { return None };
    let end = |end: fn(f64, f64) -> f64| rows.iter().map(|[_, angle_rad]| *angle_rad).reduce(end);
    let range_rad = end(f64::max)? - end(f64::min)?;
    let loads = Loads::new(scene);
    let left_rad = |row: usize| {
        let [[from_s, angle_rad], [to_s, _]] = [rows[row], rows[row + 1]];
        let looks = (1..LOOKS).map(|look| from_s + (to_s - from_s) * f64::from(look) / f64::from(LOOKS));
        let left = |time_s: f64| Some((loads.input(time_s).motion?[0] - angle_rad).abs());
        let furthest = looks.filter_map(|time_s| Some((left(time_s)?, time_s))).max_by(|one, other| one.0.total_cmp(&other.0))?;
        // From the furthest of these looks to where the crank turns back, between its neighbours.
        let near_s = (to_s - from_s) / f64::from(LOOKS);
        let turns_back_s = (0..CLOSER).try_fold(furthest.1, |time_s, _| {
            let [_, rate, acceleration] = loads.input(time_s).motion?;
            let by_newton_s = if acceleration == 0.0 { time_s } else { time_s - rate / acceleration };
            Some(by_newton_s.clamp(furthest.1 - near_s, furthest.1 + near_s))
        });
        let left_rad = turns_back_s.and_then(left).unwrap_or(0.0).max(furthest.0);
        let part = if is_top(rows, row) { CURVED_PART } else { SMALL_PART };
        (left_rad > part * range_rad).then_some((left_rad, from_s, to_s))
    };
    let dwells = (0..rows.len().saturating_sub(1)).filter(|&row| rows[row][1] == rows[row + 1][1]).filter_map(left_rad);
    let (left_rad, from_s, to_s) = dwells.max_by(|(one, ..), (other, ..)| one.total_cmp(other))?;
    let [left, from, to] = [left_rad, from_s, to_s].map(figure);
    Some(format!(
        "drive.table has the same angle at {from} s and {to} s, and its spline leaves it by up to {left} rad between them: if the crank \
         is to stand still there, give the move more rows, or several close rows inside each end of the dwell"
    ))
}

/// Whether this row and the next are the top or the bottom of a curve, of rows that are no closer together than those around them.
fn is_top(rows: &[[f64; 2]], row: usize) -> bool {
    let Some([before, from, to, behind]) =
        row.checked_sub(1).and_then(|first| rows.get(first..first + 4)).and_then(|rows| rows.first_chunk())
    else {
        return false;
    };
    let (lasts_s, around_s) = (to[0] - from[0], (from[0] - before[0]).max(behind[0] - to[0]));
    (before[1] - from[1]) * (behind[1] - to[1]) > 0.0 && lasts_s <= 1.01 * around_s
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::moving_dwell;
    use crate::scene::{SceneError, SceneSource};

    /// By the clamped spline of another program, it reaches 3.79959 rad in its second dwell.
    #[test]
    fn val_a_dwell_that_the_spline_leaves_is_named() -> Result<(), SceneError> {
        let said = |table: &str| {
            let set = format!("drive={{ table = {table} }}");
            Ok::<_, SceneError>(moving_dwell(&SceneSource::open("crank-slider", &["pulse=[]".to_owned(), set])?.scene))
        };
        let swings = "[[0, 0], [0.1, 0], [0.25, 3.1416], [0.4, 3.1416], [0.55, 0], [0.7, 0]]";
        let warning = "drive.table has the same angle at 0.25 s and 0.4 s, and its spline leaves it by up to 0.657";
        let found = said(swings)?.unwrap_or_default();
        assert!(found.starts_with(warning), "{found}");
        // Extremes of the spline with the ends of this one, by SciPy at 20001 points.
        for (table, left_rad) in [
            ("[[0, 0], [0.2, 6.283185], [0.6, 6.283185], [0.8, 12.56637], [1.2, 12.56637]]", "1.45066"),
            ("[[0, 0], [0.1, 0], [0.3, 1.2], [0.5, 1.2]]", "0.115942"),
            ("[[0, 0], [1, 1], [1.5, 1], [1.7, 6], [1.9, 6]]", "2.07566"),
        ] {
            let found = said(table)?.unwrap_or_default();
            assert!(found.contains(&format!("leaves it by up to {left_rad} rad")), "{table}: {found}");
        }
        let close = "[[0, 0], [0.1, 0], [0.101, 0], [0.25, 3.1], [0.399, 6.2], [0.4, 6.2], [0.7, 6.2]]";
        assert_eq!(said(close)?, None, "by up to 0.003 of 6.2 rad");
        let sine: Vec<String> =
            (0..=20).map(|n| format!("[{}, {:.4}]", 0.1 * f64::from(n), 0.5 * (0.2 * PI * f64::from(n)).sin())).collect();
        assert_eq!(said(&format!("[{}]", sine.join(", ")))?, None, "the sine of 72° is that of 108°");
        assert_eq!(said("[[0, 0], [0.1, 1], [0.2, 3]]")?, None);
        assert_eq!(said("[[0, 0], [0.1, 0]]")?, None);
        Ok(())
    }
}
