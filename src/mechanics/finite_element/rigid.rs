//! Links that are rigid.
//!
//! Points on the axis of a rigid link from `p` to `p + a` are `p + σ a`, `0 ≤ σ ≤ 1`, so its kinetic energy is
//! `½ m_pp |ṗ|² + m_pa ṗ·ȧ + ½ m_aa |ȧ|²` with constant `m_pp = m`, `m_pa = m c/L`, `m_aa = (I_c + m c²)/L²`; `|a| = L`
//! holds by the coordinates of `a` (polar, or [`GuidedRod`]), not by a constraint.

use nalgebra::{Matrix2, RowVector2, Vector2};

use super::polar::Column;
use crate::mechanics::mechanism::Weights;
use crate::scene::Link;

/// `m_pp`, `m_pa`, `m_aa` as a symmetric matrix.
pub(super) type Masses = [[f64; 2]; 2];

/// The masses of a rigid link.
pub(super) fn masses(link: &Link) -> Masses {
    let arm = link.centre_of_mass_m / link.length_m;
    let coupled = link.mass_kg * arm;
    let turning = link.inertia_kg_m2 / link.length_m.powi(2) + coupled * arm;
    [[link.mass_kg, coupled], [coupled, turning]]
}

/// The masses with a point mass added at the link's end.
pub(super) fn with_tip(masses: Masses, tip_kg: f64) -> Masses {
    masses.map(|row| row.map(|entry| entry + tip_kg))
}

/// `½ Σ m |·|²` for velocities `(ṗ, ȧ)`.
pub(super) fn kinetic_j(m: &Masses, dp: &Vector2<f64>, da: &Vector2<f64>) -> f64 {
    0.5 * m[0][0] * dp.norm_squared() + m[0][1] * dp.dot(da) + 0.5 * m[1][1] * da.norm_squared()
}

/// A rigid rod between the crank pin and the slider's guide: `a = (g(y), −y)`, `g = √(L² − y²)`, with the pin's height `y`.
/// It has no coordinate of its own, and acts on the pin alone.
#[derive(Debug, Clone)]
pub(super) struct GuidedRod {
    pub(super) length_m: f64,
    pub(super) masses: Masses,
}

/// Derivatives of `g` by `y`, from the value up.
struct Reach([f64; 4]);

/// Force on the slider along x, besides the rod's: `mass (ẍ − g_x) + friction ẋ + resistance`.
#[derive(Debug, Clone, Copy)]
pub(super) struct SliderLoad {
    pub(super) mass_kg: f64,
    pub(super) friction_n_s_per_m: f64,
    pub(super) resistance_n: f64,
    /// Derivative of the resistance by the pin's position.
    pub(super) resistance_slope: Vector2<f64>,
}

/// Motion of the pin, gravity taken off its acceleration.
#[derive(Debug, Clone, Copy)]
pub(super) struct PinMotion {
    pub(super) p: Vector2<f64>,
    pub(super) dp: Vector2<f64>,
    pub(super) ddp: Vector2<f64>,
    pub(super) gravity: Vector2<f64>,
}

/// Forces that the rod's and the slider's motion need.
#[derive(Debug, Clone, Copy)]
pub(super) struct GuidedForces {
    /// On the rod at the crank pin.
    pub(super) pin: Vector2<f64>,
    /// On the slider along x, from the rod.
    pub(super) slider_x: f64,
    /// On the rod at the slider pin along y.
    pub(super) rod_end_y: f64,
    /// Working on `a`, slider included.
    on_a: Vector2<f64>,
}

impl GuidedRod {
    fn reach(&self, y: f64) -> Reach {
        let square = self.length_m.powi(2);
        let g = (square - y * y).sqrt();
        Reach([g, -y / g, -square / g.powi(3), -3.0 * square * y / g.powi(5)])
    }

    /// `a`, `ȧ`, `ä`.
    pub(super) fn along(&self, m: &PinMotion) -> [Vector2<f64>; 3] {
        let Reach([g, g1, g2, _]) = self.reach(m.p.y);
        let (dy, ddy) = (m.dp.y, m.ddp.y);
        [Vector2::new(g, -m.p.y), Vector2::new(g1 * dy, -dy), Vector2::new(g1 * ddy + g2 * dy * dy, -ddy)]
    }

    /// With `R_p = m_pp (p̈ − g) + m_pa ä + f_x x̂`, `R_a = m_pa (p̈ − g) + m_aa ä + f_x x̂`, `f_x` what the slider needs:
    /// the force on the pin is `R_p + (∂a/∂p)ᵀ R_a`, the guide's on the rod what is left of the rod's moment about the pin.
    pub(super) fn forces(&self, m: &PinMotion, load: &SliderLoad) -> GuidedForces {
        let Reach([_, g1, ..]) = self.reach(m.p.y);
        let [_, da, dda] = self.along(m);
        let free = m.ddp - m.gravity;
        let slider_x = load.mass_kg * (free.x + dda.x) + load.friction_n_s_per_m * (m.dp.x + da.x) + load.resistance_n;
        let slider = Vector2::new(slider_x, 0.0);
        let on_p = free * self.masses[0][0] + dda * self.masses[0][1] + slider;
        let on_a = free * self.masses[1][0] + dda * self.masses[1][1] + slider;
        let rod_end_y = on_a.y - g1 * on_a.x;
        GuidedForces { pin: Vector2::new(on_p.x, on_p.y - rod_end_y), slider_x, rod_end_y, on_a }
    }

    /// Moves a vector from the distance `ξ L` from the pin to the pin, with the same virtual work: `f + ξ (∂a/∂p)ᵀ f`.
    pub(super) fn push(&self, m: &PinMotion, xi: f64, f: &Vector2<f64>) -> Vector2<f64> {
        let Reach([_, g1, ..]) = self.reach(m.p.y);
        Vector2::new(f.x, f.y + xi * (g1 * f.x - f.y))
    }

    /// Momentum on the pin: the force that would need these velocities as accelerations from rest.
    pub(super) fn momentum(&self, m: &PinMotion, slider_kg: f64) -> Vector2<f64> {
        let still = PinMotion { p: m.p, dp: Vector2::zeros(), ddp: m.dp, gravity: Vector2::zeros() };
        let load =
            SliderLoad { mass_kg: slider_kg, friction_n_s_per_m: 0.0, resistance_n: 0.0, resistance_slope: Vector2::zeros() };
        self.forces(&still, &load).pin
    }

    /// Derivative of the force on the pin by the pin's coordinates.
    pub(super) fn tangent(&self, m: &PinMotion, load: &SliderLoad, pin: &Column, w: Weights) -> Matrix2<f64> {
        let Reach([_, g1, g2, g3]) = self.reach(m.p.y);
        let (dy, ddy) = (m.dp.y, m.ddp.y);
        let position = pin.direction * w.position;
        let velocity = pin.direction * w.velocity + pin.velocity;
        let acceleration = pin.direction * w.acceleration + pin.acceleration;
        let (by_y, by_dy, by_ddy) = (position.row(1), velocity.row(1), acceleration.row(1));
        let a_velocity: RowVector2<f64> = by_dy * g1 + by_y * (g2 * dy);
        let a_acceleration = by_ddy * g1 + by_dy * (2.0 * g2 * dy) + by_y * (g2 * ddy + g3 * dy * dy);
        let slider = (acceleration.row(0) + a_acceleration) * load.mass_kg
            + (velocity.row(0) + a_velocity) * load.friction_n_s_per_m
            + load.resistance_slope.transpose() * position;
        let a_rows = Matrix2::from_rows(&[a_acceleration, -by_ddy]);
        let (on_p, on_a) = (
            acceleration * self.masses[0][0] + a_rows * self.masses[0][1],
            acceleration * self.masses[1][0] + a_rows * self.masses[1][1],
        );
        let curved = by_y * (g2 * self.forces(m, load).on_a.x);
        let along_x = on_p.row(0) + slider;
        let along_y = on_p.row(1) - on_a.row(1) + (on_a.row(0) + slider) * g1 + curved;
        Matrix2::from_rows(&[along_x, along_y])
    }
}
