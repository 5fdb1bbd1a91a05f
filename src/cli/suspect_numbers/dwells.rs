//! Warnings of dwells of a prescribed motion in which the crank does not stand still.

use crate::scene::{Drive, Motion, Scene};
use crate::shown::figure;
use crate::simulation::Loads;

/// Looks at the spline between two rows.
const LOOKS: u32 = 16;
/// A dwell leaves its angle by less than this part of the table's range.
const SMALL_PART: f64 = 1e-3;

/// A warning of two rows of one angle between which the spline leaves it: the two between which it leaves it the furthest.
pub(super) fn moving_dwell(scene: &Scene) -> Option<String> {
    let Drive::Motion(Motion::Table(rows)) = &scene.drive else { return None };
    let end = |end: fn(f64, f64) -> f64| rows.iter().map(|[_, angle_rad]| *angle_rad).reduce(end);
    let range_rad = end(f64::max)? - end(f64::min)?;
    let loads = Loads::new(scene);
    let left_rad = |pair: &[[f64; 2]]| {
        let [[from_s, angle_rad], [to_s, _]] = [pair[0], pair[1]];
        let looks = (1..LOOKS).map(|look| from_s + (to_s - from_s) * f64::from(look) / f64::from(LOOKS));
        let angles_rad = looks.filter_map(|time_s| Some(loads.input(time_s).motion?[0]));
        (angles_rad.map(|other_rad| (other_rad - angle_rad).abs()).fold(0.0, f64::max), from_s, to_s)
    };
    let dwells = rows.windows(2).filter(|pair| pair[0][1] == pair[1][1]).map(left_rad);
    let (left_rad, from_s, to_s) = dwells.max_by(|(one, ..), (other, ..)| one.total_cmp(other))?;
    (left_rad > SMALL_PART * range_rad).then(|| {
        let [left, from, to] = [left_rad, from_s, to_s].map(figure);
        format!(
            "drive.table has one angle at {from} s and {to} s, and its spline leaves it by up to {left} rad between them: rows close to \
             each other at both ends of a dwell keep the crank still"
        )
    })
}

#[cfg(test)]
mod tests {
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
        let warning = "drive.table has one angle at 0.25 s and 0.4 s, and its spline leaves it by up to 0.657";
        let found = said(swings)?.unwrap_or_default();
        assert!(found.starts_with(warning), "{found}");
        let close = "[[0, 0], [0.1, 0], [0.101, 0], [0.25, 3.1], [0.399, 6.2], [0.4, 6.2], [0.7, 6.2]]";
        assert_eq!(said(close)?, None, "by up to 0.003 of 6.2 rad");
        assert_eq!(said("[[0, 0], [0.1, 1], [0.2, 3]]")?, None);
        assert_eq!(said("[[0, 0], [0.1, 0]]")?, None);
        Ok(())
    }
}
