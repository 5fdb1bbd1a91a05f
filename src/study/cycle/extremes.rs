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
}

/// The extremes of what [`cycle`](super::cycle) made, ratio by ratio.
pub fn extremes(table: &Table) -> Vec<Extremes> {
    let (Some(ratios), Some(angles)) = (table.column("ratio"), table.column("crank_angle_rad")) else { return Vec::new() };
    let mut from = 0;
    let mut all = Vec::new();
    // A turn begins at angle 0.
    for to in (1..=angles.len()).filter(|&row| row == angles.len() || angles[row] == 0.0) {
        let of = table.columns().skip(2).map(|(column, values)| extreme(column, &values[from..to], &angles[from..to])).collect();
        all.push(Extremes { ratio: ratios[from], of });
        from = to;
    }
    all
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
