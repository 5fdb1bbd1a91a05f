//! Time integrators, one file a scheme. They know nothing of beams: only a [`System`] `r(t, q, q̇, q̈) = 0`.
//!
//! A step is transactional (on `Err` the state is as it was), allocates nothing, and depends on nothing but its arguments, so
//! that a run resumed from a copied [`State`] goes on bit for bit. The step is meant to stay the same from one to the next.
//!
//! A load that the owner holds constant during a step (a torque pulse's mean over it) delivers exactly load × step: within that
//! step by [`TwoPoint`], [`RungeKutta`] and [`Esdirk`], spread over the next few by [`GeneralizedAlpha`].
//!
//! | scheme | order | for |
//! |---|---|---|
//! | [`Esdirk`] | 4 | small errors on every model; forgets what the step does not resolve |
//! | [`GeneralizedAlpha`] | 2 | the cheapest step of stiff systems whose fast vibrations the step does not resolve |
//! | [`TwoPoint`] ϑ = ½ | 2 | long times without damping, where the step resolves what is excited |
//! | [`TwoPoint`] ϑ ≠ ½ | 1 | comparison with the thesis |
//! | [`RungeKutta`] | 4 | systems that are not stiff |
//!
//! **Law.** Every scheme keeps `|R(z)| ≤ 1` on the left half of the plane, Runge–Kutta inside its region, the two-point method for
//! ϑ ≥ ½. A composition of real steps that is of more than second order has a part that runs backwards (Sheng 1989, Suzuki 1991),
//! and a pole for a decaying mode: the composed midpoint rule that stood here let damped chains stand still at some steps.
//!
//! **Why ESDIRK4(3)6L\[2\]SA.** Error of the crank's angle over 2 s, rad, and cost of a step beside the composed rule's (with its
//! projection) and generalised-α's, taking turns on one core:
//!
//! | | 2 ms | 1 ms | 0.5 ms | 0.2 ms | cost |
//! |---|---|---|---|---|---|
//! | default scene | 6e-6 | 2.6e-6 | 1.1e-7 | 7e-9 | 0.5 composed, 2.3 generalised-α |
//! | R2s, 16 elements a link (consistent mass) | | 1.6e-4 | 1.7e-5 | | 3.2 generalised-α |
//!
//! With the coefficients of 2016 (ESDIRK4(3)6L\[2\]SA₂, γ = 31/125) the errors were 2.7e-5, 1.1e-6 and 2.9e-8 on the first row and
//! alike on the second, at 2 to 10 % more iterations. Not tried: seven stages, Rosenbrock methods, Radau IIA of order 5.
//!
//! **Fewer evaluations were tried.** Hairer & Wanner (IV.8) end a stage after one correction where earlier corrections left little
//! enough. With the slowest of the same step's earlier stages as the measure, a step with Newton's tolerance at 1e-6 took 6 % less time,
//! with the default tolerance none. But a chain of ever stiffer links then no longer converged to the rigid one (6.7e-4, 7.3e-6,
//! 1.1e-4 rad): a stiff link's residual does not fall in one stage as it did in another. Cubic instead of parabolic predictions of the
//! last two stages needed 1 to 8 % more corrections.
//!
//! **A load that jumps** is what its explicit first stage does not see. Angular impulse that two free, flexible links lack after pulses of
//! up to 4 kN·m at 0.2 ms, each spread over its steps, and the error of a stiff chain (R1) at 1 ms:
//!
//! | | impulse | R1, rad |
//! |---|---|---|
//! | stages 3 to 5 carry the jump | 0.6 | |
//! | first stage with `a + M⁻¹ Δp`, later ones predicted with the velocity before | 0.014 | 2.5e-5 |
//! | an eighth of the step by SDIRK3, then ESDIRK (as it is, for large jumps) | 0.0045 | 1e-6 |
//!
//! With steps cut at the edges of pulses, as they are now, the pulses are stronger and the last row lacks 0.023.
//!
//! SDIRK4 (Hairer & Wanner, *Solving Ordinary Differential Equations II*, IV.6) for the whole step lacked 0.01, but its weights of up to 8
//! multiply Newton's tolerance, and the order of a rigid chain fell. The present scheme takes every step of R2 with 8 to 64 elements at 1 and
//! 0.2 ms without a retry.
//!
//! Undamped, ϑ = ½ breaks down where a load excites what the step cannot resolve: a step torque on chains of 4 to 64 beam
//! elements a link at h = 1 ms ends in a failed step within 1.3 s; generalised-α with ρ∞ from 0.5 to 0.9 takes every step in 3
//! to 4 iterations.
//!
//! **Gauss's method of two stages** (fourth order, undamped; Hairer, Lubich & Wanner, *Geometric Numerical Integration*, II.1) was
//! built, its stages coupled by one real matrix, and measured on R2s; error of the crank's angle over 2 s, in rad, and instructions
//! for them, both solved to 1e-9:
//!
//! | | Gauss | generalised-α |
//! |---|---|---|
//! | modal, 3 modes | 7.5e-4, h = 2 ms, 2.9e8 | 7.0e-4, h = 0.3 ms, 3.5e8 |
//! | 24 elements a link | 9.8e-6, h = 0.2 ms, 1.8e10 | 6.7e-6, h = 0.04 ms, 1.2e10 |
//!
//! A step took 7 to 11 iterations of two residuals and two solutions, against one of one. Membrane vibration that the step does
//! not resolve took its order: 1.7e-4, 1.1e-4, 5.3e-5, 1.5e-5 at 2, 1, 0.5 and 0.25 ms.

mod beginning;
mod corner;
mod dirk;
mod esdirk;
mod fixed_cost;
mod generalized_alpha;
mod newton;
mod runge_kutta;
mod sdirk;
mod system;
mod two_point;

pub use esdirk::Esdirk;
pub use fixed_cost::FixedCost;
pub use generalized_alpha::GeneralizedAlpha;
pub use newton::NewtonSettings;
pub use runge_kutta::RungeKutta;
pub use system::{
    Effort, ErrorTerm, LocalError, Power, Singular, State, StepError, System, Taken, Weights, Work, solve_acceleration,
};
pub use two_point::TwoPoint;

/// One of the schemes, chosen at run time.
#[derive(Debug, Clone)]
pub enum Integrator {
    /// The two-point method of weight ϑ.
    TwoPoint(TwoPoint),
    /// Generalised-α of a given ρ∞.
    GeneralizedAlpha(GeneralizedAlpha),
    /// Classical explicit Runge–Kutta, fourth order.
    RungeKutta(RungeKutta),
    /// Diagonally implicit Runge–Kutta, fourth order.
    Esdirk(Esdirk),
}

impl Integrator {
    /// The scheme with steps of fixed cost; a scheme that does not iterate has them as it is.
    pub fn with_fixed_cost(mut self, fixed: Option<FixedCost>) -> Self {
        match &mut self {
            Self::TwoPoint(scheme) => scheme.set_fixed_cost(fixed),
            Self::GeneralizedAlpha(scheme) => scheme.set_fixed_cost(fixed),
            Self::Esdirk(scheme) => scheme.set_fixed_cost(fixed),
            Self::RungeKutta(_) => {}
        }
        self
    }

    /// Gives a new state what the scheme needs to begin from it, in steps of `h_s`, under the loads present; those that come with the
    /// first step are loads that begin there.
    ///
    /// # Errors
    /// [`StepError`] when accelerations cannot be solved for.
    pub fn begin<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<(), StepError> {
        match self {
            Self::Esdirk(scheme) => scheme.begin(system, t_s, h_s, state),
            Self::TwoPoint(_) | Self::GeneralizedAlpha(_) | Self::RungeKutta(_) => Ok(()),
        }
    }

    /// Leading error of the last step, of `h_s`.
    pub fn local_error(&self, h_s: f64) -> LocalError<'_> {
        match self {
            Self::TwoPoint(scheme) => scheme.local_error(h_s),
            Self::GeneralizedAlpha(scheme) => scheme.local_error(h_s),
            Self::RungeKutta(scheme) => scheme.local_error(h_s),
            Self::Esdirk(scheme) => scheme.local_error(h_s),
        }
    }

    /// Error of the velocity that a corner of the acceleration in the last step, of h, leaves for good: solution less truth, over `J h²`. The
    /// corner is at `part` of the step, 0 to 1, and J the jump of da/dt there in time. It comes on top of what the terms of
    /// [`Integrator::local_error`] add up to over that step and the next ones; exact as the step goes to 0.
    pub fn corner_error(&self, part: f64) -> f64 {
        match self {
            Self::TwoPoint(scheme) => scheme.corner_error(part),
            Self::GeneralizedAlpha(_) => GeneralizedAlpha::corner_error(part),
            Self::RungeKutta(_) => RungeKutta::corner_error(part),
            Self::Esdirk(scheme) => scheme.corner_error(part),
        }
    }

    /// Advances `state` from `t_s` to `t_s + h_s`.
    ///
    /// # Errors
    /// See [`StepError`]; the state is then as it was.
    #[inline]
    pub fn step<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<Taken, StepError> {
        match self {
            Self::TwoPoint(scheme) => scheme.step(system, t_s, h_s, state),
            Self::GeneralizedAlpha(scheme) => scheme.step(system, t_s, h_s, state),
            Self::RungeKutta(scheme) => scheme.step(system, t_s, h_s, state),
            Self::Esdirk(scheme) => scheme.step(system, t_s, h_s, state),
        }
    }
}
