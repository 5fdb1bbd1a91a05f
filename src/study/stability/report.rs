//! A sweep as tables.

use std::path::Path;

use super::outcome::Category;
use super::sweep::Swept;
use crate::integrate::StepError;
use crate::simulation::Cause;
use crate::study::Table;

/// One row a cell: the axes' values, the category's number (its place in [`Category::ALL`]), the error over its bound's scale,
/// steps, time and energy reached. NaN where there is nothing to tell.
pub fn table(swept: &Swept) -> Table {
    let (x, y) = (&swept.map.x, &swept.map.y);
    let columns = x.values.len();
    let value = |axis: &[f64], place: usize| axis.get(place).copied().unwrap_or(f64::NAN);
    let cells = 0..swept.outcomes.len();
    let each = |of: &dyn Fn(&super::Outcome) -> f64| swept.outcomes.iter().map(of).collect::<Vec<f64>>();
    let mut table = Table::default();
    table.push(x.name, cells.clone().map(|n| value(&x.values, n % columns)).collect());
    table.push(y.name, cells.map(|n| value(&y.values, n / columns)).collect());
    table.push("category", each(&|end| end.category.number() as f64));
    table.push("error", each(&|end| end.error.unwrap_or(f64::NAN)));
    table.push("step", each(&|end| end.step as f64));
    table.push("sim_time_s", each(&|end| end.sim_time_s));
    table.push("energy_j", each(&|end| end.energy_j.unwrap_or(f64::NAN)));
    table
}

/// The categories' numbers row by row, as a heat map takes them: `grid[j][i]` at the map's `x.values[i]`, `y.values[j]`.
pub fn grid(swept: &Swept) -> Vec<Vec<f64>> {
    let row = |cells: &[super::Outcome]| cells.iter().map(|end| end.category.number() as f64).collect();
    swept.outcomes.chunks(swept.map.x.values.len().max(1)).map(row).collect()
}

/// How many cells ended in each category, in the order of [`Category::ALL`].
pub fn counts(swept: &[Swept]) -> [usize; Category::ALL.len()] {
    let mut counts = [0; Category::ALL.len()];
    for outcome in swept.iter().flat_map(|swept| &swept.outcomes) {
        counts[outcome.category.number()] += 1;
    }
    counts
}

/// How many cells diverged for each kind of cause, with its words.
pub fn causes(swept: &[Swept]) -> [(&'static str, usize); 4] {
    let causes = || swept.iter().flat_map(|swept| &swept.outcomes).filter_map(|end| end.cause);
    let count = |of: fn(&Cause) -> bool| causes().filter(of).count();
    [
        ("more energy than was put in", count(|cause| matches!(cause, Cause::EnergyGrew { .. }))),
        ("Newton's iteration did not converge", count(|cause| matches!(cause, Cause::Step(StepError::NotConverged { .. })))),
        ("a singular matrix", count(|cause| matches!(cause, Cause::Step(StepError::Singular)))),
        ("a number stopped being finite", count(|cause| matches!(cause, Cause::Step(StepError::NotFinite)))),
    ]
}

/// Writes one row a cell of every map, with what was said and the overrides that reach it again.
///
/// # Errors
/// When the file cannot be written.
pub fn write_ends(path: &Path, swept: &[Swept]) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_path(path)?;
    writer.write_record(["map", "category", "step", "sim_time_s", "message", "overrides"])?;
    for Swept { map, outcomes } in swept {
        for (end, cell) in outcomes.iter().zip(&map.cells) {
            let (step, time) = (end.step.to_string(), end.sim_time_s.to_string());
            let given = cell.overrides.join(" ");
            writer.write_record([&map.name, end.category.as_str(), &step, &time, &end.message, &given])?;
        }
    }
    Ok(writer.flush()?)
}
