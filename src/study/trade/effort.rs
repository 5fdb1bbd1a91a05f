//! The counted work of a run.

/// Work done in a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RunEffort {
    /// Steps.
    pub steps: u64,
    /// Evaluations of the residual.
    pub residuals: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Factorizations.
    pub factorizations: u64,
    /// Steps that failed and were repeated in parts.
    pub retried: u64,
}
