//! Warnings of links that ring because a scene starts at speed, or under a load.

use super::aligned_table::figure;
use crate::mechanics::resistance_n;
use crate::scene::{Chain, Drive, End, Link, ModelKind, Motion, Scene};
use crate::simulation::Loads;

/// Less is rounding.
const AT_REST_RAD_PER_S: f64 = 1e-9;
/// Part of the drive's largest speed below which a start is one at rest, as that of a table whose spline does not begin quite so: loads of
/// inertia go by the square.
const SLOW: f64 = 1e-2;

/// The warnings of a scene whose links bend or stretch, and start without the loads that they then carry.
pub(super) fn sudden_start(scene: &Scene) -> Vec<String> {
    scene.chain().map_or(Vec::new(), |chain| [at_speed(scene, chain), under_load(scene, chain)].into_iter().flatten().collect())
}

/// The warning of a start at speed: the load is that of their inertia.
fn at_speed(scene: &Scene, chain: &Chain) -> Option<String> {
    let loads = Loads::new(scene);
    let motion = loads.input(0.0).motion;
    let rad_per_s = motion.map_or(chain.start.rate_rad_per_s, |[_, rad_per_s, _]| rad_per_s);
    let slow_rad_per_s = AT_REST_RAD_PER_S.max(SLOW * loads.largest_rate_rad_per_s());
    let way_on = match scene.drive {
        Drive::Torque { .. } => "their damping lets that fade",
        Drive::Motion(Motion::Table(_)) => "a drive.table whose first two rows have one angle begins at rest",
        Drive::Motion(_) => "a drive.ramp from rest begins smoothly",
    };
    // A link that turns alone is loaded along its length.
    let is_loaded = |link: &Link| !link.rigid && (chain.links.len() > 1 || link.axial);
    let is_flexible = scene.solver.model != ModelKind::Rigid && chain.links.iter().any(is_loaded);
    (is_flexible && rad_per_s.abs() > slow_rad_per_s).then(|| {
        format!(
            "the scene starts at {} rad/s with links that carry no load of their own inertia yet: they ring, and first peaks of \
             deflections and forces are up to twice the steady ones; {way_on}",
            figure(rad_per_s)
        )
    })
}

/// The warning of a start under the slider's resistance.
fn under_load(scene: &Scene, chain: &Chain) -> Option<String> {
    let End::Slider(slider) = &chain.end else { return None };
    let motion = Loads::new(scene).input(0.0).motion;
    let force_n = resistance_n(&slider.resistance, motion.map_or(chain.start.angle_rad, |[angle_rad, ..]| angle_rad));
    let can_carry_it = matches!(scene.solver.model, ModelKind::Modal | ModelKind::FiniteElement);
    let is_sudden = can_carry_it && !chain.start.static_equilibrium && chain.links.iter().any(|link| !link.rigid);
    (is_sudden && force_n != 0.0).then(|| {
        format!(
            "{} N resist the slider at the start, which the links do not carry yet: they ring, and first peaks of forces may be two \
             or three times that load's; start.static_equilibrium = true begins with links that carry it",
            figure(force_n)
        )
    })
}
