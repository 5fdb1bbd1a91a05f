//! Errors of the search for the number of corrections.

use super::limits::MOST_CORRECTIONS;
use crate::simulation::{BuildError, Diverged, PulseRefused};

/// No number of corrections suffices.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotRated {
    /// The model cannot compute the scene.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The scene diverges even with steps to the tolerance.
    #[error("the scene diverges even with steps to its tolerance: {0}")]
    Diverged(#[from] Diverged),
    /// The scene refuses the test pulse.
    #[error("the scene refuses the pulse that tests its steps: {0}")]
    Pulse(PulseRefused),
    /// Nothing moves, so that every number is as good.
    #[error(
        "nothing moves in this scene within {until_s} s, which any number of corrections computes: give it {loads} like those that it \
         will have, or name solver.corrections and solver.tolerance as found with them"
    )]
    Still {
        /// Simulated duration, s.
        until_s: f64,
        /// The loads that it takes.
        loads: &'static str,
    },
    /// The iteration with one matrix a step does not converge.
    #[error(
        "no steps of fixed cost: {MOST_CORRECTIONS} corrections a stage do not suffice, because one matrix a step does not serve \
         all of them; a shorter solver.step_s may"
    )]
    TooSlow,
}
