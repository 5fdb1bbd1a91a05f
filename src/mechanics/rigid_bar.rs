//! Internal forces of a rigid uniform bar in motion, from the equilibrium of the part before each section.
//!
//! With `F₀` and `M₀` on its first end, `a(x) = a₀ + α x n − ω² x e` along the direction `e` (`n` to its left), mass per length
//! `μ` and `c₀ = e×(a₀ − g)`, the part beyond the section at `s` acts on the part before it with
//!
//! `F(s) = μ [(a₀ − g) s + (α n − ω² e) s²/2] − F₀`, `M(s) = s e×F₀ − M₀ − μ [c₀ s²/2 + α s³/6]`.
//!
//! Axial force is `F·e`, shear `F·n = −dM/ds`; at the last pin `M = 0` unless a moment acts there.

use super::observation::ElementForces;

/// A bar in motion and what acts on its first end.
#[derive(Debug, Clone, Copy)]
pub(super) struct RigidBar {
    pub length_m: f64,
    pub mass_kg: f64,
    pub angle_rad: f64,
    pub rate_rad_per_s: f64,
    pub acceleration_rad_per_s2: f64,
    /// Acceleration of its first pin less gravity, m/s².
    pub first_m_per_s2: [f64; 2],
    /// Force on its first pin, N.
    pub force_n: [f64; 2],
    /// Moment on its first end, N·m.
    pub moment_nm: f64,
}

impl RigidBar {
    /// `[axial, shear, moment]` at distance `s_m` from the first pin.
    fn section(&self, s_m: f64) -> [f64; 3] {
        let (sin, cos) = self.angle_rad.sin_cos();
        let local = |v: [f64; 2]| [v[0] * cos + v[1] * sin, v[1] * cos - v[0] * sin];
        let ([along, across], [axial, lateral]) = (local(self.first_m_per_s2), local(self.force_n));
        let density = self.mass_kg / self.length_m;
        let (half, sixth) = (0.5 * s_m * s_m, s_m.powi(3) / 6.0);
        let alpha = self.acceleration_rad_per_s2;
        [
            density * (along * s_m - self.rate_rad_per_s.powi(2) * half) - axial,
            density * (across * s_m + alpha * half) - lateral,
            s_m * lateral - self.moment_nm - density * (across * half + alpha * sixth),
        ]
    }

    /// Fills equal elements from the first pin to the last.
    pub(super) fn fill(&self, elements: &mut [ElementForces]) {
        let step_m = self.length_m / elements.len().max(1) as f64;
        let mut start = self.section(0.0);
        for (k, element) in elements.iter_mut().enumerate() {
            let end = self.section(step_m * (k + 1) as f64);
            *element = ElementForces {
                axial_n: 0.5 * (start[0] + end[0]),
                shear_n: 0.5 * (start[1] + end[1]),
                moment_start_nm: start[2],
                moment_end_nm: end[2],
            };
            start = end;
        }
    }
}
