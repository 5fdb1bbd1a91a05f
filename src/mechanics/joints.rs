//! Joint forces of a chain of rigid bodies from their accelerations, body by body from the far end.
//!
//! With `E` the rod's force on the slider, `A` the crank's on the rod, `O` ground's on the crank (digest 4.44–4.54, gravity
//! added): slider `E_x = m₃ (a_E − g_x) + F`; rod `A = E + m₂ (a₂ − g)` and, by moments about its centre of mass with `e`
//! its direction and `r₂` the centre's distance from the crank pin, `−r₂ e×A − (l₂ − r₂) e×E = I₂ β̈` (4.49; in 4.50 the
//! thesis prints `sin θ` for `sin φ`); crank `O = A + m₁ (a₁ − g)`. Eliminating `A` from the moments:
//! `l₂ e×E = −I₂ β̈ − r₂ m₂ e×(a₂ − g)`.

use super::observation::Observation;
use crate::scene::{Chain, End};

/// One body in motion.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Body {
    pub mass_kg: f64,
    pub inertia_kg_m2: f64,
    pub angle_rad: f64,
    pub acceleration_m_per_s2: [f64; 2],
    pub angular_acceleration_rad_per_s2: f64,
}

/// Fills the joint forces for `bodies`: the links, then the slider or tip. `end_force_n` acts on the slider along −x.
pub(super) fn fill(chain: &Chain, bodies: &[Body], end_force_n: f64, out: &mut Observation) {
    let gravity = chain.gravity_m_per_s2;
    let inertia_force = |body: &Body| [0, 1].map(|k| body.mass_kg * (body.acceleration_m_per_s2[k] - gravity[k]));
    if let (End::Slider(_), [crank, rod, slider]) = (&chain.end, bodies) {
        let link = &chain.links[1];
        let (sin, cos) = rod.angle_rad.sin_cos();
        let inertia = inertia_force(rod);
        let ex = inertia_force(slider)[0] + end_force_n;
        let cross = cos * inertia[1] - sin * inertia[0];
        let moment = rod.inertia_kg_m2 * rod.angular_acceleration_rad_per_s2 + link.centre_of_mass_m * cross;
        let ey = (sin * ex - moment / link.length_m) / cos;
        let pin = [ex + inertia[0], ey + inertia[1]];
        let at_crank = inertia_force(crank);
        out.slider_pin_n = Some([ex, ey]);
        out.guide_n = Some(inertia_force(slider)[1] - ey);
        out.crank_pin_n = Some(pin);
        out.pivot_n = Some([pin[0] + at_crank[0], pin[1] + at_crank[1]]);
    } else {
        let sum = bodies.iter().map(inertia_force).fold([0.0; 2], |sum, force| [sum[0] + force[0], sum[1] + force[1]]);
        out.pivot_n = Some(sum);
    }
}
