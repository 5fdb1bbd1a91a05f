//! Shortening of links by the axial forces of a run: `modal` leaves it out where a link is not `axial`.

use super::duration::usual_until_s;
use super::trade::STRAIGHT;
use crate::mechanics::LinkObservation;
use crate::scene::{End, IntegratorKind, Link, LinkName, ModelKind, Scene, System};
use crate::simulation::{BuildError, Diverged, Simulation};

/// A link that shortens by more than this part of its largest deflection had better be `axial`.
pub const MATTERS: f64 = 0.1;
/// A shortening below this part of the link's length does not matter, however little the link bends.
pub const NEGLIGIBLE: f64 = MATTERS * STRAIGHT;
/// A link that changes the slider's stroke by more than this part had better be `axial`, however much it bends. The speed under a torque
/// changes by up to twice that, a thousandth: about the error in a period that `check` grants a step.
pub const STROKE_MATTERS: f64 = 5e-4;
/// Most steps of the usual run.
const MOST_STEPS: f64 = 20_000.0;
/// Parts of a link between which deflections are looked at.
const PARTS: usize = 8;

/// The shortening of a link that its model leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shortening {
    /// The link.
    pub link: LinkName,
    /// Its length, m.
    pub length_m: f64,
    /// Largest axial force, mean over the length, N: positive in tension.
    pub force_n: f64,
    /// Size of the change of length by that force, `|N| L / (E A)`, m: shortening, or under tension stretch.
    pub shortening_m: f64,
    /// Largest deflection from the chord, m.
    pub deflection_m: f64,
    /// Length of the crank of a crank-slider, m; `None` for other mechanisms.
    pub crank_m: Option<f64>,
}

/// Why the shortening is not known.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoShortening {
    /// `modal` cannot compute the scene.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The run diverged.
    #[error(transparent)]
    Diverged(#[from] Diverged),
}

impl Shortening {
    /// Whether it is too large to leave out, beside the link's deflection or the slider's stroke. A link that bends by less than
    /// a millionth of its length counts as bent by that.
    pub fn matters(&self) -> bool {
        self.exceeds(MATTERS) || self.stroke_change().is_some_and(|change| change > STROKE_MATTERS)
    }

    /// Largest relative change of the slider's stroke; `None` without a slider.
    ///
    /// A crank of length r moves the slider nearly as `x = r cos ωt`. Its mass m needs the force `−m ω² x`, which lengthens the
    /// links by s at the outer dead centre, and shortens them by s at the inner one. So the slider moves by `r + s` to either side,
    /// and its stroke changes by the part `s/r`. Viscous friction takes a power that goes with the square of the slider's speed. At
    /// the same speed of the crank it grows by the part `2 s/r`. Under the same torque, the crank turns slower by that part. A force
    /// that does not change leaves the stroke as it is.
    pub fn stroke_change(&self) -> Option<f64> {
        self.crank_m.map(|crank_m| self.shortening_m / crank_m)
    }

    /// Whether it is more than this part of the deflection.
    pub fn exceeds(&self, part: f64) -> bool {
        self.shortening_m > part * self.deflection_m.max(STRAIGHT * self.length_m)
    }
}

/// The shortening of every flexible link that is not `axial`, over the usual duration of the scene, at most 20,000 steps.
///
/// # Errors
/// See [`shortenings_until`].
pub fn shortenings(scene: &Scene) -> Result<Vec<Shortening>, NoShortening> {
    shortenings_until(scene, usual_until_s(scene).min(MOST_STEPS * scene.solver.step_s))
}

/// The shortening of every flexible link that is not `axial`, until this simulated time. The scene is run with `modal` at its own
/// step, so that resistance, weight, pulses and inertia act as they will. The start is left out: there, a constant torque acts on links
/// that are not bent yet, and their forces grow with the number of modes.
///
/// # Errors
/// [`NoShortening`] if `modal` cannot run the scene.
pub fn shortenings_until(scene: &Scene, until_s: f64) -> Result<Vec<Shortening>, NoShortening> {
    let stiff = |link: &&Link| !link.rigid && !link.axial && link.bar.is_some();
    let Some(chain) = scene.chain().filter(|chain| chain.links.iter().any(|link| stiff(&link))) else { return Ok(Vec::new()) };
    let mut scene = scene.clone();
    if scene.solver.model != ModelKind::Modal {
        (scene.solver.model, scene.solver.integrator) = (ModelKind::Modal, IntegratorKind::GeneralizedAlpha);
        scene.solver.corrections = None;
    }
    if let System::Chain(chain) = &mut scene.system {
        chain.links.iter_mut().for_each(|link| link.elements = PARTS);
    }
    let mut simulation = Simulation::new(&scene)?;
    let mut peaks = vec![[0.0_f64; 2]; chain.links.len()];
    loop {
        simulation.step()?;
        for (link, peak) in simulation.observe()?.links.iter().zip(&mut peaks) {
            let force_n = axial_n(link);
            *peak = [if force_n.abs() > peak[0].abs() { force_n } else { peak[0] }, peak[1].max(deflection_m(link))];
        }
        if simulation.time_s() >= until_s {
            break;
        }
    }
    let crank_m = match chain.end {
        End::Slider(_) => chain.links.first().map(|crank| crank.length_m),
        End::Free { .. } => None,
    };
    let of = |(link, [force_n, deflection_m]): (&Link, [f64; 2])| {
        let shortening_m = force_n.abs() * link.length_m / link.bar?.axial_stiffness_n();
        Some(Shortening { link: link.name, length_m: link.length_m, force_n, shortening_m, deflection_m, crank_m })
    };
    Ok(chain.links.iter().zip(peaks).filter(|(link, _)| stiff(link)).filter_map(of).collect())
}

/// Mean over elements of equal length.
fn axial_n(link: &LinkObservation) -> f64 {
    link.elements.iter().map(|element| element.axial_n).sum::<f64>() / link.elements.len().max(1) as f64
}

fn deflection_m(link: &LinkObservation) -> f64 {
    link.nodes.iter().filter_map(|node| node.deflection_m).fold(0.0, |most, deflection_m| most.max(deflection_m.abs()))
}
