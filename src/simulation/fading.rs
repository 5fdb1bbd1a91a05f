//! How fast a link's vibration, and with it an error of its deflection, fades.

use std::f64::consts::PI;

use super::drive::DriveLaw;
use crate::scene::{Chain, End, Link, Scene};

/// Slowest decay, 1/s, of what the links of a chain do beside turning: that of the link whose bending fades most slowly by its own
/// damping; 0 if one has none, or if a second link swings freely from one that is moved.
pub(super) fn fading_per_s(scene: &Scene, law: &DriveLaw) -> f64 {
    let Some(chain) = scene.chain() else { return 0.0 };
    if law.is_motion() && chain.links.len() > 1 && matches!(chain.end, End::Free { .. }) {
        return 0.0;
    }
    let flexible = (0..chain.links.len()).filter(|place| !chain.links[*place].rigid);
    let slowest = flexible.map(|place| decay_per_s(chain, place, law.is_motion())).reduce(f64::min);
    slowest.unwrap_or(0.0)
}

/// Decay of a link's slowest bending. Between pins, `ω ≥ (π/l)² √(E J/(ρ A))` and the decay is `β ω²/2`, β being `damping_s`. A first
/// link that a prescribed motion or a base spring holds is a massless bar with what it carries, and 33/140 of itself, at its end; the
/// spring k is in series with it, and so is its damper c:
///
/// ```text
/// 1/(M ω²) = l³/(3 E J) + l²/k     decay = ω²/2 (β s + c/k (1 − s))     s: the bar's part of the sum
/// ```
fn decay_per_s(chain: &Chain, place: usize, is_moved: bool) -> f64 {
    let link = &chain.links[place];
    let Some(bar) = link.bar else { return 0.0 };
    let (stiffness, length_m) = (bar.bending_stiffness_nm2(), link.length_m);
    let base = &chain.base;
    if place > 0 || !is_moved && base.torsion_spring_nm_per_rad == 0.0 {
        let omega_squared = (PI / length_m).powi(4) * stiffness / bar.mass_per_length_kg_per_m();
        return slower(0.5 * link.damping_s * omega_squared, omega_squared);
    }
    let spring = if is_moved { f64::INFINITY } else { base.torsion_spring_nm_per_rad };
    let [bent, turned] = [length_m.powi(3) / (3.0 * stiffness), length_m * length_m / spring];
    let (omega_squared, part) = (1.0 / (carried_kg(chain, place, link) * (bent + turned)), bent / (bent + turned));
    let damping_s = link.damping_s * part + base.damper_nm_s_per_rad / spring * (1.0 - part);
    slower(0.5 * damping_s * omega_squared, omega_squared)
}

/// Mass at the end of a link that is held by its first, kg.
fn carried_kg(chain: &Chain, place: usize, link: &Link) -> f64 {
    let at_end_kg = match &chain.end {
        End::Free { tip_mass_kg } => *tip_mass_kg,
        End::Slider(slider) => slider.mass_kg,
    };
    let beyond_kg: f64 = chain.links[place + 1..].iter().map(|link| link.mass_kg).sum();
    beyond_kg + at_end_kg + 33.0 / 140.0 * link.mass_kg
}

/// The slower root where damping is so strong that nothing swings: `ω²/(2 σ)` and more, to which all higher modes tend.
fn slower(decay_per_s: f64, omega_squared: f64) -> f64 {
    if decay_per_s > 0.0 { decay_per_s.min(0.5 * omega_squared / decay_per_s) } else { 0.0 }
}
