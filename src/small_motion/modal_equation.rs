//! One mode by itself, and the eigenvalue that a scheme gives it at a step.

use std::f64::consts::PI;

use nalgebra::{Complex, Schur, linalg::balancing::balance_parlett_reinsch};

use super::periodic::PeriodicSystem;
use super::scheme::Scheme;
use super::variation::{TIGHT, Trajectory};
use crate::integrate::{Singular, System, Weights};

/// Most sweeps of the eigenvalue iteration on a step's map, which has at most three rows.
const ITERATIONS: usize = 300;

/// The equation of one mode, `ẍ + d ẋ + ω² x = 0`: with `φᵀ M φ = 1`, `d = φᵀ D φ` and `ω² = φᵀ K φ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalEquation {
    /// ω², 1/s².
    pub stiffness: f64,
    /// d, 1/s.
    pub damping: f64,
}

impl ModalEquation {
    /// `λ = −d/2 + √(d²/4 − ω²)`: of a conjugate pair the one with the positive imaginary part, of two decays the slower.
    pub fn eigenvalue(&self) -> Complex<f64> {
        let (half, square) = (0.5 * self.damping, 0.25 * self.damping * self.damping - self.stiffness);
        if square < 0.0 {
            Complex::new(-half, (-square).sqrt())
        } else {
            // The same as −d/2 + √…, without the loss of digits.
            Complex::new(-self.stiffness / (half + square.sqrt()).max(f64::MIN_POSITIVE), 0.0)
        }
    }

    /// The eigenvalue `λ_h = ln(g)/h` that a scheme gives the mode, g being the eigenvalue of its step nearest to `exp(λh)`.
    ///
    /// Every scheme here is linear in a linear system, so that its step maps each mode of proportional damping on itself. About a state
    /// at rest g is then an eigenvalue of the whole mechanism's step. `None` where a step fails.
    ///
    /// A vibration of fewer than two steps a period has `ωh > π`, which no g can tell from a slower one (Shannon). Of a conjugate pair,
    /// λ_h is the one with the positive imaginary part, as λ is, even where the other g is nearer to `exp(λh)`.
    pub fn eigenvalue_by(&self, scheme: Scheme, step_s: f64) -> Option<Complex<f64>> {
        let mut alone = Alone { equation: *self, at_work: 0.0, tangent: 1.0 };
        let mut trajectory = Trajectory::new(scheme, 1, TIGHT);
        trajectory.begin(&mut alone, 0.0, &vec![0.0; trajectory.carried_len()]).ok()?;
        trajectory.step(&mut alone, 0.0, step_s).ok()?;
        let mut map = trajectory.map();
        if !map.iter().all(|entry| entry.is_finite()) {
            return None;
        }
        // Positions and accelerations of stiff modes are of very different sizes.
        balance_parlett_reinsch(&mut map);
        let exact = (self.eigenvalue() * step_s).exp();
        let multipliers = Schur::try_new(map, f64::EPSILON, ITERATIONS)?.complex_eigenvalues();
        let distance = |g: &Complex<f64>| (*g - exact).norm();
        let nearest = multipliers.iter().copied().min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
        let Complex { re, im } = nearest.ln() / step_s;
        Some(Complex::new(re, im.abs()))
    }

    /// Whether a step is longer than half of the vibration's period.
    pub fn is_beyond(&self, step_s: f64) -> bool {
        self.eigenvalue().im * step_s > PI
    }
}

/// The equation as the schemes see it.
struct Alone {
    equation: ModalEquation,
    at_work: f64,
    tangent: f64,
}

impl System for Alone {
    fn degrees_of_freedom(&self) -> usize {
        1
    }
    fn residual(&mut self, _: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let (viscous, elastic) = (self.equation.damping * v[0], self.equation.stiffness * q[0]);
        self.at_work = a[0].abs() + viscous.abs() + elastic.abs();
        r[0] = a[0] + viscous + elastic;
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        if r[0] == 0.0 { 0.0 } else { r[0].abs() / self.at_work }
    }
    fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        let ModalEquation { stiffness, damping } = self.equation;
        self.tangent = w.acceleration + w.velocity * damping + w.position * stiffness;
        if self.tangent == 0.0 { Err(Singular) } else { Ok(()) }
    }
    fn solve(&mut self, x: &mut [f64]) {
        x[0] /= self.tangent;
    }
}

impl PeriodicSystem for Alone {
    fn tangent(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        let ModalEquation { stiffness, damping } = self.equation;
        entry(0, 0, w.acceleration + w.velocity * damping + w.position * stiffness);
    }
}

#[cfg(test)]
mod tests {
    use super::super::NormalModes;
    use super::super::examples::{chain, modal};
    use super::super::periodic::{CrankDrive, DrivenMechanism};
    use super::*;
    use crate::scene::SceneSource;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// The two-point method with ϑ = ½ is the trapezoidal rule: `g = (1 + iωh/2)/(1 − iωh/2)`, so `ω_h = (2/h) atan(ωh/2)`, undamped.
    #[test]
    fn val_the_two_point_method_slows_vibrations_by_the_tangent() -> Tested {
        let (omega, mode) = (30.0_f64, ModalEquation { stiffness: 900.0, damping: 0.0 });
        for step_s in [1e-4, 1e-3, 3e-2, 0.1, 0.15, 0.2] {
            let found = mode.eigenvalue_by(Scheme::TwoPoint(0.5), step_s).ok_or("no step")?;
            let theory = 2.0 / step_s * (0.5 * omega * step_s).atan();
            assert!((found - Complex::new(0.0, theory)).norm() < 1e-9 * omega, "{step_s}: {found} for {theory}");
        }
        assert!(mode.is_beyond(0.106) && !mode.is_beyond(0.104));
        Ok(())
    }

    /// `R(z) = e^z + O(z^(p+1))`, so `λ_h − λ = O(h^p)`.
    #[test]
    fn order_eigenvalues_of_the_schemes_have_theirs() -> Tested {
        let mode = ModalEquation { stiffness: 400.0, damping: 0.8 };
        for (scheme, order) in [
            (Scheme::TwoPoint(0.5), 2),
            (Scheme::TwoPoint(0.6), 1),
            (Scheme::GeneralizedAlpha(0.8), 2),
            (Scheme::RungeKutta, 4),
            (Scheme::Esdirk, 4),
        ] {
            let error = |step_s: f64| mode.eigenvalue_by(scheme, step_s).map(|found| (found - mode.eigenvalue()).norm());
            let [long, short] = [error(2e-2).ok_or("no step")?, error(1e-2).ok_or("no step")?];
            let observed = (long / short).log2();
            assert!((observed - f64::from(order)).abs() < 0.25, "{scheme:?}: {observed}");
        }
        Ok(())
    }

    /// A stiff mode of generalised-α, whose g tends to −ρ∞ (Chung & Hulbert, 1993).
    #[test]
    fn val_a_stiff_mode_has_the_spectral_radius_at_infinity() -> Tested {
        let mode = ModalEquation { stiffness: 1e14, damping: 0.0 };
        let found = mode.eigenvalue_by(Scheme::GeneralizedAlpha(0.8), 1e-2).ok_or("no step")?;
        assert!(((found.re * 1e-2).exp() - 0.8).abs() < 1e-2 && mode.is_beyond(1e-2), "{found}");
        Ok(())
    }

    /// A mode of two decays is known by the slower one.
    #[test]
    fn val_an_overdamped_mode_decays_slowly() -> Tested {
        let mode = ModalEquation { stiffness: 2.0, damping: 3.0 };
        assert!((mode.eigenvalue() + 1.0).norm() < 1e-14, "{}", mode.eigenvalue());
        let found = mode.eigenvalue_by(Scheme::Esdirk, 1e-2).ok_or("no step")?;
        assert!((found + 1.0).norm() < 1e-8, "{found}");
        Ok(())
    }

    /// On a whole crank-slider at rest, the step of every scheme has the eigenvalues that it has on each mode alone.
    #[test]
    fn prop_a_scheme_does_to_a_mechanism_what_it_does_to_its_modes() -> Tested {
        let (scene, step_s) = ("crank-slider", 2e-3);
        let modes = NormalModes::new(&SceneSource::open(scene, &[])?.scene, 0.7, 6)?;
        let mut mechanism = modal(&chain(scene, &[])?, false);
        let mut system = DrivenMechanism::new(&mut mechanism, CrankDrive::Torque { torque_nm: 0.0 });
        let unknowns = system.degrees_of_freedom();
        for scheme in [Scheme::TwoPoint(0.5), Scheme::GeneralizedAlpha(0.8), Scheme::RungeKutta, Scheme::Esdirk] {
            let mut trajectory = Trajectory::new(scheme, unknowns, TIGHT);
            let mut carried = modes.point().q.clone();
            carried.resize(trajectory.carried_len(), 0.0);
            trajectory.begin(&mut system, 0.0, &carried)?;
            trajectory.step(&mut system, 0.0, step_s)?;
            let mut map = trajectory.map();
            balance_parlett_reinsch(&mut map);
            let multipliers = map.complex_eigenvalues();
            for mode in modes.modes().iter().filter(|mode| mode.is_vibration()) {
                let alone = (mode.equation.eigenvalue_by(scheme, step_s).ok_or("no step")? * step_s).exp();
                let nearest = multipliers.iter().map(|g| (g - alone).norm()).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-6, "{scheme:?}, {}: {nearest:e}", mode.mode.name());
            }
        }
        Ok(())
    }
}
