//! Levels of detail for a scene: settings from the best that holds the demands to the cheapest that is of use.

use super::Study;
use super::choice::{candidates, speed};
use super::configuration::Configuration;
use super::demands::{Demands, Refusal, Unverified};
use super::level_choice::{Point, pick_levels};
use super::level_tables::level_tables;
use super::measured_level::MeasuredLevel;
use super::output_group::OutputGroup;
use super::run::Failed;
use super::sweep::{Measured, Row};
use super::transfer_trial::{NoSwitch, switch_both_ways};
use super::verification::{Trial, Variation, Verification};
use crate::scene::{Level, ModelKind, SceneError, SceneSource};

/// A setting whose outputs err by more than this part is of no use.
const USELESS: f64 = 0.5;

/// Levels of a scene, and what was found on the way to them.
#[derive(Debug, Clone, PartialEq)]
pub struct Levels {
    /// The best first, each cheaper than the one before.
    pub levels: Vec<MeasuredLevel>,
    /// The keys of the first level, which become the scene's own.
    pub keys: Vec<String>,
    /// The levels as a scene has them, each with a comment.
    pub tables: Vec<(Level, String)>,
    /// The scene with the keys of the first level and with the tables.
    pub source: SceneSource,
    /// Settings that were picked, but did not stand their verification.
    pub passed_over: Vec<PassedOver>,
}

/// A setting that was picked, but is no level.
#[derive(Debug, Clone, PartialEq)]
pub struct PassedOver {
    /// The setting.
    pub configuration: Configuration,
    /// The reason.
    pub why: Unfit,
}

/// Why a setting is no level.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// It does not run where it is verified.
    #[error("{0}: {1}")]
    Run(Variation, Failed),
    /// It is too slow there, or of no use.
    #[error("{variation} it has an error of {error:.2e} at {real_time_factor:.4} times real time by its slowest repeat")]
    Demands {
        /// How that run differs from the scene.
        variation: Variation,
        /// Its largest error there.
        error: f64,
        /// Simulated seconds per second there.
        real_time_factor: f64,
    },
    /// It does not run for ten minutes.
    #[error("over ten minutes: {0}")]
    LongRun(Failed),
    /// It does not keep its energy.
    #[error("its energy balance is off by {0:.2e} after ten minutes")]
    Energy(f64),
    /// A run cannot switch between it and the level before.
    #[error("a run cannot switch between it and {before}: {why}")]
    Switch {
        /// The level before.
        before: Configuration,
        /// The reason.
        why: NoSwitch,
    },
}

/// Why there are no levels.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoLevels {
    /// Not even the first one holds the demands.
    #[error("{0}")]
    First(Refusal),
    /// Nothing is accurate enough for a level.
    #[error("no setting is of use as a level: the best, {best}, errs by {error:.2e}, and half an output is the most")]
    Useless {
        /// The most accurate of those that are fast enough.
        best: Configuration,
        /// Its largest error.
        error: f64,
    },
    /// There is nothing to switch to.
    #[error("a single level: no cheaper setting is worth a switch from {0}")]
    Single(Configuration),
    /// The text of the scene refuses them.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// A setting that may become a level.
struct Entrant<'a> {
    row: &'a Row,
    measured: &'a Measured,
    trial: Option<Trial>,
}

/// Chooses at most `count` levels from a study of the scene. The first holds `demands`, and all of them its speed. `budget_s` bounds
/// the reference of the verifying runs; `progress` is called before every run.
///
/// # Errors
/// [`NoLevels`] if no setting holds the demands, or nothing cheaper is of use.
pub fn choose_levels(
    source: &SceneSource,
    study: &Study,
    demands: &Demands,
    count: usize,
    budget_s: f64,
    progress: &mut dyn FnMut(&Configuration),
) -> Result<Levels, NoLevels> {
    // The incremental method carries a state of its own.
    let switches = |row: &&Row| row.configuration.family.model != ModelKind::Incremental;
    let study = &Study { rows: study.rows.iter().filter(switches).cloned().collect(), ..study.clone() };
    let entrants = entrants(study, demands)?;
    let best = entrants.iter().map(Entrant::error).fold(f64::INFINITY, f64::min);
    let verification = Verification::new(&source.scene, study, best, budget_s, progress).map_err(NoLevels::First)?;
    let mut contest = Contest { study, demands, verification, entrants, passed_over: Vec::new() };
    loop {
        let picked = contest.pick(count)?;
        if !contest.verify(&picked, progress) {
            continue;
        }
        let levels: Vec<MeasuredLevel> = picked.iter().filter_map(|place| contest.level(*place)).collect();
        let keys = levels.first().map_or_else(Vec::new, |level| level.row.configuration.keys(&source.scene));
        let tables = level_tables(source, &keys, &levels)?;
        let source = source.with_levels(&keys, &tables)?;
        if contest.switches(&picked, &source, progress)? {
            return Ok(Levels { levels, keys, tables, source, passed_over: contest.passed_over });
        }
    }
}

/// The settings that are fast enough and of use: of these, those that keep the energy balance, if any does.
fn entrants<'a>(study: &'a Study, demands: &Demands) -> Result<Vec<Entrant<'a>>, NoLevels> {
    let holding = candidates(study, demands).map_err(NoLevels::First)?;
    let fast = study.measured().filter(|(_, measured)| speed(measured) >= demands.real_time_factor);
    let of_use = fast.filter(|(_, measured)| measured.error <= USELESS);
    let entrants = of_use.map(|(row, measured)| Entrant { row, measured, trial: None });
    let (kept, other): (Vec<_>, Vec<_>) = entrants.partition(|entrant| entrant.measured.balance_kept);
    let entrants = if kept.is_empty() { other } else { kept };
    match holding.iter().min_by(|a, b| a.1.error.total_cmp(&b.1.error)) {
        Some((row, measured)) if entrants.is_empty() => {
            Err(NoLevels::Useless { best: row.configuration.clone(), error: measured.error })
        }
        _ => Ok(entrants),
    }
}

/// The settings that are left, and those that were passed over.
struct Contest<'a> {
    study: &'a Study,
    demands: &'a Demands,
    verification: Verification<'a>,
    entrants: Vec<Entrant<'a>>,
    passed_over: Vec<PassedOver>,
}

impl Contest<'_> {
    /// Picks levels by what is known so far. One level alone is picked only until it is verified.
    fn pick(&self, count: usize) -> Result<Vec<usize>, NoLevels> {
        let picked = pick_levels(&self.entrants.iter().map(Entrant::point).collect::<Vec<_>>(), count);
        let Some(first) = picked.first().map(|place| &self.entrants[*place]) else {
            return Err(NoLevels::First(self.refusal()));
        };
        match &first.trial {
            Some(trial) if first.error() > self.demands.tolerance => {
                let trial = Trial { error: first.error(), ..trial.clone() };
                Err(NoLevels::First(self.verification.refusal(&trial, self.demands, (&first.row.configuration, 1))))
            }
            Some(_) if picked.len() == 1 => Err(NoLevels::Single(first.row.configuration.clone())),
            _ => Ok(picked),
        }
    }

    /// The refusal if nothing is left: the last that was too slow or in error. Errors beyond use are not the reference's.
    fn refusal(&self) -> Refusal {
        let last = self.passed_over.iter().rev().find_map(|passed| match passed.why {
            Unfit::Demands { error, real_time_factor, .. } => Some((&passed.configuration, error, real_time_factor, false)),
            Unfit::Energy(error) => Some((&passed.configuration, error, f64::INFINITY, true)),
            _ => None,
        });
        last.map_or(Refusal::Nothing, |(last, error, real_time_factor, over_ten_minutes)| {
            Refusal::Verification(Unverified {
                configuration: last.clone(),
                tried: 1,
                error_times: error / self.demands.tolerance,
                speed_times: self.demands.real_time_factor / real_time_factor,
                variation: self.verification.variation,
                over_ten_minutes,
                reference: false,
                sufficient_budget: None,
                left_out: self.study.left_out > 0,
            })
        })
    }

    /// Runs the first of those picked that is not verified. Returns whether all of them are.
    fn verify(&mut self, picked: &[usize], progress: &mut dyn FnMut(&Configuration)) -> bool {
        let Some(place) = picked.iter().copied().find(|place| self.entrants[*place].trial.is_none()) else {
            return picked.first().is_none_or(|first| self.keeps_energy(*first, progress));
        };
        let configuration = &self.entrants[place].row.configuration;
        progress(configuration);
        let variation = self.verification.variation;
        match self.verification.run(configuration) {
            Err(failed) => self.pass_over(place, Unfit::Run(variation, failed)),
            Ok(Trial { error, real_time_factor, .. }) if error > USELESS || real_time_factor < self.demands.real_time_factor => {
                self.pass_over(place, Unfit::Demands { variation, error, real_time_factor });
            }
            Ok(trial) => self.entrants[place].trial = Some(trial),
        }
        false
    }

    /// Whether the first level keeps its energy within the tolerance over ten minutes, where both are asked for.
    fn keeps_energy(&mut self, first: usize, progress: &mut dyn FnMut(&Configuration)) -> bool {
        let Entrant { row, trial: Some(trial), .. } = &mut self.entrants[first] else { return true };
        if self.demands.tolerance.is_infinite() || trial.long_energy.is_some() {
            return true;
        }
        progress(&row.configuration);
        match self.verification.long_energy(&row.configuration) {
            Err(failed) => self.pass_over(first, Unfit::LongRun(failed)),
            Ok(Some(error)) if error > self.demands.tolerance => self.pass_over(first, Unfit::Energy(error)),
            Ok(error) => {
                trial.long_energy = error;
                return true;
            }
        }
        false
    }

    /// Whether a run can switch between neighbouring levels; the second one is passed over if not.
    fn switches(
        &mut self,
        picked: &[usize],
        source: &SceneSource,
        progress: &mut dyn FnMut(&Configuration),
    ) -> Result<bool, NoLevels> {
        let scenes = (0..picked.len()).map(|index| Ok(source.at_level(index)?.scene)).collect::<Result<Vec<_>, SceneError>>()?;
        for (places, pair) in picked.windows(2).zip(scenes.windows(2)) {
            progress(&self.entrants[places[1]].row.configuration);
            if let Err(why) = switch_both_ways(&pair[0], &pair[1], &self.study.grid) {
                let before = self.entrants[places[0]].row.configuration.clone();
                self.pass_over(places[1], Unfit::Switch { before, why });
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn level(&self, place: usize) -> Option<MeasuredLevel> {
        let Entrant { row, measured, trial } = &self.entrants[place];
        let trial = trial.clone()?;
        let angle_rad = self.study.reference.bounded_error(&measured.errors, &[OutputGroup::Angle]);
        let error_rad = angle_rad.max(trial.angle_rad);
        Some(MeasuredLevel { row: (*row).clone(), real_time_factor: speed(measured), trial, error_rad })
    }

    fn pass_over(&mut self, place: usize, why: Unfit) {
        let configuration = self.entrants.remove(place).row.configuration.clone();
        self.passed_over.push(PassedOver { configuration, why });
    }
}

impl Entrant<'_> {
    /// The larger error of the study and the verification.
    fn error(&self) -> f64 {
        self.trial.as_ref().map_or(0.0, |trial| trial.error).max(self.measured.error)
    }

    /// Its cost is the quickest repeat's time, in which another program has the least part. Counted work leaves out what a step costs
    /// besides, and levels are for deadlines.
    fn point(&self) -> Point {
        Point { cost: self.measured.timing.quickest_per_s, error: self.error(), step_s: self.row.configuration.step_s }
    }
}
