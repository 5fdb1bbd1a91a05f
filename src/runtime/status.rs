//! The state of a run, as its stepping thread reports it.

use std::time::Duration;

use super::duration_histogram::{DurationBins, DurationQuantiles};
use super::step_error_histogram::StepErrorQuantiles;
use crate::simulation::{Account, SetpointState, Stamp};

/// Whether a run goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunPhase {
    /// It takes steps.
    Running,
    /// It waits for commands.
    Paused,
    /// It has ended in good order.
    Finished,
    /// It has diverged.
    Diverged,
}

/// The state of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunStatus {
    /// When this was the state.
    pub stamp: Stamp,
    /// Whether it is running.
    pub phase: RunPhase,
    /// Why the run stopped, or a warning of the model.
    pub message: Option<String>,
    /// Simulated over wall time since the last start, resume or reset; `None` while paused.
    pub real_time_factor: Option<f64>,
    /// Lateness of steps; `None` if there are no deadlines.
    pub lateness: Option<(DurationQuantiles, DurationBins)>,
    /// Cost of steps.
    pub step_cost: Option<(DurationQuantiles, DurationBins)>,
    /// Estimated errors of single steps.
    pub step_errors: Option<StepErrorQuantiles>,
    /// Missed deadlines.
    pub overruns: OverrunCounts,
    /// Samples and messages dropped so far.
    pub dropped: u64,
    /// Busy-waiting time before a deadline; `None` if there are no deadlines.
    pub spin: Option<Duration>,
    /// Energies, works and estimated error.
    pub account: Account,
    /// Counts of the solver.
    pub solver: SolverCounts,
    /// Torque pulses that are pending or active.
    pub pulses_pending: usize,
    /// The setpoint and its watchdog.
    pub setpoint: SetpointState,
}

/// Counts of the solver.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SolverCounts {
    /// Newton iterations of the last step; `None` with a scheme that does not iterate.
    pub newton_iterations: Option<u32>,
    /// Steps that failed and were repeated in parts.
    pub retried_steps: u64,
    /// Steps of fixed cost that left more than the scene's tolerance.
    pub unconverged_steps: u64,
}

/// Missed deadlines of a run, and what became of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OverrunCounts {
    /// Missed deadlines.
    pub missed: u64,
    /// Number of times the deadlines were moved.
    pub pacing_epoch: u64,
    /// Sum of all shifts of the deadlines.
    pub given_up: Duration,
}
