//! The interface between integrators and the systems that they advance, and the account of a step.

use std::fmt;
use std::ops::AddAssign;

/// A second-order system of n unknowns, `r(t, q, v, a) = M(t, q) a + g(t, q, v) = 0` with `v = q̇`, `a = q̈`.
///
/// Loads known only as their mean over a step are part of `g`; the owner sets them before the step and holds them during it.
/// Implementations do not allocate.
pub trait System {
    /// n; 0 is possible.
    fn degrees_of_freedom(&self) -> usize;
    /// `r(t, q, v, a)`.
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]);
    /// The largest of `r` relative to the forces at work in the last `residual`; dimensionless.
    fn residual_size(&self, r: &[f64]) -> f64;
    /// Factors `w.acceleration ∂r/∂a + w.velocity ∂r/∂v + w.position ∂r/∂q` at the state given.
    /// The schemes here call it only straight after `residual` with the same `t`, `q`, `v`, `a`, whose kinematics it may reuse.
    ///
    /// # Errors
    /// The matrix has no usable pivot.
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular>;
    /// Solves the last factored system for `x` in place.
    fn solve(&mut self, x: &mut [f64]);
    /// Work of `factor` over that of a correction, `residual` and `solve` together; about.
    fn factor_over_correction(&self) -> f64 {
        1.0
    }
    /// Power put in from outside and power dissipated, which the scheme integrates beside the motion; nil for a system that keeps no
    /// account of it.
    fn power(&mut self, _t_s: f64, _q: &[f64], _v: &[f64], _a: &[f64]) -> Power {
        Power::default()
    }
}

/// Power at one instant, W.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Power {
    /// By loads from outside.
    pub put_in_w: f64,
    /// Lost to damping and friction.
    pub dissipated_w: f64,
}

/// Work of one step, J: the power, integrated by the scheme as it integrates the motion, and so to its order.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Work {
    /// By loads from outside.
    pub put_in_j: f64,
    /// Lost to damping and friction.
    pub dissipated_j: f64,
    /// Magnitude of what was put in, by the motion of the step or by the rates at its ends, whichever is larger. They differ where a
    /// scheme lets the motion lag behind the rates: ϑ = 0 from rest has gained energy before it has moved.
    pub magnitude_j: f64,
}

impl Work {
    /// Adds that of a power over `weight_s`.
    pub(super) fn add(&mut self, weight_s: f64, power: Power) {
        self.put_in_j += weight_s * power.put_in_w;
        self.dissipated_j += weight_s * power.dissipated_w;
    }

    /// The magnitude, where motion and rates belong together.
    pub(super) fn with_magnitude(self, by_rates_j: f64) -> Self {
        Work { magnitude_j: self.put_in_j.abs().max(by_rates_j.abs()), ..self }
    }

    /// Whether all of it is finite.
    pub fn is_finite(&self) -> bool {
        [self.put_in_j, self.dissipated_j, self.magnitude_j].iter().all(|work| work.is_finite())
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Work) {
        self.put_in_j += other.put_in_j;
        self.dissipated_j += other.dissipated_j;
        self.magnitude_j += other.magnitude_j;
    }
}

/// Cost and work of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Taken {
    /// Cost of the step.
    pub effort: Effort,
    /// The work done in it.
    pub work: Work,
    /// Residual that the last correction of a step of fixed cost left, relative to the forces at work; 0 if it was solved to the
    /// tolerance, or to rounding.
    pub left_over: f64,
}

impl AddAssign for Taken {
    fn add_assign(&mut self, other: Taken) {
        self.effort += other.effort;
        self.work += other.work;
        self.left_over = self.left_over.max(other.left_over);
    }
}

/// Weights of the tangent `a ∂r/∂a + v ∂r/∂v + q ∂r/∂q`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Weight of ∂r/∂a.
    pub acceleration: f64,
    /// Weight of ∂r/∂v, s.
    pub velocity: f64,
    /// Weight of ∂r/∂q, s².
    pub position: f64,
}

impl Weights {
    /// The mass matrix alone.
    pub const MASS: Self = Self { acceleration: 1.0, velocity: 0.0, position: 0.0 };
}

/// The tangent could not be factored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular;

/// Everything that a scheme carries from one step to the next: copy it, and the run resumes bit for bit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    /// Coordinates at the present time.
    pub q: Vec<f64>,
    /// Velocities at the present time.
    pub v: Vec<f64>,
    /// Accelerations last solved for. ESDIRK: at the present time. Generalised-α: at the present time, under the load carried on to
    /// it. Two-point: at the last point of collocation. Runge–Kutta: at the beginning of the last step. Published accelerations come
    /// from [`solve_acceleration`].
    pub a: Vec<f64>,
    /// ESDIRK's prediction of accelerations at the middle of the next step; generalised-α's auxiliary accelerations; the two-point
    /// method's mean accelerations between the last two collocation points; velocities of Runge–Kutta's last stage.
    pub alpha: Vec<f64>,
    /// Residual at the end of the last step of ESDIRK and generalised-α, against which a jump of the load shows; accelerations
    /// of Runge–Kutta's last stage; zero with the two-point method.
    pub residual: Vec<f64>,
}

impl State {
    /// A state to begin from; every scheme finds its accelerations by itself.
    pub fn new(q: Vec<f64>, v: Vec<f64>) -> Self {
        let zero = vec![0.0; q.len()];
        Self { q, v, a: zero.clone(), alpha: zero.clone(), residual: zero }
    }
}

/// Cost of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Evaluations of the residual.
    pub residuals: u32,
    /// Newton iterations: corrections solved for.
    pub newton_iterations: u32,
    /// Factorizations.
    pub factorizations: u32,
}

impl AddAssign for Effort {
    fn add_assign(&mut self, other: Effort) {
        self.residuals += other.residuals;
        self.newton_iterations += other.newton_iterations;
        self.factorizations += other.factorizations;
    }
}

/// The error of one step, from a vector that the scheme leaves behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ErrorTerm<'a> {
    /// The vector times the factor.
    Direct(&'a [f64], f64),
    /// The change of the vector since the step before, times the factor: one order more. The vector itself grows as the last number,
    /// a power of the step, which tells its change where steps differ.
    Difference(&'a [f64], f64, f64),
}

impl<'a> ErrorTerm<'a> {
    /// Its vector.
    pub fn vector(&self) -> &'a [f64] {
        let (Self::Direct(vector, _) | Self::Difference(vector, ..)) = self;
        vector
    }
}

/// Leading error of the last step, solution less truth, of coordinates and velocities: exact for linear systems, as the step goes to 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalError<'a> {
    /// Error of the coordinates.
    pub q: ErrorTerm<'a>,
    /// Error of the velocities.
    pub v: ErrorTerm<'a>,
}

/// Why a step was not taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepError {
    /// Newton's iteration did not reach its tolerance.
    NotConverged {
        /// Relative size of the last residual.
        residual: f64,
        /// Iterations spent.
        iterations: u32,
    },
    /// The tangent could not be factored.
    Singular,
    /// A number stopped being finite.
    NotFinite,
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConverged { residual, iterations } => {
                write!(f, "Newton's iteration did not converge: relative residual {residual:.1e} after {iterations} iterations")
            }
            Self::Singular => f.write_str("the tangent matrix is singular"),
            Self::NotFinite => f.write_str("a number stopped being finite"),
        }
    }
}

impl std::error::Error for StepError {}

impl From<Singular> for StepError {
    fn from(_: Singular) -> Self {
        Self::Singular
    }
}

/// Accelerations at a state, `M a = −g`, for the stages of explicit schemes and for published values.
/// Costs one residual, one factorization and one solution; `scratch` has length n.
///
/// # Errors
/// The mass matrix is singular, or a number is not finite; `a` is then meaningless.
#[inline]
pub fn solve_acceleration<S: System>(
    system: &mut S,
    t_s: f64,
    q: &[f64],
    v: &[f64],
    a: &mut [f64],
    scratch: &mut [f64],
) -> Result<(), StepError> {
    if a.is_empty() {
        return Ok(());
    }
    a.fill(0.0);
    system.residual(t_s, q, v, a, scratch);
    system.factor(t_s, q, v, a, Weights::MASS)?;
    system.solve(scratch);
    for (a, x) in a.iter_mut().zip(scratch.iter()) {
        *a = -x;
    }
    all_finite(a)
}

/// `Err(NotFinite)` unless every number of `x` is finite.
#[inline]
pub(super) fn all_finite(x: &[f64]) -> Result<(), StepError> {
    // All of them, which is quicker than to stop at the first that is not.
    if x.iter().fold(true, |all, x| all & x.is_finite()) { Ok(()) } else { Err(StepError::NotFinite) }
}
