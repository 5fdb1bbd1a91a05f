//! What everything is measured against: the finite-element model, refined until it agrees with itself.

use super::configuration::{Configuration, Family};
use super::errors::Errors;
use super::grid::Grid;
use super::output_group::{CHANNELS, OutputGroup, Sample, scales};
use super::run::{Effort, Failed, Run, run};
use crate::scene::{Chain, IntegratorKind, ModelKind, Scene};
use crate::simulation::BuildError;

/// Elements a link of the coarsest mesh; each refinement doubles them and quarters the step, as the orders 4 and 2 ask.
const ELEMENTS: usize = 8;
/// Steps in an interval at the coarsest.
const STEPS: f64 = 25.0;
/// What a refinement costs over the one before.
const DEARER: f64 = 8.0;
/// How much longer than its nominal share a run may be expected to take by the clock.
const SLOWER: f64 = 5.0;
/// Refinements at most.
const REFINEMENTS: u32 = 6;
/// Runs that are made whatever they take.
const LEAST: u32 = 2;
/// An error is told well when it is so many times what the reference is uncertain by.
pub const WELL_RESOLVED: f64 = 10.0;

/// A converged run and how far it is to be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The finest run.
    pub configuration: Configuration,
    /// How it differs from the refinement before: the estimate of its error.
    pub estimate: Errors,
    /// Work of the finest run.
    pub effort: Effort,
    /// Whether the clock forbade a refinement that the nominal cost allowed: another run may get further.
    pub cut_short: bool,
    pub(super) samples: Vec<Sample>,
    pub(super) scales: [f64; CHANNELS.len()],
}

impl Reference {
    /// Refines until two successive runs agree to `target` in `outputs`, or the next would take more than `share_s`: nominally, so
    /// that the reference is the same from run to run, or, on a slow or busy machine, by what the last took by the clock.
    ///
    /// # Errors
    /// [`Failed`] when the finite-element model cannot run the scene even twice.
    pub(super) fn converge(
        scene: &Scene,
        chain: &Chain,
        grid: &Grid,
        wanted: (&[OutputGroup], f64),
        share_s: f64,
        progress: &mut dyn FnMut(&Configuration),
    ) -> Result<Self, Failed> {
        let (outputs, target) = wanted;
        let (mut best, mut last): (Option<Reference>, Option<Vec<Sample>>) = (None, None);
        let mut last_s = 0.0;
        let mut failure = Failed::from(BuildError { model: "finite-element", why: "the budget leaves no time for it".into() });
        for k in 0..=REFINEMENTS {
            let configuration = level(chain, grid, k);
            if k >= LEAST && nominal_s(&configuration, grid) > share_s {
                break;
            }
            if k >= LEAST && DEARER * last_s > SLOWER * share_s {
                best.iter_mut().for_each(|best| best.cut_short = true);
                break;
            }
            progress(&configuration);
            let run = match run(&configuration, scene, grid) {
                Ok((run, seconds)) => {
                    last_s = seconds;
                    run
                }
                // Where a coarse start fails a finer one may not.
                Err(failed) => {
                    failure = failed;
                    continue;
                }
            };
            let scales = scales(chain, &run.samples);
            let estimate = last.replace(run.samples.clone()).map(|last| Errors::between(&last, &run.samples, &scales));
            let Some(estimate) = estimate else { continue };
            let agreed = estimate.worst(outputs) <= target;
            best =
                Some(Reference { configuration, estimate, effort: run.effort, cut_short: false, samples: run.samples, scales });
            if agreed {
                break;
            }
        }
        best.ok_or(failure)
    }

    /// The errors of another run.
    pub(super) fn errors(&self, run: &Run) -> Errors {
        Errors { energy: run.energy_error, ..Errors::between(&run.samples, &self.samples, &self.scales) }
    }

    /// An error as it may be told: not below what the reference is uncertain by.
    pub fn told(&self, errors: &Errors, outputs: &[OutputGroup]) -> f64 {
        outputs.iter().map(|output| errors.of(*output).max(self.estimate.of(*output))).fold(0.0, f64::max)
    }
}

fn level(chain: &Chain, grid: &Grid, k: u32) -> Configuration {
    let family = Family {
        model: ModelKind::FiniteElement,
        integrator: IntegratorKind::GeneralizedAlpha,
        resolution: ELEMENTS << k,
        rigid: chain.links.iter().map(|link| link.rigid).collect(),
    };
    Configuration { family, step_s: grid.interval_s / (STEPS * 4_f64.powi(k as i32)) }
}

/// Seconds that a run takes on a usual machine, roughly.
pub(super) fn nominal_s(configuration: &Configuration, grid: &Grid) -> f64 {
    1e-6 * configuration.family.nominal_step_us() * grid.until_s() / configuration.step_s
}
