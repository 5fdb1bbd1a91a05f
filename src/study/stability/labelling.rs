//! Labels of diverged and wrong cells: whether the mechanism itself amplifies small differences, or only the scheme fails at its step.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::base_scene::BaseScene;
use super::cell::{self, BOUND};
use super::label::Label;
use super::outcome::{Category, Outcome};
use super::plan::Cell;
use super::trajectory::Trajectory;
use crate::scene::SceneSource;
use crate::small_motion::growth::{Growth, Judged};

/// Time followed where a cell has no reference, s.
const FOLLOWED_S: f64 = 0.25;
/// Most elements and modes of a link whose growth is followed: the mechanism's own slow motion needs no more.
const GROWTH_MESH: usize = 4;
/// Most elements of a link in fine runs.
const FINE_MESH: usize = 8;
/// Steps of the two fine runs over the time followed.
const FINE_STEPS: [u64; 2] = [512, 2048];
/// Errors of two fine runs that agree differ by no more than this factor.
const AGREE: f64 = 1.25;
/// Part of a time by which two runs that diverge at the same time may differ.
const SAME_TIME: f64 = 0.05;
/// Steps of the coarser fine run that resolve the beginning of a motion.
const RESOLVED: f64 = 8.0;

/// A value that is computed once, by whoever needs it first.
type Once<T> = Arc<OnceLock<T>>;

/// Labels cells. The growth of a mechanism serves all cells of it, whatever their scheme and step.
#[derive(Default)]
pub(super) struct Labels {
    growths: Mutex<HashMap<String, Once<Option<Growth>>>>,
    fine_runs: Mutex<HashMap<String, Once<Fine>>>,
}

impl Labels {
    /// Adds its label and the growth to the outcome of a cell that is wrong or diverged.
    pub(super) fn add(&self, base: &BaseScene, cell: &Cell, reference: Option<(&Cell, &Trajectory)>, outcome: &mut Outcome) {
        if !matches!(outcome.category, Category::Wrong | Category::Diverged) {
            return;
        }
        let (label, growth) = self.label(base, cell, reference, outcome);
        (outcome.label, outcome.growth) = (Some(label), growth);
    }

    fn label(
        &self,
        base: &BaseScene,
        cell: &Cell,
        reference: Option<(&Cell, &Trajectory)>,
        outcome: &Outcome,
    ) -> (Label, Option<f64>) {
        let undecided = (Label::Undecided, None);
        let Some(step_s) = step_s(cell) else { return undecided };
        let planned_s = cell.steps as f64 * step_s;
        let over_s = reference.and_then(|(reference, _)| Some(reference.steps as f64 * self::step_s(reference)?));
        let over_s = over_s.unwrap_or(FOLLOWED_S.min(planned_s));
        let ended_s = if outcome.category == Category::Diverged { outcome.sim_time_s + step_s } else { planned_s };
        let mechanism = meshed(mechanism(cell), GROWTH_MESH);
        let key = format!("{over_s:?} {}", mechanism.join(" "));
        let growth = once(&self.growths, key);
        let growth = growth.get_or_init(|| {
            let source = SceneSource::parse(&base.origin, &base.text, &mechanism).ok()?;
            Growth::along(&source.scene, over_s)
        });
        let Some(growth) = growth else { return undecided };
        let ended_s = ended_s.min(over_s);
        let judged = growth.at(ended_s);
        if let Judged::Grows(growth) = judged {
            return (Label::Mechanism, Some(growth));
        }
        let fine = self.fine(base, cell, reference, over_s);
        match (judged, fine.label(outcome.category, ended_s)) {
            (Judged::Stays(growth), label) => (label, Some(growth)),
            // The motion itself ends there.
            (_, Label::Model) if matches!(fine, Fine::Ends { .. }) && growth.is_small(ended_s) => (Label::Model, None),
            _ => undecided,
        }
    }

    /// Runs of the same model at fine steps.
    fn fine(&self, base: &BaseScene, cell: &Cell, reference: Option<(&Cell, &Trajectory)>, over_s: f64) -> Fine {
        let mut overrides = meshed(mechanism(cell), FINE_MESH);
        overrides.push("solver.integrator=esdirk".to_owned());
        let key = format!("{over_s:?} {:?} {:?} {:?} {}", cell.reference, cell.measure, cell.switch, overrides.join(" "));
        let kept = once(&self.fine_runs, key);
        *kept.get_or_init(|| {
            let run = |steps: u64| {
                let step = format!("solver.step_s={:?}", over_s / steps as f64);
                let fine = Cell { overrides: [&overrides[..], &[step]].concat(), steps, ..cell.clone() };
                cell::run(base, &fine, reference.map(|(_, trajectory)| trajectory))
            };
            let coarse = run(FINE_STEPS[0]);
            if coarse.category == Category::Stable { Fine::Right } else { Fine::of(&coarse, &run(FINE_STEPS[1]), over_s) }
        })
    }
}

/// The end of the same model at fine steps.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fine {
    /// It is right.
    Right,
    /// It goes on to the end, equally wrong at both steps.
    Wrong,
    /// It goes on to the end, but differs from step to step.
    Differs,
    /// It diverges at the same time at both steps.
    Ends {
        /// That time, s.
        at_s: f64,
    },
    /// None of these.
    Unclear,
}

impl Fine {
    fn of(coarse: &Outcome, fine: &Outcome, over_s: f64) -> Self {
        let near = (coarse.sim_time_s - fine.sim_time_s).abs() <= SAME_TIME * fine.sim_time_s;
        // In its first steps no motion is resolved.
        let resolved = fine.sim_time_s > RESOLVED * over_s / FINE_STEPS[0] as f64;
        match (coarse.category, fine.category) {
            (_, Category::Stable) => Fine::Right,
            (Category::Wrong, Category::Wrong) if agree(coarse.error, fine.error) => Fine::Wrong,
            (Category::Wrong, Category::Wrong) => Fine::Differs,
            (Category::Diverged, Category::Diverged) if near && resolved => Fine::Ends { at_s: fine.sim_time_s },
            _ => Fine::Unclear,
        }
    }

    /// The label of a cell that ended so, at this time, and whose mechanism does not amplify.
    fn label(self, category: Category, ended_s: f64) -> Label {
        match (self, category) {
            (Fine::Right, _) | (Fine::Wrong | Fine::Differs, Category::Diverged) => Label::Scheme,
            (Fine::Ends { at_s }, Category::Diverged) if ended_s < (1.0 - SAME_TIME) * at_s => Label::Scheme,
            (Fine::Wrong | Fine::Ends { .. }, _) => Label::Model,
            (Fine::Differs | Fine::Unclear, _) => Label::Undecided,
        }
    }
}

/// Whether the errors of two runs are the same but for a factor, or both within the bound: then the links bend beyond the model's range.
fn agree(one: Option<f64>, other: Option<f64>) -> bool {
    one.zip(other).is_some_and(|(one, other)| one.max(other) <= (AGREE * one.min(other)).max(BOUND))
}

/// The entry of a key, new or known.
fn once<T>(entries: &Mutex<HashMap<String, Once<T>>>, key: String) -> Once<T> {
    let mut entries = entries.lock().unwrap_or_else(PoisonError::into_inner);
    Arc::clone(entries.entry(key).or_default())
}

/// The step of a cell, s.
fn step_s(cell: &Cell) -> Option<f64> {
    let given = cell.overrides.iter().rev().find_map(|given| given.strip_prefix("solver.step_s="));
    given.and_then(|step| step.parse().ok())
}

/// The overrides without those of the scheme and its step.
fn mechanism(cell: &Cell) -> Vec<String> {
    let of_scheme = |given: &String| given.starts_with("solver.") && !given.starts_with("solver.model=");
    cell.overrides.iter().filter(|given| !of_scheme(given)).cloned().collect()
}

/// The overrides with at most so many elements and modes a link.
fn meshed(mut overrides: Vec<String>, most: usize) -> Vec<String> {
    for given in &mut overrides {
        let Some((key, value)) = given.split_once('=') else { continue };
        let counts = key.ends_with(".elements") || key.ends_with(".modes");
        if counts && value.parse::<usize>().is_ok_and(|count| count > most) {
            *given = format!("{key}={most}");
        }
    }
    overrides
}
