//! Links and base springs that ring faster than a reference's step resolves.

use std::f64::consts::TAU;

use super::configuration::{Configuration, Family, frequency, is_rigid, rigid_links};
use super::errors::Errors;
use super::grid::{Grid, tidy};
use super::output_group::{OutputGroup, Sample, scales};
use super::reference::{self, nominal_s, refinement};
use super::run::run;
use super::{LEAST_STEPS, REFERENCE_PART};
use crate::scene::{Chain, IntegratorKind, Link, ModelKind, Scene};
use crate::small_motion::{NormalMode, NormalModes, Part};

/// Elements a link of the runs that show whether links ring: the lowest bending of each is right within a thousandth.
const ELEMENTS: usize = 4;
/// Part of the time of a reference's finest run that the finer of these runs may take.
const PART: f64 = 0.5;
/// A ringing of less than this is left out for a finer mesh: the coarsest that resolves it is no better known.
const NOTICEABLE: f64 = 1e-4;

/// Modes of a flexible second link beside which a rigid first one vibrates on the base spring, and the least part of a mode's strain
/// energy in that spring.
const BASE_MODES: usize = 4;
const BASE_SHARE: f64 = 0.1;

/// The longest step of a reference, and the vibrations that it leaves out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LongestStep {
    /// The step, s.
    pub step_s: f64,
    left_out: Option<LeftOut>,
    /// The run of a coarse mesh that resolves them, if there was time for it.
    resolved: Option<Vec<Sample>>,
}

/// Vibrations that the steps of a reference leave out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// The part that vibrates; where both do, the base.
    pub part: Ringing,
    /// Their frequency, Hz: the highest among the lowest bending frequencies of the links and that of the base.
    pub hz: f64,
    /// The error of steps that leave them out, on a coarse mesh; `None` if finding out takes too long, or a run for it fails.
    pub errors: Option<Errors>,
    /// Whether a link bends.
    bends: bool,
    /// Whether a reference that resolves them is better, if there is time for it.
    pub counts: bool,
    /// Time budget of a study whose reference resolves them, s; of one that finds their part, where there is no time for that.
    pub budget_s: f64,
}

/// Parts that may ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ringing {
    /// A link, bending between its pins.
    Link,
    /// A rigid first link on the base spring.
    Base,
}

impl LeftOut {
    /// Whether a step resolves them.
    pub(super) fn is_resolved_by(&self, step_s: f64) -> bool {
        step_s * LEAST_STEPS * self.hz <= 1.0
    }

    /// Their part in the outputs, or what they could change where it is unknown.
    pub(super) fn part(&self) -> Errors {
        self.errors.unwrap_or_else(|| Errors::of_unknown(self.part, self.bends))
    }
}

impl LongestStep {
    /// `usual_s`, unless links ring in periods that it does not resolve and that change the `outputs` noticeably, and by more than
    /// `target`: then one with [`LEAST_STEPS`] in the period, if a reference of such steps takes no more than `share_s`.
    ///
    /// Two refinements of a reference do not show a vibration that neither resolves: they are alike, and both wrong. So two runs of a
    /// coarse mesh are compared, one of which resolves the lowest bending of every link between pins, `(π/l)² √(EJ/ρA)`, and a rigid
    /// first link on its base spring. They are made only where the usual step does not. Other vibrations are not looked for: on a
    /// stiff base spring, a flexible first link bends as if clamped, more slowly than between pins.
    pub fn find(
        scene: &Scene,
        chain: &Chain,
        grid: &Grid,
        usual_s: f64,
        ((outputs, target), share_s): ((&[OutputGroup], f64), f64),
        progress: &mut dyn FnMut(&Configuration),
    ) -> Self {
        let bending_hz = chain.links.iter().filter(|link| !is_rigid(link)).filter_map(swinging).fold(0.0, f64::max) / TAU;
        let base_hz = base_hz(scene, chain);
        let hz = bending_hz.max(base_hz);
        let part = if usual_s * LEAST_STEPS * base_hz > 1.0 { Ringing::Base } else { Ringing::Link };
        let halvings = (usual_s * LEAST_STEPS * hz).log2().ceil();
        if halvings <= 0.0 {
            return LongestStep { step_s: usual_s, left_out: None, resolved: None };
        }
        // Halved steps meet the instants, too.
        let resolving_s = tidy(usual_s / halvings.exp2());
        let [usual, resolving] = [usual_s, resolving_s].map(|step_s| refinement(chain, ELEMENTS, step_s));
        let mut samples = |configuration: &Configuration| {
            progress(configuration);
            run(configuration, scene, grid).ok().map(|(run, _)| run.samples)
        };
        let finding_s = nominal_s(&resolving, grid) / PART;
        let is_quick = finding_s <= share_s;
        let (without, resolved) = if is_quick { (samples(&usual), samples(&resolving)) } else { (None, None) };
        let errors = without.zip(resolved.as_ref()).map(|(without, with)| Errors::between(&without, with, &scales(chain, with)));
        let needed_s = nominal_s(&refinement(chain, 2 * reference::ELEMENTS, resolving_s / 2.0), grid);
        let counts = errors.is_none_or(|errors| errors.worst(outputs) > target.max(NOTICEABLE));
        if counts && needed_s <= share_s {
            return LongestStep { step_s: resolving_s, left_out: None, resolved: None };
        }
        let budget_s = if is_quick { needed_s } else { finding_s } / REFERENCE_PART;
        let bends = chain.links.iter().any(|link| !is_rigid(link));
        let left_out = LeftOut { part, hz, errors, bends, counts, budget_s };
        LongestStep { step_s: usual_s, left_out: Some(left_out), resolved }
    }

    /// What steps of `step_s` leave out; `None` if they resolve it. The longest steps may miss slower vibrations, too, which these do not:
    /// so these are compared anew, on the coarse mesh.
    pub fn left_out_by(
        &self,
        step_s: f64,
        (scene, chain, grid): (&Scene, &Chain, &Grid),
        (outputs, target): (&[OutputGroup], f64),
        progress: &mut dyn FnMut(&Configuration),
    ) -> Option<LeftOut> {
        let left_out = self.left_out.filter(|left_out| !left_out.is_resolved_by(step_s))?;
        let Some(with) = self.resolved.as_ref().filter(|_| step_s != self.step_s) else { return Some(left_out) };
        let configuration = refinement(chain, ELEMENTS, step_s);
        progress(&configuration);
        let Ok((without, _)) = run(&configuration, scene, grid) else { return Some(left_out) };
        let errors = Errors::between(&without.samples, with, &scales(chain, with));
        let counts = errors.worst(outputs) > target.max(NOTICEABLE);
        Some(LeftOut { errors: Some(errors), counts, ..left_out })
    }
}

/// The frequency of a link's bending between its pins, rad/s; `None` if that is damped beyond critical, `½ ω damping_s ≥ 1`.
fn swinging(link: &Link) -> Option<f64> {
    frequency(link).filter(|omega| 0.5 * omega * link.damping_s < 1.0)
}

/// The highest frequency at which a rigid first link vibrates on the base spring, by `modal` with a few modes of a second link that is
/// flexible, Hz; 0 if there is none.
fn base_hz(scene: &Scene, chain: &Chain) -> f64 {
    if chain.base.torsion_spring_nm_per_rad == 0.0 || !chain.links.first().is_some_and(is_rigid) {
        return 0.0;
    }
    let modal = Family {
        model: ModelKind::Modal,
        integrator: IntegratorKind::Esdirk,
        resolution: BASE_MODES,
        rigid: rigid_links(chain),
        axial: vec![false; chain.links.len()],
    };
    let found = NormalModes::new(&modal.scene(scene, scene.solver.step_s), chain.start.angle_rad, 2 * BASE_MODES);
    let found = found.map(|found| found.modes().to_vec()).unwrap_or_default();
    let strains_base =
        |mode: &&NormalMode| mode.mode.shares.iter().any(|share| share.part == Part::Base && share.share > BASE_SHARE);
    found.iter().filter(strains_base).map(NormalMode::frequency_hz).fold(0.0, f64::max)
}
