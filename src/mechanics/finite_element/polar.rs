//! A vector in polar coordinates `p = s e(θ)`: the tangent at a link's first pin, or a rigid link from pin to pin.
//!
//! Its angle counts whole turns, takes torques as they are, and is what a prescribed motion prescribes.

use nalgebra::{Matrix2, Vector2};

use super::strain::left;
use crate::mechanics::mechanism::Weights;

/// Derivatives of a vector and its rates by its coordinates `u`: `δp = T δu`, `δṗ = v δu + T δu̇`, and so on,
/// for `(δu, δu̇, δü)` that are multiples of one direction by the weights of the tangent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    /// `T = ∂p/∂u`.
    pub(super) direction: Matrix2<f64>,
    /// `δp̈ − acceleration · T`.
    pub(super) acceleration: Matrix2<f64>,
    /// `δṗ − velocity · T`.
    pub(super) velocity: Matrix2<f64>,
}

impl Column {
    /// Of Cartesian coordinates.
    pub(super) fn cartesian() -> Self {
        Self { direction: Matrix2::identity(), acceleration: Matrix2::zeros(), velocity: Matrix2::zeros() }
    }
}

/// Coordinates `(s, θ)` with their rates, and the unit vectors at θ.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Polar {
    pub(super) u: Vector2<f64>,
    pub(super) du: Vector2<f64>,
    pub(super) ddu: Vector2<f64>,
    along: Vector2<f64>,
    across: Vector2<f64>,
}

impl Polar {
    /// At these coordinates.
    pub(super) fn new(u: Vector2<f64>, du: Vector2<f64>, ddu: Vector2<f64>) -> Self {
        let (sin, cos) = u.y.sin_cos();
        let along = Vector2::new(cos, sin);
        Self { u, du, ddu, along, across: left(&along) }
    }

    /// `p = s e`, `ṗ = ṡ e + s θ̇ n`, `p̈ = (s̈ − s θ̇²) e + (s θ̈ + 2 ṡ θ̇) n`.
    pub(super) fn cartesian(&self) -> [Vector2<f64>; 3] {
        let ([s, _], [ds, w], [dds, dw]) = (self.u.into(), self.du.into(), self.ddu.into());
        [
            self.along * s,
            self.along * ds + self.across * (s * w),
            self.along * (dds - s * w * w) + self.across * (s * dw + 2.0 * ds * w),
        ]
    }

    /// `Tᵀ f`: the forces on `s` and on θ.
    pub(super) fn force(&self, f: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.along.dot(f), self.u.x * self.across.dot(f))
    }

    /// `∂(Tᵀ f)/∂u` at constant `f`.
    pub(super) fn geometric(&self, f: &Vector2<f64>) -> Matrix2<f64> {
        let (radial, tangential) = (self.along.dot(f), self.across.dot(f));
        Matrix2::new(0.0, tangential, tangential, -self.u.x * radial)
    }

    /// See [`Column`].
    pub(super) fn column(&self, weights: Weights) -> Column {
        let (e, n) = (self.along, self.across);
        let ([s, _], [ds, w], [dds, dw]) = (self.u.into(), self.du.into(), self.ddu.into());
        let by_s = n * (2.0 * w * weights.velocity) + (n * dw - e * (w * w)) * weights.position;
        let by_angle = (n * ds - e * (s * w)) * (2.0 * weights.velocity)
            + (n * (dds - s * w * w) - e * (s * dw + 2.0 * ds * w)) * weights.position;
        Column {
            direction: Matrix2::from_columns(&[e, n * s]),
            acceleration: Matrix2::from_columns(&[by_s, by_angle]),
            velocity: Matrix2::from_columns(&[n * w, n * ds - e * (s * w)]) * weights.position,
        }
    }
}
