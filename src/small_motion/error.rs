//! Errors of the search for periodic motion and of its multipliers.

use crate::integrate::StepError;
use crate::shown::shown_s;

/// Why no periodic motion, or no multipliers of it, were found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FloquetError {
    /// The period or the number of steps is no positive, finite number.
    #[error("the period must be positive and have at least one step")]
    NoPeriod,
    /// The guess has the wrong number of coordinates.
    #[error("the guess has {given} coordinates or velocities instead of {needed}")]
    WrongLength {
        /// Length given.
        given: usize,
        /// Degrees of freedom.
        needed: usize,
    },
    /// A step failed: the equations are singular there, or the motion leaves every bound.
    #[error("no periodic motion was found: the step at {} s failed on the way to it: {cause}", shown_s(*time_s))]
    Step {
        /// Beginning of the step.
        time_s: f64,
        /// Reason.
        cause: StepError,
    },
    /// A free crank does not turn by whole turns in a period.
    #[error("the crank turns by {turns:.3} turns in a period; a better guess or an explicit `advance` is needed")]
    NoTurn {
        /// Turns of the crank along the guess.
        turns: f64,
    },
    /// The equations at the end of a period differ from those at its beginning, so that small motion does not repeat.
    #[error("the system does not repeat after a period: its accelerations differ by a part of {mismatch:.1e}")]
    NotPeriodic {
        /// Difference of accelerations, as a part of the largest.
        mismatch: f64,
    },
    /// Newton's method on the state did not converge, from the guess and by way of lower speeds.
    #[error("no periodic motion was found: after a turn, the state misses itself by {residual:.1e}, and no correction helps")]
    NotConverged {
        /// See [`Orbit::residual`](super::orbit::Orbit::residual).
        residual: f64,
        /// Iterations spent.
        iterations: u32,
    },
    /// A number stopped being finite.
    #[error("a number stopped being finite")]
    NotFinite,
    /// The eigenvalue iteration did not converge.
    #[error("the eigenvalues of the monodromy matrix were not found")]
    NoEigenvalues,
}
