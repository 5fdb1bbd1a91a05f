//! A warning of links that ring because a scene starts at speed.

use super::aligned_table::figure;
use crate::scene::{Drive, Link, ModelKind, Motion, Scene};
use crate::simulation::Loads;

/// Less is rounding, as of a table that begins at rest.
const AT_REST_RAD_PER_S: f64 = 1e-9;

/// The warning of a scene that starts at speed, whose links bend or stretch: they carry no load of their inertia yet.
pub(super) fn sudden_start(scene: &Scene) -> Option<String> {
    let chain = scene.chain()?;
    let motion = Loads::new(scene).input(0.0).motion;
    let rad_per_s = motion.map_or(chain.start.rate_rad_per_s, |[_, rad_per_s, _]| rad_per_s);
    let way_on = match scene.drive {
        Drive::Torque { .. } => "their damping lets that fade",
        Drive::Motion(Motion::Table(_)) => "a drive.table whose first two rows have one angle begins at rest",
        Drive::Motion(_) => "a drive.ramp from rest begins smoothly",
    };
    // A link that turns alone is loaded along its length.
    let is_loaded = |link: &Link| !link.rigid && (chain.links.len() > 1 || link.axial);
    let is_flexible = scene.solver.model != ModelKind::Rigid && chain.links.iter().any(is_loaded);
    (is_flexible && rad_per_s.abs() > AT_REST_RAD_PER_S).then(|| {
        format!(
            "the scene starts at {} rad/s with links that carry no load of their own inertia yet: they ring, and first peaks of \
             deflections and forces are up to twice the steady ones; {way_on}",
            figure(rad_per_s)
        )
    })
}
