//! Peaks and troughs of a resistance table, and their widths.

use std::f64::consts::TAU;

use crate::scene::Resistance;

/// With fewer steps in a load, the peak of a triangle may come out an eighth too small.
pub(crate) const FEW_STEPS: f64 = 4.0;
/// Smaller peaks, as parts of the span of all forces, are ripple.
const RIPPLE: f64 = 0.05;

/// Where the crank passes each peak and each trough of a table, from the angle to the other, rad: as wide as it is at half its height over
/// the higher of the troughs beside it (a trough likewise). An end may lie in a turn beside the first.
pub(crate) fn loads_rad(resistance: &Resistance) -> Vec<[f64; 2]> {
    let Resistance::Table(rows) = resistance else { return Vec::new() };
    let upside_down: Vec<[f64; 2]> = rows.iter().map(|row| [row[0], -row[1]]).collect();
    [peaks_rad(rows), peaks_rad(&upside_down)].concat()
}

/// Whether a way from one angle to another, rad, passes a load, in any turn.
pub(crate) fn passes(way_rad: [f64; 2], [from_rad, to_rad]: [f64; 2]) -> bool {
    let (low, high) = (way_rad[0].min(way_rad[1]), way_rad[0].max(way_rad[1]));
    ((low - to_rad) / TAU).ceil() <= ((high - from_rad) / TAU).floor()
}

fn peaks_rad(rows: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let count = rows.len() as isize;
    // The row so many places after the first, in the turn where it lies.
    let row = |place: isize| {
        let [angle_rad, force_n] = rows[place.rem_euclid(count) as usize];
        [angle_rad + TAU * place.div_euclid(count) as f64, force_n]
    };
    let forces = || rows.iter().map(|row| row[1]);
    let span_n = forces().fold(f64::NEG_INFINITY, f64::max) - forces().fold(f64::INFINITY, f64::min);
    let peak = |place: isize| {
        let top_n = row(place)[1];
        // The least force on a way down, which ends where it rises above the top, or after a turn.
        let foot_n = |way: isize| {
            let down = (1..count).map(|steps| row(place + way * steps)[1]).take_while(|force_n| *force_n <= top_n);
            down.fold(top_n, f64::min)
        };
        let height_n = top_n - foot_n(1).max(foot_n(-1));
        if row(place - 1)[1] == top_n || height_n <= RIPPLE * span_n {
            return None;
        }
        let level_n = top_n - 0.5 * height_n;
        let crossed = |way: isize| {
            let below = (1..=count).map(|steps| place + way * steps).find(|place| row(*place)[1] < level_n)?;
            let [[from_rad, from_n], [to_rad, to_n]] = [row(below - way), row(below)];
            Some(from_rad + (level_n - from_n) / (to_n - from_n) * (to_rad - from_rad))
        };
        Some([crossed(-1)?, crossed(1)?])
    };
    (0..count).filter_map(peak).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn narrowest_rad(rows: &[[f64; 2]]) -> f64 {
        let loads = loads_rad(&Resistance::Table(rows.to_vec()));
        loads.iter().map(|[from, to]| to - from).fold(f64::INFINITY, f64::min)
    }

    /// A triangle is half as wide at half its height; a trapezoid, and a trough, likewise, also across the turn's end.
    #[test]
    fn val_a_load_is_as_wide_as_at_half_its_height() {
        for (rows, width_rad) in [
            (&[[0.0, 0.0], [6.20, 0.0], [6.215, 80_000.0], [6.23, 0.0]][..], 0.015),
            (&[[1.0, 10.0], [1.2, -10.0], [1.5, -10.0], [1.9, 10.0]], 0.6),
            (&[[0.0, 5.0], [0.2, 0.0], [6.0, 0.0], [6.1, 5.0]], 0.1 + (TAU - 6.1) + 0.05),
            // A short load beside one that is stronger and longer.
            (&[[0.0, 0.0], [3.0, 0.0], [3.1, 8e4], [3.5, 8e4], [3.6, 0.0], [6.0, 0.0], [6.004, 39e3], [6.008, 0.0]], 0.004),
        ] {
            let found = narrowest_rad(rows);
            assert!((found - width_rad).abs() < 1e-3 * width_rad, "{rows:?}: {found} for {width_rad}");
        }
    }

    /// A ripple of a fortieth of the span.
    #[test]
    fn val_a_ripple_is_no_load() {
        let found = narrowest_rad(&[[0.0, 39.0], [0.5, 41.0], [0.51, 39.0], [1.0, 41.0], [2.0, 80.0], [4.0, 0.0]]);
        assert!(found > 1.0, "{found}");
    }

    #[test]
    fn prop_a_constant_force_has_no_loads() {
        for constant in
            [Resistance::Constant(3.0), Resistance::Table(vec![[0.0, 3.0], [1.0, 3.0]]), Resistance::Table(Vec::new())]
        {
            assert!(loads_rad(&constant).is_empty(), "{constant:?}");
        }
    }
}
