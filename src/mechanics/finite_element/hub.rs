//! The element at the pivot, where a moment acts on a link's end.
//!
//! With the shift in its middle (`beam`) an element leaves an error of `ℓ⁴/720 N ∫ w‴² + w″ w⁗ ds = ℓ⁴/720 [N w″ w‴]` in the eigenvalues,
//! where the tension N is uniform. The error is nil at pins between links and at free ends, which carry no moment. At the pivot there is
//! one, from torque, prescribed motion or the base's spring, and tension forms a layer of the width `√(EJ/N)` there. The element starts
//! with `ℓ w″ = b + 3c` and `ℓ² w‴ = −6c`. Its first node has the weight `ℓ/6`, so the term is a shift of that node's strain:
//!
//! ```text
//! ε = |t₁| − 1 − g      g = (b + 3c)·c/40 = ½ xᵀ G x
//! ```
//!
//! The functions below return by how much this strain's force, tangent, energy and dissipation differ from those of `|t₁| − 1`, which
//! [`Beam`] has. 64 elements at `21 √(EJ/ρA)/L²`: the first ω of a rotating beam errs by 3.0e-7, without the term by 2.2e-6.

use nalgebra::{Matrix2, Vector2};

use super::beam::{Beam, Blocks, Four};
use super::strain::StiffnessWeights;

/// Vectors b and c of `beam`, as sums of an element's slots.
fn bend_and_twist(length_m: f64) -> ([f64; 4], [f64; 4]) {
    let end = 2.0 / length_m;
    ([0.0, -1.0, 0.0, 1.0], [-end, -1.0, end, -1.0])
}

/// `G x = [b c + c (b + 6c)]/40`, the vectors in front taken as sums of slots.
fn gradient(length_m: f64, x: &Four) -> Four {
    let (bend, twist) = bend_and_twist(length_m);
    let of = |k: &[f64; 4]| x[0] * k[0] + x[1] * k[1] + x[2] * k[2] + x[3] * k[3];
    let (b, c) = (of(&bend), of(&twist));
    std::array::from_fn(|i| (c * bend[i] + (b + c * 6.0) * twist[i]) / 40.0)
}

/// `g = (b + 3c)·c/40`.
pub(super) fn shift(b: &Vector2<f64>, c: &Vector2<f64>) -> f64 {
    (b + c * 3.0).dot(c) / 40.0
}

fn dot(a: &Four, b: &Four) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

impl Beam {
    /// Forces on the slots: `N ∇ε`, less `N₀ u` of the node alone.
    pub(super) fn hub_force(&self, x: &Four, dx: &Four) -> Four {
        let super::strain::Axial { stiffness, damping_s } = self.axial;
        let gradient = gradient(self.length_m, x);
        let mut shift = 0.5 * dot(x, &gradient);
        let length = x[1].norm();
        let mut strain = length - 1.0 - shift;
        if damping_s != 0.0 {
            let shift_rate = dot(dx, &gradient);
            strain += damping_s * (x[1].dot(&dx[1]) / length - shift_rate);
            shift += damping_s * shift_rate;
        }
        let mut force = gradient.map(|gradient| gradient * (-stiffness * strain));
        force[1] -= x[1] * (stiffness * shift / length);
        force
    }

    /// Adds to the blocks of [`Beam::tangent`]: `N ∂²ε · position + ∇ε ρᵀ`, with `ρ = EA [(position + c velocity) ∇ε + c position ∇ε̇]`,
    /// for the node's alone.
    pub(super) fn add_hub_tangent(&self, x: &Four, dx: &Four, weights: StiffnessWeights, blocks: &mut Blocks) {
        let super::strain::Axial { stiffness, damping_s } = self.axial;
        let (gradient, length) = (gradient(self.length_m, x), x[1].norm());
        let inverse = 1.0 / length;
        let u = x[1] * inverse;
        let mut strain = length - 1.0 - 0.5 * dot(x, &gradient);
        let mut strain_gradient = gradient.map(|gradient| -gradient);
        strain_gradient[1] += u;
        let direct = stiffness * (weights.position + damping_s * weights.velocity);
        let mut row = strain_gradient.map(|gradient| gradient * direct);
        if damping_s != 0.0 {
            let follow = stiffness * damping_s * weights.position;
            let gradient_rate = self::gradient(self.length_m, dx);
            row = std::array::from_fn(|i| row[i] - gradient_rate[i] * follow);
            row[1] += (dx[1] - u * u.dot(&dx[1])) * (follow * inverse);
            strain += damping_s * (u.dot(&dx[1]) - dot(dx, &gradient));
        }
        let tension = weights.position * stiffness * strain;
        let (bend, twist) = bend_and_twist(self.length_m);
        for (i, blocks) in blocks.iter_mut().enumerate() {
            for (j, block) in blocks.iter_mut().enumerate() {
                let curved = (bend[i] * twist[j] + twist[i] * (bend[j] + 6.0 * twist[j])) * (tension / 40.0);
                *block += strain_gradient[i] * row[j].transpose() - Matrix2::from_diagonal_element(curved);
            }
        }
        blocks[1][1] +=
            (Matrix2::identity() - u * u.transpose()) * (tension * inverse) - self.axial.tangent(&x[1], &dx[1], weights);
    }

    /// `½ EA [ε² − (|t₁| − 1)²]`, J.
    pub(super) fn hub_energy_j(&self, x: &Four) -> f64 {
        let strain = x[1].norm() - 1.0 - 0.5 * dot(x, &gradient(self.length_m, x));
        0.5 * self.axial.stiffness * strain.powi(2) - self.axial.energy(&x[1])
    }

    /// `c EA [ε̇² − (|t₁|˙)²]`, W.
    pub(super) fn hub_dissipation_w(&self, x: &Four, dx: &Four) -> f64 {
        let rate = x[1].dot(&dx[1]) / x[1].norm() - dot(dx, &gradient(self.length_m, x));
        self.axial.damping_s * self.axial.stiffness * rate.powi(2) - self.axial.dissipation(&x[1], &dx[1])
    }
}
