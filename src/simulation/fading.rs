//! How fast a link's vibration, and with it an error of its deflection, fades.

use std::f64::consts::PI;

use super::drive::DriveLaw;
use crate::scene::{End, Scene};

/// Slowest decay, 1/s, of the bending of the last flexible link by its own damping: half of `damping_s` times ω². A link between pins has
/// `ω ≥ (π/l)² √(E J/(ρ A))`. One that is held by its first end, by a spring or a prescribed motion, bends as a massless bar with what it
/// carries at its end, and 33/140 of itself: `ω² = 3 E J/(l³ M)`.
pub(super) fn fading_per_s(scene: &Scene, law: &DriveLaw) -> f64 {
    let Some(chain) = scene.chain() else { return 0.0 };
    let Some(place) = chain.links.iter().rposition(|link| !link.rigid) else { return 0.0 };
    let link = &chain.links[place];
    let Some(bar) = link.bar else { return 0.0 };
    let is_held = place == 0 && (law.is_motion() || chain.base.torsion_spring_nm_per_rad > 0.0);
    let at_end_kg = match &chain.end {
        End::Free { tip_mass_kg } => *tip_mass_kg,
        End::Slider(slider) => slider.mass_kg,
    };
    let beyond_kg: f64 = chain.links[place + 1..].iter().map(|link| link.mass_kg).sum::<f64>() + at_end_kg;
    let omega_squared = if is_held {
        3.0 * bar.bending_stiffness_nm2() / (link.length_m.powi(3) * (beyond_kg + 33.0 / 140.0 * link.mass_kg))
    } else {
        (PI / link.length_m).powi(4) * bar.bending_stiffness_nm2() / bar.mass_per_length_kg_per_m()
    };
    0.5 * link.damping_s * omega_squared
}
