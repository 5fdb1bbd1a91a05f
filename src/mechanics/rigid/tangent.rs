//! Derivatives of the equation of motion.

use super::{Pose, Rigid, dot};
use crate::mechanics::mechanism::Weights;
use crate::mechanics::resistance::resistance;
use crate::scene::End;

impl Rigid {
    /// `∂(M θ̈ + rest)/∂θ`, term by term.
    pub(super) fn stiffness(&self, pose: &Pose<4>, theta_rad: f64, rate: f64, acceleration: f64) -> f64 {
        let gravity = self.chain.gravity_m_per_s2;
        let bodies: f64 = pose
            .bodies
            .iter()
            .map(|body| {
                let [_, c1, c2, c3] = &body.centre;
                let [b1, b2, b3] = body.turn.slopes;
                let slope = 2.0 * (body.mass_kg * dot(c1, c2) + body.inertia_kg_m2 * b1 * b2);
                let half_curve = body.mass_kg * (dot(c2, c2) + dot(c1, c3)) + body.inertia_kg_m2 * (b2 * b2 + b1 * b3);
                slope * acceleration + half_curve * rate * rate - body.mass_kg * dot(&gravity, c2)
            })
            .sum();
        let (x1, x2) = (pose.end[1][0], pose.end[2][0]);
        let slider = match &self.chain.end {
            End::Free { .. } => 0.0,
            End::Slider(slider) => {
                let [force, slope] = resistance(&slider.resistance, theta_rad);
                force * x2 + slope * x1 + 2.0 * slider.friction_n_s_per_m * rate * x1 * x2
            }
        };
        bodies + self.chain.base.torsion_spring_nm_per_rad + slider
    }

    pub(super) fn tangent_at(&mut self, [theta, rate, acceleration]: [f64; 3], w: Weights) -> f64 {
        let mut tangent = w.acceleration * self.evaluate(theta, rate).equation.mass;
        let pose = &self.last.pose;
        if w.velocity != 0.0 {
            tangent += w.velocity * self.viscosity(pose, rate);
        }
        if w.position != 0.0 {
            tangent += w.position * self.stiffness(&self.pose(theta), theta, rate, acceleration);
        }
        tangent
    }

    pub(super) fn viscosity<const D: usize>(&self, pose: &Pose<D>, rate: f64) -> f64 {
        let half_slope: f64 = pose
            .bodies
            .iter()
            .map(|body| {
                let [b1, b2, _] = body.turn.slopes;
                body.mass_kg * dot(&body.centre[1], &body.centre[2]) + body.inertia_kg_m2 * b1 * b2
            })
            .sum();
        let friction = match &self.chain.end {
            End::Free { .. } => 0.0,
            End::Slider(slider) => slider.friction_n_s_per_m * pose.end[1][0].powi(2),
        };
        2.0 * half_slope * rate + self.chain.base.damper_nm_s_per_rad + friction
    }
}
