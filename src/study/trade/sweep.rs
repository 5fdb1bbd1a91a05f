//! Families of configurations: each from its longest step down, until finer steps gain nothing.

use std::ops::ControlFlow;

use super::configuration::{Configuration, Family, is_rigid};
use super::effort::RunEffort;
use super::errors::Errors;
use super::fixed_cost::Corrections;
use super::grid::Grid;
use super::output_group::OutputGroup;
use super::reference::{Reference, nominal_s};
use super::run::{Failed, Timing, run, time};
use crate::scene::{ModelKind, Scene};

/// A configuration with its measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The configuration.
    pub configuration: Configuration,
    /// The measurements, or why the run failed.
    pub outcome: Result<Measured, Failed>,
}

/// Measurements of a configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Errors against the reference.
    pub errors: Errors,
    /// Largest relative error among the outputs that count, not below the reference's own uncertainty.
    pub error: f64,
    /// The mark of this error: `<` if it is the reference's uncertainty, `~` if it is less than ten times as large, else none.
    pub mark: &'static str,
    /// Order observed between the next longer step of the family and this one.
    pub order: Option<f64>,
    /// Order observed between the next coarser mesh at the same step and this one.
    pub mesh_order: Option<f64>,
    /// Work of the solver.
    pub effort: RunEffort,
    /// Whether deflections left the model's range.
    pub out_of_range: bool,
    /// Whether the run kept its energy balance, or is not judged by that. If not, `run` calls it not to be trusted.
    pub balance_kept: bool,
    /// The run's own estimate of its error in the first link's chord angle, rad.
    pub estimated_angle_rad: Option<f64>,
    /// Computing time.
    pub timing: Timing,
    /// Seconds of computing per simulated second by counted work, the same on every machine.
    pub counted_s_per_s: f64,
    /// Corrections that suffice for steps of fixed cost.
    pub corrections: Corrections,
    /// Whether it is on the front.
    pub on_front: bool,
}

/// A finer step that leaves more than this part of the error gains nothing.
const NO_GAIN: f64 = 0.9;
/// Errors of settings that may be chosen, over the error below which nothing is of use.
const NEAR: f64 = 4.0;
/// Below this, the error still falls with the step: a finer mesh would show the same.
const STEP_BOUND: f64 = 0.7;
/// A point must be cheaper by this factor, in nominal cost, to be surely cheaper.
const SURELY: f64 = 3.0;
/// Part of the budget that one run may take, nominally.
const LARGEST_PART: f64 = 0.03;

/// State of a sweep.
pub(super) struct Sweep<'a> {
    pub scene: &'a Scene,
    pub grid: &'a Grid,
    pub reference: &'a Reference,
    pub outputs: &'a [OutputGroup],
    pub steps_s: Vec<f64>,
    /// Whether families end early: not when their steps were asked for.
    pub prune: bool,
    /// Longest step that resolves the lowest frequency at which a link bends, s. At longer ones, errors stand still or jump
    /// without having begun to fall.
    pub resolving_step_s: f64,
    /// Errors below this are of no use.
    pub enough: f64,
    pub budget_s: f64,
    pub rows: Vec<Row>,
    pub left_out: usize,
    /// Families that were left out whole, though the budget would do for their first run alone.
    pub not_begun: Vec<Family>,
    /// Nominal seconds spent.
    pub spent_s: f64,
}

impl Sweep<'_> {
    /// Runs one family. `expired` returns whether the time budget has run out; `progress` is called before every run.
    pub fn family(
        &mut self,
        family: &Family,
        expired: &dyn Fn() -> bool,
        progress: &mut dyn FnMut(&Configuration) -> ControlFlow<()>,
    ) {
        if self.prune && self.is_settled(family) {
            return;
        }
        let first = self.rows.len();
        let (steps_s, start_s) = (self.steps_s.clone(), self.start_s(family));
        let mut idle = 0;
        for (place, &step_s) in steps_s.iter().enumerate().filter(|(_, step_s)| **step_s <= start_s) {
            let configuration = Configuration { family: family.clone(), step_s };
            if self.is_too_dear(&configuration) || expired() {
                self.left_out += steps_s.len() - place;
                if self.rows.len() == first && !self.is_too_dear_alone(&configuration) {
                    self.not_begun.push(family.clone());
                }
                return;
            }
            if progress(&configuration).is_break() {
                return;
            }
            self.measure(configuration, first);
            let [.., last] = self.rows.as_slice() else { return };
            let Ok(measured) = &last.outcome else { continue };
            let (error, suffices) = (measured.error, measured.error <= self.enough && measured.balance_kept);
            let gained = measured.order.is_none() || error < NO_GAIN * self.error_before(first).unwrap_or(f64::INFINITY);
            let resolves = family.model == ModelKind::Rigid || step_s <= self.resolving_step_s;
            // A shorter step may keep the energy balance of a setting that would do else.
            let lacks_balance = !measured.balance_kept && error <= NEAR * self.enough;
            idle = if gained || !resolves || lacks_balance { 0 } else { idle + 1 };
            if self.prune && (idle >= 2 || suffices || self.is_hopeless(family, error, step_s, &steps_s[place + 1..])) {
                return;
            }
        }
    }

    /// Whether the cost of making these links rigid, which the scene's are not, is known and too high: two resolutions of the same model
    /// ended at the same error, which finer ones and other integrators would only confirm. An error that still fell with the step is
    /// no such end.
    fn is_settled(&self, family: &Family) -> bool {
        let links = self.scene.chain().map(|chain| chain.links.as_slice()).unwrap_or_default();
        if family.rigid.iter().zip(links).all(|(rigid, link)| *rigid == is_rigid(link)) {
            return false;
        }
        let mut ends: Vec<(usize, f64)> = Vec::new();
        for rows in self.rows.chunk_by(|one, next| one.configuration.family == next.configuration.family) {
            let [Row { configuration: Configuration { family: other, .. }, .. }, ..] = rows else { continue };
            let Some(error) = end(rows).filter(|_| other.model == family.model && other.has_links_of(family)) else { continue };
            match ends.iter_mut().find(|(resolution, _)| *resolution == other.resolution) {
                Some((_, least)) => *least = least.min(error),
                None => ends.push((other.resolution, error)),
            }
        }
        ends.sort_by_key(|(resolution, _)| *resolution);
        ends.windows(2).any(|pair| pair[1].1 > NO_GAIN * pair[0].1 && pair[1].1 > self.enough)
    }

    /// The first step of a family: the one where its coarser sister's error stopped falling. At longer steps the step dominates
    /// the error, and the sister is cheaper.
    fn start_s(&self, family: &Family) -> f64 {
        if !self.prune {
            return f64::INFINITY;
        }
        let error = |row: &&Row| Some((row.configuration.step_s, row.outcome.as_ref().ok()?.error));
        let errors: Vec<(f64, f64)> = self.coarser(family).iter().filter_map(error).collect();
        let settled = errors.windows(2).find(|pair| pair[1].1 > STEP_BOUND * pair[0].1).map(|pair| pair[0].0);
        settled.or(errors.last().map(|last| last.0)).unwrap_or(f64::INFINITY)
    }

    /// Rows of the next coarser sister, from the longest step on.
    fn coarser(&self, family: &Family) -> Vec<&Row> {
        let sister = |row: &&Row| {
            let other = &row.configuration.family;
            other.resolution < family.resolution
                && (other.model, other.integrator) == (family.model, family.integrator)
                && other.has_links_of(family)
        };
        let size = self.rows.iter().filter(sister).map(|row| row.configuration.family.resolution).max();
        self.rows.iter().filter(sister).filter(|row| Some(row.configuration.family.resolution) == size).collect()
    }

    fn is_too_dear(&self, configuration: &Configuration) -> bool {
        self.is_too_dear_alone(configuration) || self.spent_s + 2.0 * nominal_s(configuration, self.grid) > self.budget_s
    }

    fn is_too_dear_alone(&self, configuration: &Configuration) -> bool {
        nominal_s(configuration, self.grid) > LARGEST_PART * self.budget_s
    }

    /// Whether some point that keeps its energy balance is surely cheaper than every finer step and at least as good as that step
    /// could be.
    fn is_hopeless(&self, family: &Family, error: f64, step_s: f64, finer_s: &[f64]) -> bool {
        let order = f64::from(family.integrator.order()) + 0.5;
        finer_s.iter().all(|&finer_s| {
            let hoped = (error * (finer_s / step_s).powf(order)).max(self.reference.estimate.worst(self.outputs));
            let cost_s = nominal_s(&Configuration { family: family.clone(), step_s: finer_s }, self.grid);
            self.rows.iter().any(|row| {
                let kept = row.outcome.as_ref().ok().filter(|measured| measured.balance_kept);
                let error = kept.map_or(f64::INFINITY, |measured| measured.error);
                error <= hoped && SURELY * nominal_s(&row.configuration, self.grid) < cost_s
            })
        })
    }

    fn error_before(&self, first: usize) -> Option<f64> {
        let mut done = self.rows[first..].iter().rev().skip(1).filter_map(|row| row.outcome.as_ref().ok());
        done.next().map(|measured| measured.error)
    }

    fn measure(&mut self, configuration: Configuration, first: usize) {
        let outcome = self.outcome(&configuration, first);
        self.spent_s += 3.0 * nominal_s(&configuration, self.grid);
        self.rows.push(Row { configuration, outcome });
    }

    fn outcome(&self, configuration: &Configuration, first: usize) -> Result<Measured, Failed> {
        let (run, seconds) = run(configuration, self.scene, self.grid)?;
        let timing = time(configuration, self.scene, self.grid, seconds)?;
        let errors = self.reference.errors(&run);
        let order = |before: &Row, ratio: f64| {
            let gained = before.outcome.as_ref().ok()?.errors.worst(self.outputs) / errors.worst(self.outputs);
            Some(gained.ln() / ratio.ln())
        };
        let Configuration { family, step_s } = configuration;
        let longer = self.rows[first..].last();
        let coarser = self.coarser(family).into_iter().find(|row| row.configuration.step_s == *step_s);
        let meshed = coarser.filter(|_| family.model == ModelKind::FiniteElement);
        let elements = |row: &Row| family.resolution as f64 / row.configuration.family.resolution as f64;
        Ok(Measured {
            error: self.reference.bounded_error(&errors, self.outputs),
            mark: self.reference.bounded_mark(&errors, self.outputs),
            errors,
            order: longer.and_then(|row| order(row, row.configuration.step_s / step_s)),
            mesh_order: meshed.and_then(|row| order(row, elements(row))),
            effort: run.effort,
            estimated_angle_rad: run.estimated_angle_rad,
            counted_s_per_s: 1e-6 * family.counted_us(&run.effort, self.scene) / self.grid.until_s(),
            out_of_range: run.out_of_range,
            balance_kept: run.balance_kept,
            timing,
            corrections: Corrections::NotAsked,
            on_front: false,
        })
    }
}

/// The smallest error of a family's rows, if the last step gained nothing over the one before: the rest is not the step's.
fn end(rows: &[Row]) -> Option<f64> {
    let errors: Vec<f64> = rows.iter().filter_map(|row| Some(row.outcome.as_ref().ok()?.error)).collect();
    match errors.as_slice() {
        [.., before, last] if *last > NO_GAIN * before => errors.into_iter().reduce(f64::min),
        _ => None,
    }
}
