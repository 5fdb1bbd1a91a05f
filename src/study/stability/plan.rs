//! What is to be swept: maps of cells, each a scene by overrides.

use crate::nearest::nearest;

/// A part of a name was given that is in none.
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

/// How the values of an axis lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// By ratios.
    Log,
    /// By differences.
    Linear,
    /// Neither: a list of cases.
    Listed,
}

/// One axis of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name with unit, as in `step_s`.
    pub name: &'static str,
    /// Values, ascending.
    pub values: Vec<f64>,
    /// How they lie.
    pub spacing: Spacing,
}

impl Axis {
    /// An axis of these values.
    pub fn new(name: &'static str, spacing: Spacing, values: Vec<f64>) -> Self {
        Axis { name, values, spacing }
    }
}

/// What a cell's error is a part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Crank and rod together.
    Length,
    /// The method that a point of the reference has gone by then; at least a thousandth of crank and rod, at most both.
    Method,
}

/// A run of the base scene under overrides.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// `KEY=VALUE`.
    pub overrides: Vec<String>,
    /// How many steps.
    pub steps: u64,
    /// Its reference's place in [`MapPlan::references`].
    pub reference: Option<usize>,
    /// What its error is a part of.
    pub measure: Measure,
}

/// A category for every pair of an x and a y.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Short name, also of its file.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Row by row: the cell of `x.values[i]`, `y.values[j]` is at `j · x.values.len() + i`.
    pub cells: Vec<Cell>,
}

/// All that is to be swept.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MapPlan {
    /// The maps.
    pub maps: Vec<Map>,
    /// What cells are compared with; each runs once, when first needed.
    pub references: Vec<Cell>,
}

impl MapPlan {
    /// How many cells.
    pub fn len(&self) -> usize {
        self.maps.iter().map(|map| map.cells.len()).sum()
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The place of this reference, which is added unless it is there.
    pub(super) fn reference(&mut self, overrides: Vec<String>, steps: u64) -> usize {
        let reference = Cell { overrides, steps, reference: None, measure: Measure::Length };
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
