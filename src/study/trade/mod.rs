//! Speed against accuracy: a scene run by every model × integrator × discretization × step that suits it, each measured against
//! one reference that the study converges itself; their Pareto front; and the cheapest that meets a user's demands.
//!
//! Everything but the timings is the same from run to run: nominal costs decide what to compute, not the clock. If the time budget
//! runs out by the clock, the result says so.

mod choice;
mod configuration;
mod demands;
mod effort;
mod errors;
mod excitation;
mod fixed_cost;
mod front;
mod grid;
mod level_choice;
mod level_tables;
mod levels;
mod lost_modes;
mod measured_level;
mod output_group;
mod reference;
mod ringing;
mod run;
mod selection;
mod sweep;
mod table;
mod transfer_trial;
mod verification;

use std::ops::ControlFlow;
use std::time::Instant;

use crate::scene::{End, IntegratorKind, ModelKind, Scene};
use crate::small_motion::Vibrations;
use crate::study::duration::usual_until_s;

pub use choice::{Choice, Chosen, choose};
pub use configuration::{Configuration, Family};
pub use demands::{Demands, Excess, Refusal, Unverified};
pub use effort::RunEffort;
pub use errors::Errors;
pub use excitation::{Excitation, ExcitedMode, NoExcitation};
pub use fixed_cost::Corrections;
pub use front::front;
pub use grid::{Grid, NoCommonInterval};
pub use levels::{Levels, NoLevels, PassedOver, Unfit, choose_levels};
pub use lost_modes::{LostModes, ModeError, Reason};
pub use measured_level::MeasuredLevel;
pub(crate) use output_group::STRAIGHT;
pub use output_group::{CHANNELS, Channel, OutputGroup};
pub use reference::{FinerBudget, NoReference, Reference, WELL_RESOLVED};
pub use ringing::{LeftOut, Ringing};
pub use run::{Failed, Timing};
pub use selection::Selection;
pub use sweep::{Measured, Row};
pub use table::{ERROR_IS_BOUND, INTERRUPTED, REFERENCE_ERROR, table};
pub use transfer_trial::NoSwitch;
pub use verification::{Trial, Variation};

/// The request of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// Models, integrators, steps and meshes.
    pub selection: Selection,
    /// The outputs whose errors count.
    pub outputs: Vec<OutputGroup>,
    /// Simulated duration; the scene's usual one if not given.
    pub until_s: Option<f64>,
    /// Time to spend, s.
    pub budget_s: f64,
    /// Error below which nothing is of use.
    pub enough: Option<f64>,
}

impl Question {
    /// The instants at which the runs of a scene are compared.
    ///
    /// # Errors
    /// [`NoCommonInterval`] if the steps have none in common.
    pub fn grid(&self, scene: &Scene) -> Result<Grid, NoCommonInterval> {
        let steps_s = descending(&self.selection.steps_s);
        let until_s = self.until_s.unwrap_or_else(|| usual_until_s(scene));
        Grid::new(until_s, (!steps_s.is_empty()).then_some(&steps_s))
    }
}

/// The result of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The outputs whose errors count.
    pub outputs: Vec<OutputGroup>,
    /// Whether the chain ends in a slider.
    pub has_slider: bool,
    /// Instants at which runs are compared.
    pub grid: Grid,
    /// The reference.
    pub reference: Reference,
    /// Every configuration that was run, family by family, from the longest step on.
    pub rows: Vec<Row>,
    /// Configurations left out because of the budget.
    pub left_out: usize,
    /// Families of which nothing was measured, because the others took the budget: a cheaper setting may be among them.
    pub not_begun: Vec<Family>,
    /// The budget, s.
    pub budget_s: f64,
    /// Whether the clock ran out, so that another run may compute more or less.
    pub cut_short: bool,
    /// Whether it was interrupted, so that the rows are a part.
    pub interrupted: bool,
}

/// Progress of a study.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Families done.
    pub done: usize,
    /// Families to do.
    pub of: usize,
    /// The configuration that runs now.
    pub running: &'a Configuration,
    /// Whether that is the reference.
    pub reference: bool,
}

/// Why there is no study.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TradeError {
    /// The scene is an oscillator.
    #[error("the scene is an [oscillator]: it has one model, and its exact solution beside it; there is nothing to trade")]
    Oscillator,
    /// The steps asked for have no instants in common.
    #[error(transparent)]
    Steps(#[from] NoCommonInterval),
    /// No requested configuration suits the scene.
    #[error("none of the models and integrators asked for suits this scene{}", way_on(suited, *explicit))]
    Nothing {
        /// Models that suit it with these integrators: those asked for, or else others.
        suited: Vec<(ModelKind, Vec<IntegratorKind>)>,
        /// Whether a model asked for takes `runge-kutta`, which was asked for, too: shorter steps suit that.
        explicit: bool,
    },
    /// Nothing moves, so that every setting is as good.
    #[error(
        "nothing moves in this scene within {until_s} s, and settings that compute nothing are all alike: give it a pulse, a torque, \
         a start rate or a [drive] like those that it will have, or a longer --until if they come later"
    )]
    Still {
        /// Simulated duration, s.
        until_s: f64,
    },
    /// There is no reference.
    #[error("no reference: {0}")]
    NoReference(NoReference),
}

/// Part of the budget that one run of the reference may take, nominally.
const REFERENCE_PART: f64 = 0.15;
/// Steps in a period of a vibration from which on errors fall with the step.
const LEAST_STEPS: f64 = 12.0;
/// Elements a link with which the lowest frequency is found.
const BENDING_ELEMENTS: usize = 4;
/// Agreement required of the reference if no accuracy is requested.
const FINE: f64 = 1e-7;

/// Runs the study. `progress` is called before every run; [`ControlFlow::Break`] ends the study with the rows so far.
///
/// # Errors
/// [`TradeError`] when the scene or the question leaves nothing to measure.
pub fn study(
    scene: &Scene,
    question: &Question,
    progress: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Study, TradeError> {
    let begin = Instant::now();
    let chain = scene.chain().ok_or(TradeError::Oscillator)?;
    let steps_s = descending(&question.selection.steps_s);
    let grid = question.grid(scene)?;
    let families = question.selection.families(scene, question.enough);
    if families.is_empty() {
        return Err(nothing(scene, question));
    }
    let target = question.enough.unwrap_or(FINE) / WELL_RESOLVED;
    let mut interrupted = false;
    let mut telling = |running: &Configuration| {
        interrupted |= progress(Progress { done: 0, of: families.len(), running, reference: true }).is_break();
    };
    let wanted = (question.outputs.as_slice(), target);
    let reference = Reference::converge(scene, chain, &grid, wanted, REFERENCE_PART * question.budget_s, &mut telling)
        .map_err(TradeError::NoReference)?;
    if reference.stands_still(chain) {
        return Err(TradeError::Still { until_s: grid.until_s() });
    }
    let mut sweep = sweep::Sweep {
        scene,
        grid: &grid,
        reference: &reference,
        outputs: &question.outputs,
        prune: steps_s.is_empty(),
        resolving_step_s: resolving_step_s(scene, &reference.configuration),
        steps_s: if steps_s.is_empty() { grid.usual_steps_s() } else { steps_s },
        enough: question.enough.unwrap_or(0.0),
        budget_s: (1.0 - 2.0 * REFERENCE_PART) * question.budget_s,
        rows: Vec::new(),
        left_out: 0,
        not_begun: Vec::new(),
        spent_s: 0.0,
    };
    let expired = || begin.elapsed().as_secs_f64() > question.budget_s;
    for (done, family) in families.iter().enumerate() {
        if interrupted {
            break;
        }
        let mut telling = |running: &Configuration| {
            let flow = progress(Progress { done, of: families.len(), running, reference: false });
            interrupted |= flow.is_break();
            flow
        };
        sweep.family(family, &expired, &mut telling);
    }
    let (mut rows, left_out, not_begun) = (sweep.rows, sweep.left_out, sweep.not_begun);
    mark(&mut rows);
    let cut_short = expired() || reference.cut_short;
    let (outputs, has_slider) = (question.outputs.clone(), matches!(chain.end, End::Slider(_)));
    let budget_s = question.budget_s;
    Ok(Study { outputs, has_slider, grid, rows, left_out, not_begun, budget_s, cut_short, interrupted, reference })
}

/// The refusal of a question that leaves no configuration, with those that the scene would have.
fn nothing(scene: &Scene, question: &Question) -> TradeError {
    let asked = &question.selection;
    let own = Selection { integrators: Vec::new(), ..asked.clone() };
    let any = Selection { models: Vec::new(), ..own.clone() };
    let pairs = |selection: &Selection| suited_pairs(&selection.families(scene, question.enough));
    let suited = Some(pairs(&own)).filter(|own| !own.is_empty()).unwrap_or_else(|| pairs(&any));
    let with_runge_kutta = |(model, _): &(ModelKind, Vec<IntegratorKind>)| {
        (asked.models.is_empty() || asked.models.contains(model)) && model.integrators().contains(&IntegratorKind::RungeKutta)
    };
    let explicit = asked.integrators.contains(&IntegratorKind::RungeKutta) && suited.iter().any(with_runge_kutta);
    TradeError::Nothing { suited, explicit }
}

/// The models of families, with the integrators of each, in order.
fn suited_pairs(families: &[Family]) -> Vec<(ModelKind, Vec<IntegratorKind>)> {
    let mut pairs: Vec<(ModelKind, Vec<IntegratorKind>)> = Vec::new();
    for Family { model, integrator, .. } in families {
        match pairs.iter_mut().find(|(known, _)| known == model) {
            Some((_, integrators)) if integrators.contains(integrator) => {}
            Some((_, integrators)) => integrators.push(*integrator),
            None => pairs.push((*model, vec![*integrator])),
        }
    }
    pairs
}

/// The end of a refusal: what suits the scene.
fn way_on(suited: &[(ModelKind, Vec<IntegratorKind>)], explicit: bool) -> String {
    let takes = |(model, integrators): &(ModelKind, Vec<IntegratorKind>)| {
        let words: Vec<&str> = integrators.iter().map(|integrator| integrator.as_str()).collect();
        format!("{} takes {}", model.as_str(), words.join(", "))
    };
    let mut parts: Vec<String> = suited.iter().map(takes).collect();
    if explicit {
        parts.push("runge-kutta needs shorter --steps".to_owned());
    }
    if parts.is_empty() { String::new() } else { format!(": {}", parts.join("; ")) }
}

impl Study {
    /// The word for an output of this study: that of the command line, but `tip` where the chain has no slider.
    pub fn word(&self, output: OutputGroup) -> &'static str {
        match output {
            OutputGroup::Slider if !self.has_slider => "tip",
            _ => output.as_str(),
        }
    }

    /// The configurations on the front, cheapest first.
    pub fn front(&self) -> Vec<(&Row, &Measured)> {
        let mut front: Vec<_> = self.measured().filter(|(_, measured)| measured.on_front).collect();
        front.sort_by(|a, b| a.1.timing.seconds_per_s.total_cmp(&b.1.timing.seconds_per_s));
        front
    }

    /// The configurations that ran to their end.
    pub fn measured(&self) -> impl Iterator<Item = (&Row, &Measured)> {
        self.rows.iter().filter_map(|row| Some((row, row.outcome.as_ref().ok()?)))
    }
}

/// The longest step with [`LEAST_STEPS`] in a period of the lowest frequency at which a link bends, s; infinite if none does, or if
/// frequencies are not found.
fn resolving_step_s(scene: &Scene, reference: &Configuration) -> f64 {
    let family = Family { resolution: BENDING_ELEMENTS, ..reference.family.clone() };
    let found = Vibrations::of_scene(&family.scene(scene, reference.step_s)).ok().flatten();
    let lowest_hz = found.and_then(|vibrations| vibrations.lowest_bending_hz);
    lowest_hz.map_or(f64::INFINITY, |hz| 1.0 / (LEAST_STEPS * hz))
}

/// Marks the front.
fn mark(rows: &mut [Row]) {
    let point = |row: &Row| {
        let measured = row.outcome.as_ref().map(|measured| [measured.timing.seconds_per_s, measured.error]);
        measured.unwrap_or([f64::INFINITY; 2])
    };
    let points: Vec<[f64; 2]> = rows.iter().map(point).collect();
    for (row, on_front) in rows.iter_mut().zip(front(&points)) {
        if let Ok(measured) = &mut row.outcome {
            measured.on_front = on_front;
        }
    }
}

fn descending(steps_s: &[f64]) -> Vec<f64> {
    let mut steps_s = steps_s.to_vec();
    steps_s.sort_by(|a, b| b.total_cmp(a));
    steps_s.dedup();
    steps_s
}
