//! A warning of links that ring because a scene starts at speed.

use super::aligned_table::figure;
use crate::scene::{Link, ModelKind, Scene};
use crate::simulation::Loads;

/// The warning of a scene that starts at speed, whose links bend or stretch: they carry no load of their inertia yet.
pub(super) fn sudden_start(scene: &Scene) -> Option<String> {
    let chain = scene.chain()?;
    let motion = Loads::new(scene).input(0.0).motion;
    let rad_per_s = motion.map_or(chain.start.rate_rad_per_s, |[_, rad_per_s, _]| rad_per_s);
    let way_on = if motion.is_some() { "a drive.ramp from rest begins smoothly" } else { "their damping lets that fade" };
    // A link that turns alone is loaded along its length.
    let is_loaded = |link: &Link| !link.rigid && (chain.links.len() > 1 || link.axial);
    let is_flexible = scene.solver.model != ModelKind::Rigid && chain.links.iter().any(is_loaded);
    (is_flexible && rad_per_s != 0.0).then(|| {
        format!(
            "the scene starts at {} rad/s with links that carry no load of their own inertia yet: they ring, and first peaks of \
             deflections and forces are up to twice the steady ones; {way_on}",
            figure(rad_per_s)
        )
    })
}
