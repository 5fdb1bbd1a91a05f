//! Links that ring faster than a reference's step resolves.

use std::f64::consts::TAU;

use super::configuration::{Configuration, frequency};
use super::errors::Errors;
use super::grid::{Grid, tidy};
use super::output_group::{OutputGroup, scales};
use super::reference::{self, nominal_s, refinement};
use super::run::run;
use super::{LEAST_STEPS, REFERENCE_PART};
use crate::scene::{Chain, Scene};

/// Elements a link of the runs that show whether links ring: the lowest bending of each is right within a thousandth.
const ELEMENTS: usize = 4;
/// Part of the time of a reference's finest run that the finer of these runs may take.
const PART: f64 = 0.5;
/// A ringing of less than this is left out for a finer mesh: the coarsest that resolves it is no better known.
const NOTICEABLE: f64 = 1e-4;

/// The longest step of a reference, and the vibrations that it leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LongestStep {
    /// The step, s.
    pub step_s: f64,
    pub left_out: Option<LeftOut>,
}

/// Vibrations that the steps of a reference leave out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Their frequency: the highest among the lowest bending frequencies of the links, Hz.
    pub hz: f64,
    /// Their part in the run; `None` if finding out takes too long, or a run for it fails.
    pub errors: Option<Errors>,
    /// Whether a reference that resolves them is better, if there is time for it.
    pub counts: bool,
    /// Time budget of a study whose reference resolves them, s.
    pub budget_s: f64,
}

impl LongestStep {
    /// `usual_s`, unless links ring in periods that it does not resolve and that change the `outputs` noticeably, and by more than
    /// `target`: then one with [`LEAST_STEPS`] in the period, if a reference of such steps takes no more than `share_s`.
    ///
    /// Two refinements of a reference do not show a vibration that neither resolves: they are alike, and both wrong. So two runs of a
    /// coarse mesh are compared, one of which resolves the lowest bending of every link between pins, `(π/l)² √(EJ/ρA)`. They are
    /// made only where the usual step does not. Other vibrations, as of a stiff base spring, are not looked for.
    pub fn find(
        scene: &Scene,
        chain: &Chain,
        grid: &Grid,
        usual_s: f64,
        ((outputs, target), share_s): ((&[OutputGroup], f64), f64),
        progress: &mut dyn FnMut(&Configuration),
    ) -> Self {
        let hz = chain.links.iter().filter(|link| !link.rigid).filter_map(frequency).fold(0.0, f64::max) / TAU;
        let halvings = (usual_s * LEAST_STEPS * hz).log2().ceil();
        if halvings <= 0.0 {
            return LongestStep { step_s: usual_s, left_out: None };
        }
        // Halved steps meet the instants, too.
        let resolving_s = tidy(usual_s / halvings.exp2());
        let [usual, resolving] = [usual_s, resolving_s].map(|step_s| refinement(chain, ELEMENTS, step_s));
        let mut samples = |configuration: &Configuration| {
            progress(configuration);
            run(configuration, scene, grid).ok().map(|(run, _)| run.samples)
        };
        let is_quick = nominal_s(&resolving, grid) <= PART * share_s;
        let errors = if is_quick {
            let (without, with) = (samples(&usual), samples(&resolving));
            without.zip(with).map(|(without, with)| Errors::between(&without, &with, &scales(chain, &with)))
        } else {
            None
        };
        let needed_s = nominal_s(&refinement(chain, 2 * reference::ELEMENTS, resolving_s / 2.0), grid);
        let counts = errors.is_none_or(|errors| errors.worst(outputs) > target.max(NOTICEABLE));
        if counts && needed_s <= share_s {
            return LongestStep { step_s: resolving_s, left_out: None };
        }
        let left_out = LeftOut { hz, errors, counts, budget_s: needed_s / REFERENCE_PART };
        LongestStep { step_s: usual_s, left_out: Some(left_out) }
    }
}
