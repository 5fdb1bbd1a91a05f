//! Integration schemes by name and parameter, from which integrators of any number of unknowns are made.

use crate::integrate::{Esdirk, GeneralizedAlpha, Integrator, NewtonSettings, RungeKutta, TwoPoint};
use crate::scene::{IntegratorKind, Solver};

/// A scheme with its parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// The two-point method of this ϑ.
    TwoPoint(f64),
    /// Generalised-α of this ρ∞.
    GeneralizedAlpha(f64),
    /// Runge–Kutta of fourth order, explicit.
    RungeKutta,
    /// ESDIRK4(3)6L\[2\]SA.
    Esdirk,
}

impl Scheme {
    /// The scheme of a scene.
    pub fn of(solver: &Solver) -> Self {
        match solver.integrator {
            IntegratorKind::TwoPoint => Self::TwoPoint(solver.weight),
            IntegratorKind::GeneralizedAlpha => Self::GeneralizedAlpha(solver.rho_infinity),
            IntegratorKind::RungeKutta => Self::RungeKutta,
            IntegratorKind::Esdirk => Self::Esdirk,
        }
    }

    /// The integrator of `unknowns`.
    pub fn integrator(self, unknowns: usize, newton: NewtonSettings) -> Integrator {
        match self {
            Self::TwoPoint(weight) => Integrator::TwoPoint(TwoPoint::new(unknowns, weight, newton)),
            Self::GeneralizedAlpha(rho) => Integrator::GeneralizedAlpha(GeneralizedAlpha::new(unknowns, rho, newton)),
            Self::RungeKutta => Integrator::RungeKutta(RungeKutta::new(unknowns)),
            Self::Esdirk => Integrator::Esdirk(Esdirk::new(unknowns, newton)),
        }
    }

    /// Vectors of the state that decide how it goes on: q and v, with generalised-α also the auxiliary accelerations α.
    ///
    /// Accelerations and residual of the state follow from q and v as long as no load jumps. Predictions of Newton's iteration decide
    /// nothing once it has converged.
    pub fn carried_vectors(self) -> usize {
        if matches!(self, Self::GeneralizedAlpha(_)) { 3 } else { 2 }
    }
}
