//! The cost of a step.

use std::time::Duration;

/// Time that a step took.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepCost {
    /// Until the step was done.
    pub wall: Duration,
    /// In the solver of the level that is in force afterwards.
    pub own: Duration,
}
