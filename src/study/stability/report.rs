//! A sweep as tables.

use super::outcome::Category;
use super::sweep::Swept;
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
