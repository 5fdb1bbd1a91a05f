//! The reference of all measurements: the finite-element model, refined until it agrees with itself.

use std::fmt;

use super::REFERENCE_PART;
use super::configuration::{Configuration, Family, OUTPUT_INTERVALS, rigid_links};
use super::effort::RunEffort;
use super::errors::Errors;
use super::grid::{Grid, tidy};
use super::output_group::{CHANNELS, OutputGroup, Sample, scales};
use super::ringing::{LeftOut, LongestStep};
use super::run::{Failed, Run, run};
use crate::scene::{Chain, IntegratorKind, ModelKind, Scene};
use crate::simulation::BuildError;

/// Elements per link of the coarsest mesh; each refinement doubles them and halves the step, as both are of fourth order.
pub(super) const ELEMENTS: usize = 8;
/// Steps in an interval at the coarsest, unless links ring faster.
const STEPS: f64 = 25.0;
/// Cost ratios of successive refinements: of steps and mesh, and of steps alone, where no link bends.
const DEARER: f64 = 4.0;
const DEARER_BY_STEPS: f64 = 2.0;
/// Largest expected ratio of a run's time to its nominal share.
const SLOWER: f64 = 5.0;
/// Largest number of refinements.
const REFINEMENTS: u32 = 6;
/// Factor by which a refinement is expected to reduce the uncertainty: half of what the orders promise, as errors do not fall
/// evenly.
const GAIN: f64 = 8.0;
/// A refinement that reduced it by less tells that errors do not fall as the orders promise, or not yet.
const LEAST_GAIN: f64 = 4.0;
/// Number of runs that are made regardless of cost.
const LEAST: u32 = 2;
/// An error is well resolved if it exceeds the reference's uncertainty by this factor.
pub const WELL_RESOLVED: f64 = 10.0;
/// An angle or place that changes by less stands still: in rad, or as a part of the links' length.
const STILL: f64 = 1e-10;
/// The mark of an error below the reference's own uncertainty.
pub(super) const BOUND: &str = "<";

/// A time budget that refines a reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinerBudget {
    /// The budget, s.
    pub budget_s: f64,
    /// Whether it should refine it so far as is asked. Else, this is not known: no refinement has shown yet how much one gains, or the
    /// last one gained little.
    pub is_likely: bool,
}

impl FinerBudget {
    /// The budget in whole minutes, as `--budget` takes it.
    pub(super) fn minutes(&self) -> f64 {
        (self.budget_s / 60.0).ceil()
    }
}

/// A converged run with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The finest run.
    pub configuration: Configuration,
    /// Difference from the previous refinement, and the part of vibrations that its steps leave out: the estimate of its error.
    pub estimate: Errors,
    /// Vibrations that its first steps do not resolve, and that may count.
    pub left_out: Option<LeftOut>,
    /// Work of the finest run.
    pub effort: RunEffort,
    /// Whether the clock prevented a refinement that the nominal cost allowed: another run may refine further.
    pub cut_short: bool,
    /// Time budget of a study that refines it once more, s; `None` if no study does.
    pub finer_budget_s: Option<f64>,
    /// Number of times that its steps were halved.
    pub refined: u32,
    /// Factor by which the last refinement reduced the difference; `None` of the first.
    pub gain: Option<f64>,
    pub(super) samples: Vec<Sample>,
    pub(super) scales: [f64; CHANNELS.len()],
}

/// There is no reference: the finite-element model does not run the scene twice.
#[derive(Debug, Clone, PartialEq)]
pub struct NoReference {
    /// The instants, from which the steps of the reference follow.
    grid: Grid,
    /// Step of the first run, s.
    first_s: f64,
    /// Step of the last run that failed, s.
    step_s: f64,
    /// Whether the budget prevents shorter steps.
    is_out_of_budget: bool,
    /// Why that run failed.
    failed: Failed,
}

impl fmt::Display for NoReference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NoReference { grid, first_s, step_s, is_out_of_budget, failed } = self;
        if let Failed::Build(refused) = failed {
            return write!(f, "{refused}");
        }
        let (origin, remedy) = match (grid.has_few_instants(), *is_out_of_budget) {
            (true, _) => (" that follows from --steps", "; try shorter --steps, which are in seconds without a unit"),
            (false, true) => ("", "; try a longer --budget, which allows shorter steps"),
            (false, false) => ("", ""),
        };
        if step_s == first_s {
            return write!(f, "the finite-element model fails at a step of {first_s:e} s{origin}{remedy}: {failed}");
        }
        write!(
            f,
            "the finite-element model, refined from a step of {first_s:e} s{origin}, still fails at {step_s:e} s{remedy}: \
             {failed}"
        )
    }
}

impl Reference {
    /// Refines until two successive runs agree to `target` in `outputs`, or the next would take more than `share_s`. Cost is
    /// nominal, so that the reference is the same from run to run; on a slow or busy machine, the time of the last run counts
    /// too.
    ///
    /// # Errors
    /// [`NoReference`] if the finite-element model cannot run the scene even twice.
    pub(super) fn converge(
        scene: &Scene,
        chain: &Chain,
        grid: &Grid,
        wanted: (&[OutputGroup], f64),
        share_s: f64,
        progress: &mut dyn FnMut(&Configuration),
    ) -> Result<Self, NoReference> {
        let (outputs, target) = wanted;
        let (mut best, mut last): (Option<Reference>, Option<Vec<Sample>>) = (None, None);
        let mut last_difference = None;
        let mut last_s = 0.0;
        let untried = BuildError { key: "solver", model: "finite-element", why: "the budget leaves no time for it".into() };
        let longest = LongestStep::find(scene, chain, grid, tidy(grid.interval_s / STEPS), (wanted, share_s), progress);
        let left_out_by = |step_s: f64, progress: &mut dyn FnMut(&Configuration)| {
            longest.left_out_by(step_s, (scene, chain, grid), wanted, progress)
        };
        let first_s = longest.step_s;
        let (mut step_s, mut failed, mut is_out_of_budget) = (first_s, Failed::from(untried), false);
        for k in 0..=REFINEMENTS {
            let configuration = refinement(chain, ELEMENTS << k, tidy(first_s / f64::from(1 << k)));
            // The share that a refinement needs by its nominal cost, and by the time of the last run.
            let needed_s = [nominal_s(&configuration, grid), dearer(&configuration) * last_s / SLOWER];
            if k >= LEAST && needed_s.iter().any(|needed_s| *needed_s > share_s) {
                if let Some(best) = &mut best {
                    best.cut_short = needed_s[0] <= share_s;
                    best.finer_budget_s = Some(needed_s[0].max(needed_s[1]) / REFERENCE_PART);
                }
                is_out_of_budget = true;
                break;
            }
            progress(&configuration);
            let run = match run(&configuration, scene, grid) {
                Ok((run, seconds)) => {
                    last_s = seconds;
                    run
                }
                // A finer step may succeed where a coarse one fails.
                Err(failure) => {
                    (step_s, failed) = (configuration.step_s, failure);
                    continue;
                }
            };
            let scales = scales(chain, &run.samples);
            let estimate = last.replace(run.samples.clone()).map(|last| Errors::between(&last, &run.samples, &scales));
            let Some(estimate) = estimate else { continue };
            let difference = estimate.worst(outputs);
            // Runs may agree that leave out the same vibration.
            let left_out = if difference <= target { left_out_by(configuration.step_s, progress) } else { None };
            let agreed = difference <= target && left_out.is_none_or(|left_out| left_out.part().worst(outputs) <= target);
            let gain = last_difference.replace(difference).map(|last: f64| last / difference);
            let (effort, samples) = (run.effort, run.samples);
            let (cut_short, finer_budget_s, refined) = (false, None, k);
            best = Some(Reference {
                configuration,
                estimate,
                left_out,
                effort,
                cut_short,
                finer_budget_s,
                refined,
                gain,
                samples,
                scales,
            });
            if agreed {
                break;
            }
        }
        let best = best.ok_or(NoReference { grid: *grid, first_s, step_s, is_out_of_budget, failed })?;
        // Where the finest run resolves them, its difference from the one before shows them.
        Ok(match best.left_out.or_else(|| left_out_by(best.configuration.step_s, progress)) {
            Some(left_out) => best.without(left_out),
            None => best,
        })
    }

    /// Takes account of vibrations that the steps leave out; where their part is unknown, by what they could change.
    fn without(self, left_out: LeftOut) -> Self {
        Reference { estimate: self.estimate.or_larger(&left_out.part()), left_out: Some(left_out), ..self }
    }

    /// Whether nothing moves: no angle, place or deflection changes by more than rounding. Forces may be there, as of weight. One instant
    /// does not tell.
    pub(super) fn stands_still(&self, chain: &Chain) -> bool {
        let length_m: f64 = chain.links.iter().map(|link| link.length_m).sum();
        let sizes = [1.0, length_m, length_m, length_m];
        let Some(first) = self.samples.first() else { return true };
        let far = |sample: &Sample, k: usize| (sample[k][0] - first[k][0]).hypot(sample[k][1] - first[k][1]);
        let moves = |k: usize| self.samples.iter().any(|sample| far(sample, k) > STILL * sizes[k]);
        self.samples.len() > 1 && !(0..sizes.len()).any(moves)
    }

    /// Errors of another run against the reference.
    pub(super) fn errors(&self, run: &Run) -> Errors {
        Errors { energy: run.energy_error, ..Errors::between(&run.samples, &self.samples, &self.scales) }
    }

    /// An error to report: at least the reference's own uncertainty.
    pub fn bounded_error(&self, errors: &Errors, outputs: &[OutputGroup]) -> f64 {
        outputs.iter().map(|output| errors.of(*output).max(self.estimate.of(*output))).fold(0.0, f64::max)
    }

    /// The mark of the error of one output: `<` below the reference's own uncertainty, `~` less than ten times as large, else none.
    pub fn mark(&self, errors: &Errors, output: OutputGroup) -> &'static str {
        match (errors.of(output), self.estimate.of(output)) {
            (error, estimate) if error < estimate => BOUND,
            (error, estimate) if error < WELL_RESOLVED * estimate => "~",
            _ => "",
        }
    }

    /// The mark of [`Reference::bounded_error`]: that of the output with the largest.
    pub(super) fn bounded_mark(&self, errors: &Errors, outputs: &[OutputGroup]) -> &'static str {
        self.bounded_output(errors, outputs).map_or("", |output| self.mark(errors, output))
    }

    /// The reference's own uncertainty in the output of [`Reference::bounded_error`].
    pub(super) fn bounded_uncertainty(&self, errors: &Errors, outputs: &[OutputGroup]) -> f64 {
        self.bounded_output(errors, outputs).map_or(0.0, |output| self.estimate.of(output))
    }

    fn bounded_output(&self, errors: &Errors, outputs: &[OutputGroup]) -> Option<OutputGroup> {
        largest(outputs, |output| self.bounded_error(errors, &[output])).map(|(output, _)| output)
    }

    /// The part of an error that is certain: all of it if it is well resolved, else what exceeds the reference's own uncertainty.
    pub(super) fn certain_error(&self, errors: &Errors, output: OutputGroup) -> f64 {
        match (errors.of(output), self.estimate.of(output)) {
            (error, estimate) if error < WELL_RESOLVED * estimate => (error - estimate).max(0.0),
            (error, _) => error,
        }
    }

    /// Time budget of a study that is expected to know the reference to `error` in `outputs`; `None` if no study refines it so far. One
    /// refinement at least.
    pub(super) fn sufficient_budget(&self, outputs: &[OutputGroup], error: f64) -> Option<FinerBudget> {
        if let Some(left_out) = self.left_out.filter(|left_out| left_out.counts || left_out.part().worst(outputs) > error) {
            let is_likely = left_out.errors.is_some() && self.gain.is_some_and(|gain| gain >= LEAST_GAIN);
            return Some(FinerBudget { budget_s: left_out.budget_s, is_likely });
        }
        let refinements = match self.gain {
            Some(gain) if gain < LEAST_GAIN => 1.0,
            _ => (self.estimate.worst(outputs) / error).log(GAIN).ceil().max(1.0),
        };
        let is_possible = f64::from(self.refined) + refinements <= f64::from(REFINEMENTS);
        let is_likely = self.gain.is_some_and(|gain| gain >= LEAST_GAIN);
        let budget_s = self.finer_budget_s.filter(|_| is_possible)? * dearer(&self.configuration).powf(refinements - 1.0);
        Some(FinerBudget { budget_s, is_likely })
    }
}

/// The output with the largest value, and that.
pub(super) fn largest(outputs: &[OutputGroup], value: impl Fn(OutputGroup) -> f64) -> Option<(OutputGroup, f64)> {
    outputs.iter().map(|output| (*output, value(*output))).max_by(|one, other| one.1.total_cmp(&other.1))
}

/// Cost of the next refinement over that of this one.
fn dearer(configuration: &Configuration) -> f64 {
    if configuration.family.is_rigid() { DEARER_BY_STEPS } else { DEARER }
}

/// One run of a reference: all links flexible that are so in the scene, with so many elements each. If none is, there is one mesh.
pub(super) fn refinement(chain: &Chain, elements: usize, step_s: f64) -> Configuration {
    let rigid = rigid_links(chain);
    let family = Family {
        model: ModelKind::FiniteElement,
        integrator: IntegratorKind::Esdirk,
        resolution: if rigid.contains(&false) { elements } else { OUTPUT_INTERVALS },
        rigid,
        axial: chain.links.iter().map(|link| link.axial).collect(),
    };
    Configuration { family, step_s }
}

/// Approximate run time on a typical machine, s.
pub(super) fn nominal_s(configuration: &Configuration, grid: &Grid) -> f64 {
    1e-6 * configuration.family.nominal_step_us() * grid.until_s() / configuration.step_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    #[test]
    fn regress_the_largest_error_bears_the_mark_of_its_output() {
        let source = SceneSource::open("ref-r2s", &[]).unwrap();
        let errors = |[angle, slider]: [f64; 2]| {
            let mut relative = [0.0; CHANNELS.len()];
            [relative[0], relative[1]] = [angle, slider];
            Errors { rms: relative, max: relative, relative, energy: 0.0 }
        };
        let reference = Reference {
            configuration: refinement(source.scene.chain().unwrap(), 8, 1e-3),
            estimate: errors([1e-4, 1e-6]),
            left_out: None,
            effort: RunEffort::default(),
            cut_short: false,
            finer_budget_s: None,
            refined: 0,
            gain: None,
            samples: Vec::new(),
            scales: [1.0; CHANNELS.len()],
        };
        let compared = [OutputGroup::Angle, OutputGroup::Slider];
        for (error, bounded, mark) in
            [([5e-5, 5e-5], 1e-4, "<"), ([2e-4, 5e-5], 2e-4, "~"), ([2e-3, 5e-5], 2e-3, ""), ([5e-5, 5e-4], 5e-4, "")]
        {
            let errors = errors(error);
            assert_eq!(reference.bounded_error(&errors, &compared), bounded);
            assert_eq!(reference.bounded_mark(&errors, &compared), mark, "{error:?}");
        }
        assert_eq!(reference.mark(&errors([0.0; 2]), OutputGroup::Energy), "");
    }
}
