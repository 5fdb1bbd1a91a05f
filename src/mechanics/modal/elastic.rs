//! Linear elasticity of one link: bending, stretching, proportional damping.

use super::shapes::Shapes;
use crate::scene::Bar;
use std::f64::consts::PI;

/// Strain energy of a link in its own coordinates, bending η then axial e.
///
/// `V = ½ Σ k_i q_i²`, with `k_i = EJ/L³ ∫ φ_i''² dξ` of bending; [`Strong`](super::strong::Strong) adds what the exact curvature
/// does.
#[derive(Debug, Clone)]
pub(super) struct Elastic {
    /// Stiffness of each coordinate, N/m.
    stiffness: Vec<f64>,
    damping_s: f64,
}

impl Elastic {
    /// For a link of length `length_m` with `axial` axial coordinates; nothing without a bar.
    pub(super) fn new<const W: usize>(shapes: &Shapes<W>, bar: Option<Bar>, length_m: f64, axial: usize, damping_s: f64) -> Self {
        let (ej, ea) = bar.map_or((0.0, 0.0), |bar| (bar.bending_stiffness_nm2(), bar.axial_stiffness_n()));
        let mut stiffness: Vec<f64> = shapes.curvature.iter().map(|c| c * ej / length_m.powi(3)).collect();
        let stretch = |f: usize| if f == 0 { 1.0 } else { 0.5 * (f as f64 * PI).powi(2) };
        stiffness.extend((0..axial).map(|f| ea / length_m * stretch(f)));
        Self { stiffness, damping_s }
    }

    /// Adds the forces `k (q + c q̇)` to `r`.
    pub(super) fn force(&self, q: &[f64], v: &[f64], r: &mut [f64]) {
        for (i, k) in self.stiffness.iter().enumerate() {
            r[i] += k * (q[i] + self.damping_s * v[i]);
        }
    }

    /// Adds `position ∂/∂q + velocity ∂/∂q̇` of the last force to the square matrix `k` of `all` rows, at row and column `at`.
    pub(super) fn tangent(&self, position: f64, velocity: f64, at: usize, all: usize, k: &mut [f64]) {
        for (i, stiffness) in self.stiffness.iter().enumerate() {
            k[(at + i) * (all + 1)] += stiffness * (position + self.damping_s * velocity);
        }
    }

    /// Strain energy, J.
    pub(super) fn energy_j(&self, q: &[f64]) -> f64 {
        self.stiffness.iter().zip(q).map(|(k, q)| 0.5 * k * q * q).sum()
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
