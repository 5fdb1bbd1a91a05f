//! The plan of a sweep: maps of cells, each a scene with overrides.

use std::f64::consts::FRAC_PI_2;

use super::quantity::{Quantity, START_ANGLE};
use crate::nearest::nearest;

/// No map has a name with the given part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no map has `{part}` in its name{} (there are {})", hint(.nearest), names.join(", "))]
pub struct NoMap {
    part: String,
    nearest: Option<String>,
    names: Vec<String>,
}

fn hint(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// Spacing of the values of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// Equal ratios.
    Log,
    /// Equal differences.
    Linear,
    /// A list of cases.
    Listed,
}

/// One axis of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity that it shows.
    pub of: Quantity,
    /// Values, ascending.
    pub values: Vec<f64>,
    /// Spacing of the values.
    pub spacing: Spacing,
}

impl Axis {
    /// An axis of these values.
    pub fn new(of: Quantity, spacing: Spacing, values: Vec<f64>) -> Self {
        Axis { of, values, spacing }
    }

    /// A value as a label of at most eight characters.
    pub fn shown(&self, value: f64) -> String {
        let rounded = format!("{value:.3e}").parse().unwrap_or(value);
        let [plain, power] = [format!("{rounded}"), format!("{rounded:e}")];
        let number = if power.len() < plain.len() { power } else { plain };
        let by_angle = (self.of == START_ANGLE).then(|| beside_right_angle(value)).flatten();
        by_angle.unwrap_or(number)
    }
}

/// An angle at a right angle or close to one: `π/2-1e-9`.
fn beside_right_angle(angle_rad: f64) -> Option<String> {
    let quarters = (angle_rad / FRAC_PI_2).round();
    let multiple = match quarters as i64 {
        -2 => "-π",
        -1 => "-π/2",
        1 => "π/2",
        2 => "π",
        4 => "2π",
        _ => return None,
    };
    let beside = angle_rad - quarters * FRAC_PI_2;
    match beside.abs() {
        0.0 => Some(multiple.to_owned()),
        0.0..0.01 => Some(format!("{multiple}{beside:+.0e}")),
        _ => None,
    }
}

/// The length that a cell's error is relative to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Length of crank and rod together.
    Length,
    /// The distance that a point of the reference has travelled by then; at least a thousandth of crank and rod, at most both.
    Travel,
}

/// A run of the base scene under overrides.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// `KEY=VALUE`.
    pub overrides: Vec<String>,
    /// Number of steps.
    pub steps: u64,
    /// Index of its reference in [`MapPlan::references`].
    pub reference: Option<usize>,
    /// The length that its error is relative to.
    pub measure: Measure,
    /// A change of the running scene.
    pub switch: Option<Switch>,
}

/// A change of the scene while it runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Switch {
    /// The change holds after the first step that reaches this time, s.
    pub at_s: f64,
    /// `KEY=VALUE`.
    pub changes: Vec<String>,
}

/// A category for every pair of an x and a y.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Short name, also of its file.
    pub name: String,
    /// Title of the map.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Row by row: the cell of `x.values[i]`, `y.values[j]` is at `j · x.values.len() + i`.
    pub cells: Vec<Cell>,
}

impl Map {
    /// Whether its runs have a pulse or a speed of their own, in place of the scene's.
    pub fn brings_motion(&self) -> bool {
        ["pulses", "crank-speed", "revolutions"].iter().any(|name| self.name.starts_with(name))
    }
}

/// The maps and references of a sweep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MapPlan {
    /// The maps.
    pub maps: Vec<Map>,
    /// References of the cells; each runs once, when first needed.
    pub references: Vec<Cell>,
}

impl MapPlan {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.maps.iter().map(|map| map.cells.len()).sum()
    }

    /// Whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Index of a reference, which is added if it is new.
    pub(super) fn reference(&mut self, overrides: Vec<String>, steps: u64) -> usize {
        let reference = Cell { overrides, steps, reference: None, measure: Measure::Length, switch: None };
        self.references.iter().position(|known| *known == reference).unwrap_or_else(|| {
            self.references.push(reference);
            self.references.len() - 1
        })
    }

    /// Keeps only the maps whose names contain `part`.
    ///
    /// # Errors
    /// [`NoMap`] when there is none; then all are kept.
    pub fn only(&mut self, part: &str) -> Result<(), NoMap> {
        let names: Vec<String> = self.maps.iter().map(|map| map.name.clone()).collect();
        if !names.iter().any(|name| name.contains(part)) {
            let nearest = nearest(part, names.iter().map(String::as_str)).map(str::to_owned);
            return Err(NoMap { part: part.to_owned(), nearest, names });
        }
        self.maps.retain(|map| map.name.contains(part));
        Ok(())
    }
}
