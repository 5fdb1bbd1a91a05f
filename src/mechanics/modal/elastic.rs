//! Elasticity of one link: bending with its exact curvature to fourth order, stretching, proportional damping.

use super::quartic::Quartic;
use super::shapes::Shapes;
use crate::scene::Bar;
use std::f64::consts::PI;

/// Strain energy of a link in its own coordinates, bending η then axial e.
///
/// An inextensible line with offset `w(s)` has the tangent `sin θ = w'` and the curvature `θ' = w''/√(1 − w'²)`, so
///
/// ```text
/// V = ½ EJ ∫ θ'² ds = ½ EJ ∫ w''² (1 + w'²) ds + O(w⁶) = ½ Σ k_i η_i² + ¼ T_ijkl η_i η_j η_k η_l,
/// T_ijkl = 2 EJ ∫ φ_i'' φ_j'' φ_k' φ_l' ds, symmetrized
/// ```
///
/// The quartic term sets how fast strong vibration is: without it modes converge on R2s to an error of 8e-3 rad, with it
/// to 4e-4 (inextensible) and below 1e-4 (axial). It is kept for the sines, closed form; χ is small and goes without.
#[derive(Debug, Clone)]
pub(super) struct Elastic {
    /// Of each coordinate, N/m.
    stiffness: Vec<f64>,
    damping_s: f64,
    quartic: Quartic,
    /// `S_ij = T_ijkl η_k η_l` at the last evaluation, N/m.
    secant: Vec<f64>,
}

impl Elastic {
    /// For a link of length `length_m` with `axial` axial coordinates; nothing without a bar.
    pub(super) fn new<const W: usize>(shapes: &Shapes<W>, bar: Option<Bar>, length_m: f64, axial: usize, damping_s: f64) -> Self {
        let (ej, ea) = bar.map_or((0.0, 0.0), |bar| (bar.bending_stiffness_nm2(), bar.axial_stiffness_n()));
        let mut stiffness: Vec<f64> = shapes.curvature.iter().map(|c| c * ej / length_m.powi(3)).collect();
        let stretch = |f: usize| if f == 0 { 1.0 } else { 0.5 * (f as f64 * PI).powi(2) };
        stiffness.extend((0..axial).map(|f| ea / length_m * stretch(f)));
        let quartic = Quartic::curvature(shapes.modes, 0.5 * ej / length_m.powi(5));
        let secant = quartic.matrix();
        Self { stiffness, damping_s, quartic, secant }
    }

    /// Adds the forces `k (q + c q̇) + S η` to `r`.
    pub(super) fn force(&mut self, q: &[f64], v: &[f64], r: &mut [f64]) {
        for (i, k) in self.stiffness.iter().enumerate() {
            r[i] += k * (q[i] + self.damping_s * v[i]);
        }
        self.quartic.contract(q, q, &mut self.secant);
        self.quartic.apply(&self.secant, q, |i, force| r[i] += force);
    }

    /// Adds `position ∂/∂q + velocity ∂/∂q̇` of the last force to the square matrix `k` of `all` rows, at row and column `at`.
    pub(super) fn tangent(&self, position: f64, velocity: f64, at: usize, all: usize, k: &mut [f64]) {
        for (i, stiffness) in self.stiffness.iter().enumerate() {
            k[(at + i) * (all + 1)] += stiffness * (position + self.damping_s * velocity);
        }
        for (&[i, j], s) in self.quartic.pairs.iter().zip(&self.secant) {
            k[(at + i) * all + at + j] += 3.0 * position * s;
            if i != j {
                k[(at + j) * all + at + i] += 3.0 * position * s;
            }
        }
    }

    /// Strain energy, for the secant of the last force, J.
    pub(super) fn energy_j(&self, q: &[f64]) -> f64 {
        let quadratic: f64 = self.stiffness.iter().zip(q).map(|(k, q)| 0.5 * k * q * q).sum();
        quadratic + 0.25 * self.quartic.form(&self.secant, q, q)
    }

    /// Power dissipated by damping, W.
    pub(super) fn dissipation_w(&self, v: &[f64]) -> f64 {
        self.stiffness.iter().zip(v).map(|(k, v)| k * self.damping_s * v * v).sum()
    }

    /// `Σ |k q|`, N.
    pub(super) fn size_n(&self, q: &[f64]) -> f64 {
        self.stiffness.iter().zip(q).map(|(k, q)| (k * q).abs()).sum()
    }
}
