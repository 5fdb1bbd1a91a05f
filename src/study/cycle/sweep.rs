//! Costs and gains of the crank-to-rod ratio: the question that the thesis leaves as future work.
//!
//! For the thesis's compressor no ratio is best, but each has its price: with rod, masses and speed kept, every load grows with
//! `λ`, and faster than the swept volume relative to the machine's size. At a given stroke, piston acceleration grows only
//! by `1 + λ` while the machine's length, `1 + 1/(2 λ)` strokes, falls: divide by `stroke_m` to see that.

use super::machine::CycleInstant;
use super::setup::Setup;
use super::units::QuantityKind;
use super::{CycleError, Options};
use crate::scene::SceneSource;
use crate::study::Table;

type Column = (&'static str, QuantityKind, fn(&Setup, &[CycleInstant]) -> f64);

/// Peaks are magnitudes on the grid of angles.
const COLUMNS: [Column; 7] = [
    ("ratio", QuantityKind::Number, |setup, _| setup.ratio),
    ("stroke", QuantityKind::Length, |setup, _| 2.0 * setup.crank_m()),
    ("swept_volume_per_size", QuantityKind::Number, |setup, _| swept_volume_per_size(setup.crank_m(), setup.rod_m)),
    ("peak_shaking_force", QuantityKind::Force, |_, turn| peak(turn, CycleInstant::shaking_force)),
    ("peak_piston_acceleration", QuantityKind::Acceleration, |_, turn| peak(turn, |now| now.piston[2].abs())),
    ("peak_driving_torque", QuantityKind::Torque, |_, turn| peak(turn, |now| now.torque.abs())),
    ("peak_guide_force", QuantityKind::Force, |_, turn| peak(turn, |now| now.guide.abs())),
];

/// One row for every ratio in `options`: `ratio`, `stroke_m`, `swept_volume_per_size`, `peak_shaking_force_n`,
/// `peak_piston_acceleration_m_per_s2`, `peak_driving_torque_nm`, `peak_guide_force_n`, or with the dimensionless suffixes of
/// [`cycle`](super::cycle).
///
/// Swept volume per size is the volume swept, stroke × bore area, over that of the prism of the same bore area which is as
/// long as the machine, from the back of the crank's circle to the outer dead centre of the piston pin:
/// `2 l₁ / (2 l₁ + l₂) = 2 λ / (2 λ + 1)`.
///
/// # Errors
/// [`CycleError`] when the scene is no crank-slider or the options don't suit it.
pub fn sweep(source: &SceneSource, options: &Options) -> Result<Table, CycleError> {
    let mut columns: [Vec<f64>; COLUMNS.len()] = Default::default();
    for setup in Setup::all(source, options)? {
        let units = setup.units(options.dimensionless)?;
        let turn: Vec<CycleInstant> = setup.turn(options.points).collect();
        for ((_, kind, value), column) in COLUMNS.iter().zip(&mut columns) {
            column.push(kind.scaled(value(&setup, &turn), &units));
        }
    }
    let mut table = Table::default();
    for ((stem, kind, _), values) in COLUMNS.iter().zip(columns) {
        table.push(kind.column(stem, options.dimensionless), values);
    }
    Ok(table)
}

/// `count` ratios from `from` to `to`, evenly spaced, both included.
pub fn ratios_between(from: f64, to: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(|index| index as f64 / last).map(|share| from * (1.0 - share) + to * share).collect()
}

fn swept_volume_per_size(crank_m: f64, rod_m: f64) -> f64 {
    let stroke_m = 2.0 * crank_m;
    stroke_m / (stroke_m + rod_m)
}

fn peak(turn: &[CycleInstant], of: impl Fn(&CycleInstant) -> f64) -> f64 {
    turn.iter().map(of).fold(0.0, f64::max)
}
