//! A sweep as tables.

use std::path::Path;

use super::label::Label;
use super::outcome::{Category, Outcome};
use super::plan::Map;
use super::quantity::STEP;
use super::sweep::Swept;
use crate::integrate::StepError;
use crate::simulation::Cause;
use crate::study::Table;
use crate::whole_file::WholeFile;

/// One row per cell: verdict on the energy balance, label, values of the axes, category (its index in [`Category::ALL`]), error over its
/// bound's scale, steps, time and energy reached, growth by the mechanism; NaN for missing values.
pub fn table(swept: &Swept) -> Table {
    let (x, y) = (&swept.map.x, &swept.map.y);
    let columns = x.values.len();
    let value = |axis: &[f64], place: usize| axis.get(place).copied().unwrap_or(f64::NAN);
    let cells = 0..swept.outcomes.len();
    let each = |of: &dyn Fn(&Outcome) -> f64| swept.outcomes.iter().map(of).collect::<Vec<f64>>();
    let mut table = Table::default();
    table.push_words("energy_verdict", swept.outcomes.iter().map(|end| end.verdict_as_str().to_owned()).collect());
    table.push_words("label", swept.outcomes.iter().map(|end| end.label_as_str().to_owned()).collect());
    table.push(x.of.name, cells.clone().map(|n| value(&x.values, n % columns)).collect());
    table.push(y.of.name, cells.map(|n| value(&y.values, n / columns)).collect());
    table.push("category", each(&|end| end.category.number() as f64));
    table.push("error", each(&|end| end.error.unwrap_or(f64::NAN)));
    table.push("step", each(&|end| end.step as f64));
    table.push("sim_time_s", each(&|end| end.sim_time_s));
    table.push("energy_j", each(&|end| end.energy_j.unwrap_or(f64::NAN)));
    table.push("growth", each(&|end| end.growth.unwrap_or(f64::NAN)));
    table
}

/// The categories' numbers row by row, as a heat map takes them: `grid[j][i]` at the map's `x.values[i]`, `y.values[j]`.
pub fn grid(swept: &Swept) -> Vec<Vec<f64>> {
    let row = |cells: &[Outcome]| cells.iter().map(|end| end.category.number() as f64).collect();
    swept.outcomes.chunks(swept.map.x.values.len().max(1)).map(row).collect()
}

/// Number of cells per category, in the order of [`Category::ALL`].
pub fn counts(swept: &[Swept]) -> [usize; Category::ALL.len()] {
    let mut counts = [0; Category::ALL.len()];
    for outcome in swept.iter().flat_map(|swept| &swept.outcomes) {
        counts[outcome.category.number()] += 1;
    }
    counts
}

/// Number of cells of a category per label, with the label's name.
pub fn labels(swept: &[Swept], category: Category) -> [(&'static str, usize); Label::ALL.len()] {
    let of = |end: &&Outcome| end.category == category;
    let labels = || swept.iter().flat_map(|swept| &swept.outcomes).filter(of).filter_map(|end| end.label);
    Label::ALL.map(|label| (label.as_str(), labels().filter(|one| *one == label).count()))
}

/// Number of diverged cells per cause, with the cause's name.
pub fn causes(swept: &[Swept]) -> [(&'static str, usize); 6] {
    let causes = || swept.iter().flat_map(|swept| &swept.outcomes).filter_map(|end| end.cause);
    let count = |of: fn(&Cause) -> bool| causes().filter(of).count();
    [
        ("more energy than was put in", count(|cause| matches!(cause, Cause::EnergyGrew { .. }))),
        ("a step that moved the balance", count(|cause| matches!(cause, Cause::BalanceMoved { .. }))),
        ("a step that dissipated more than there was", count(|cause| matches!(cause, Cause::Dissipated { .. }))),
        ("Newton's iteration did not converge", count(|cause| matches!(cause, Cause::Step(StepError::NotConverged { .. })))),
        ("a singular matrix", count(|cause| matches!(cause, Cause::Step(StepError::Singular)))),
        ("a number stopped being finite", count(|cause| matches!(cause, Cause::Step(StepError::NotFinite)))),
    ]
}

/// Number of refused cells per reason, most first. What a cell gave its scene is left out of the reason.
pub fn refusals(swept: &[Swept]) -> Vec<(&str, usize)> {
    let mut reasons: Vec<(&str, usize)> = Vec::new();
    for end in swept.iter().flat_map(|swept| &swept.outcomes).filter(|end| end.category == Category::Refused) {
        let reason = without_given(&end.message);
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, count)) => *count += 1,
            None => reasons.push((reason, 1)),
        }
    }
    reasons.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    reasons
}

/// The reason in `--set KEY=VALUE: KEY = VALUE: REASON`.
fn without_given(message: &str) -> &str {
    let of_key = || {
        let (given, rest) = message.strip_prefix("--set ")?.split_once(": ")?;
        let (key, _) = given.split_once('=')?;
        let after_value = rest.strip_prefix(key)?.strip_prefix(" = ")?.split_once(": ");
        Some(after_value.map_or(rest, |(_, reason)| reason))
    };
    of_key().unwrap_or(message)
}

/// A scene that runs at one step and fails at the next finer one.
#[derive(Debug, Clone, PartialEq)]
pub struct FailsFiner<'a> {
    /// The map.
    pub map: &'a Map,
    /// Value of the map's y axis.
    pub value: f64,
    /// The step at which it is stable, s.
    pub step_s: f64,
    /// The next finer step, s.
    pub finer_step_s: f64,
    /// The outcome at the finer step: wrong, diverged, or worse.
    pub finer: &'a Outcome,
}

/// All scenes that run at one step and fail at the next finer one.
pub fn fails_finer(swept: &[Swept]) -> Vec<FailsFiner<'_>> {
    let by_step = swept.iter().filter(|swept| swept.map.x.of.name == STEP.name);
    by_step
        .flat_map(|swept| swept.map.y.values.iter().enumerate().flat_map(|(row, value)| row_fails_finer(swept, row, *value)))
        .collect()
}

fn row_fails_finer(swept: &Swept, row: usize, value: f64) -> impl Iterator<Item = FailsFiner<'_>> {
    let (map, steps) = (&swept.map, &swept.map.x.values);
    let ends = swept.outcomes.iter().skip(row * steps.len());
    let finer = ends.clone().zip(steps);
    finer.zip(ends.zip(steps).take(steps.len()).skip(1)).filter_map(move |((finer, finer_step_s), (end, step_s))| {
        let fails = !matches!(finer.category, Category::Stable | Category::Refused | Category::NotRun);
        (fails && end.category == Category::Stable).then_some(FailsFiner {
            map,
            value,
            step_s: *step_s,
            finer_step_s: *finer_step_s,
            finer,
        })
    })
}

/// The same as a table.
pub fn fails_finer_table(all: &[FailsFiner<'_>]) -> Table {
    let words = |of: fn(&FailsFiner<'_>) -> String| all.iter().map(of).collect::<Vec<String>>();
    let each = |of: &dyn Fn(&FailsFiner<'_>) -> f64| all.iter().map(of).collect::<Vec<f64>>();
    let mut table = Table::default();
    table.push_words("map", words(|one| one.map.name.clone()));
    table.push_words("varied", words(|one| one.map.y.of.name.to_owned()));
    table.push_words("finer", words(|one| one.finer.category.as_str().to_owned()));
    table.push_words("energy_verdict", words(|one| one.finer.verdict_as_str().to_owned()));
    table.push("value", each(&|one| one.value));
    table.push("step_s", each(&|one| one.step_s));
    table.push("finer_step_s", each(&|one| one.finer_step_s));
    table.push("finer_error", each(&|one| one.finer.error.unwrap_or(f64::NAN)));
    table
}

/// Writes one row per cell of every map, with its message and overrides.
///
/// # Errors
/// Fails if the file cannot be written.
pub fn write_ends(path: &Path, swept: &[Swept]) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(WholeFile::create(path)?);
    writer.write_record([
        "map",
        "category",
        "label",
        "growth",
        "step",
        "sim_time_s",
        "energy_verdict",
        "message",
        "overrides",
    ])?;
    for Swept { map, outcomes } in swept {
        for (end, cell) in outcomes.iter().zip(&map.cells) {
            let (step, time) = (end.step.to_string(), end.sim_time_s.to_string());
            let growth = end.growth.map_or_else(String::new, |growth| growth.to_string());
            let (category, label, verdict) = (end.category.as_str(), end.label_as_str(), end.verdict_as_str());
            let given = cell.overrides.join(" ");
            writer.write_record([&map.name, category, label, &growth, &step, &time, verdict, &end.message, &given])?;
        }
    }
    let file = writer.into_inner().map_err(|refused| refused.into_error())?;
    Ok(file.finish()?)
}

#[cfg(test)]
mod tests {
    use super::without_given;

    #[test]
    fn val_a_reason_is_without_what_the_cell_gave() {
        for (message, reason) in [
            ("--set crank.elements=0: crank.elements = 0: must be a whole number", "must be a whole number"),
            ("--set pulse=[{ start_s = 0.0 }]: pulse = [{ start_s = 0.0 }]: no room: drop [drive]", "no room: drop [drive]"),
            ("crank.rigid = true: flexible links alone", "crank.rigid = true: flexible links alone"),
            ("--set a.b=1: c = 2: other", "--set a.b=1: c = 2: other"),
        ] {
            assert_eq!(without_given(message), reason);
        }
    }
}
