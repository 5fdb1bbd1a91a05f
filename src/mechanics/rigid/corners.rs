//! The corners of a resistance that a rigid chain passes.

use super::Rigid;
use crate::mechanics::resistance::corners_between;
use crate::scene::{End, Resistance};

impl Rigid {
    /// Whether its resistance has corners.
    pub fn has_corners(&self) -> bool {
        matches!(&self.chain.end, End::Slider(slider) if matches!(slider.resistance, Resistance::Table(_)))
    }

    /// Jumps of the crank's acceleration's slope in time, rad/s³, where it passes corners of the resistance's table, each with the part
    /// of the way between two states (angle, rad, and rate, rad/s) at which it does: `J = −ΔF′ x_E′ |θ̇|/M`, as the jump of `F′` is
    /// that in the positive direction.
    pub fn corners(&self, from: [f64; 2], to: [f64; 2]) -> impl Iterator<Item = (f64, f64)> {
        let resistance = match &self.chain.end {
            End::Free { .. } => &Resistance::Constant(0.0),
            End::Slider(slider) => &slider.resistance,
        };
        corners_between(resistance, from[0], to[0]).map(move |corner| {
            let part = (corner.crank_rad - from[0]) / (to[0] - from[0]);
            let rate = from[1] + part * (to[1] - from[1]);
            let pose = self.pose::<3>(corner.crank_rad);
            let inertia_kg_m2 = self.equation(&pose, corner.crank_rad, 0.0).mass;
            (part, -corner.slope_jump_n_per_rad * pose.end[1][0] * rate.abs() / inertia_kg_m2)
        })
    }
}
