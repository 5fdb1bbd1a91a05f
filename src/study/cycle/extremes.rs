//! Smallest and largest values of the columns.

use super::units::words;
use crate::study::Table;

/// The least and the greatest of one column over one turn, on the turn's own grid of angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Extreme {
    /// The column.
    pub column: String,
    /// The quantity in words.
    pub quantity: String,
    /// Its unit, or what it is divided by.
    pub unit: &'static str,
    /// Smallest value.
    pub least: ExtremeValue,
    /// Largest value.
    pub greatest: ExtremeValue,
}

/// A smallest or largest value, and where it occurs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExtremeValue {
    /// The value, in the column's unit.
    pub value: f64,
    /// The first crank angle with this value, rad.
    pub crank_angle_rad: f64,
}

/// The extremes of one ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct Extremes {
    /// The crank-to-rod ratio.
    pub ratio: f64,
    /// One entry a column but ratio and crank angle.
    pub of: Vec<Extreme>,
    /// Mean of the driving torque over the turn, N·m: the trapezoid sum over its grid of angles. `None` of dimensionless tables.
    pub mean_torque_nm: Option<f64>,
    /// Work of the driving torque in the turn, J, in the direction in which the crank turns; `None` of dimensionless tables.
    pub work_j: Option<f64>,
}

/// The extremes of what [`cycle`](super::cycle) made, ratio by ratio.
pub fn extremes(table: &Table) -> Vec<Extremes> {
    let (Some(ratios), Some(angles)) = (table.column("ratio"), table.column("crank_angle_rad")) else { return Vec::new() };
    let mut from = 0;
    let mut all = Vec::new();
    // A turn begins at angle 0.
    for to in (1..=angles.len()).filter(|&row| row == angles.len() || angles[row] == 0.0) {
        let of = table.columns().skip(2).map(|(column, values)| extreme(column, &values[from..to], &angles[from..to])).collect();
        let mean_torque_nm = table.column("driving_torque_nm").map(|values| mean(&values[from..to], &angles[from..to]));
        let turn_rad = angles[to - 1] - angles[from];
        let work_j = mean_torque_nm.map(|mean_nm| mean_nm * turn_rad);
        all.push(Extremes { ratio: ratios[from], of, mean_torque_nm, work_j });
        from = to;
    }
    all
}

/// Mean over angles. Of a smooth quantity over a whole turn, the trapezoid sum errs by less than any power of the interval; where a
/// table of resistance has corners that the grid resolves, by its square.
fn mean(values: &[f64], angles: &[f64]) -> f64 {
    let parts =
        values.windows(2).zip(angles.windows(2)).map(|(value, angle)| (value[0] + value[1]) / 2.0 * (angle[1] - angle[0]));
    parts.sum::<f64>() / angles.last().zip(angles.first()).map_or(f64::NAN, |(last, first)| last - first)
}

fn extreme(column: &str, values: &[f64], angles: &[f64]) -> Extreme {
    let (quantity, unit) = words(column);
    let first_by = |better: fn(f64, f64) -> bool| {
        let pairs = values.iter().zip(angles).map(|(&value, &crank_angle_rad)| ExtremeValue { value, crank_angle_rad });
        pairs.reduce(|best, next| if better(next.value, best.value) { next } else { best }).unwrap_or_default()
    };
    Extreme {
        column: column.to_owned(),
        quantity,
        unit,
        least: first_by(|next, best| next < best),
        greatest: first_by(|next, best| next > best),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Options, cycle};
    use super::*;
    use crate::scene::SceneSource;

    /// Friction takes c ∮ẋ² dt in a turn: with ẋ = −ω l₁ (sin φ + λ/2 sin 2φ + …), the work is π c ω l₁² (1 + λ²/4 + …).
    #[test]
    fn val_the_mean_torque_feeds_the_friction_of_the_slider() {
        let overrides = ["slider.friction_n_s_per_m=30".to_owned()];
        let source = SceneSource::open("thesis-compressor", &overrides).expect("a scene");
        let options = Options { ratios: vec![0.05, 0.1], speed_rad_per_s: Some(200.0), ..Options::default() };
        let rod_m = source.scene.chain().expect("a chain").links[1].length_m;
        for of in extremes(&cycle(&source, &options).expect("a turn")) {
            let crank_m = of.ratio * rod_m;
            let expected_nm = 0.5 * 30.0 * 200.0 * crank_m.powi(2) * (1.0 + of.ratio.powi(2) / 4.0);
            let mean_nm = of.mean_torque_nm.expect("a torque");
            assert!((mean_nm / expected_nm - 1.0).abs() < of.ratio.powi(4), "{}: {mean_nm} for {expected_nm}", of.ratio);
        }
        // Friction takes as much of a crank that turns backwards.
        let works = [200.0, -200.0].map(|speed| {
            let options = Options { speed_rad_per_s: Some(speed), ..Options::default() };
            let works: Vec<f64> =
                extremes(&cycle(&source, &options).expect("a turn")).iter().filter_map(|of| of.work_j).collect();
            works[0]
        });
        assert!(works[0] > 0.1 && (works[0] - works[1]).abs() < 1e-9 * works[0], "{works:?} J");
    }
}
