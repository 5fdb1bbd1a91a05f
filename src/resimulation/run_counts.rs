//! Counts since the run began, which a status states and the re-simulation repeats as far as it saw the run.

use crate::runtime::{StepErrorHistogram, setpoint_warning, warning};
use crate::simulation::Simulation;
use crate::wire::{Status, status::State};

/// Beginnings of warnings that only the service knows: of its recording, its shadow, and its deadlines.
const OF_THE_SERVICE: [&str; 2] = ["recording stopped", "the shadow"];
/// Part of the message of a run that ended at a missed deadline.
const LATE: &str = "would have begun";

/// The counts, as far as they are known.
pub(super) struct RunCounts {
    /// Whether the Newton iterations of the last step are known.
    newton: bool,
    /// Retried steps of the run beside those of the re-simulation.
    retried_before: Option<u64>,
    /// Unconverged steps of the run beside those of the re-simulation.
    unconverged_before: Option<u64>,
    /// Estimated errors of all steps of the run; `None` if steps are missing.
    step_errors: Option<StepErrorHistogram>,
    /// Largest bending beyond the model's range in any sample; `None` if samples are missing.
    worst_out_of_range: Option<f64>,
}

impl RunCounts {
    /// Counts of a run that begins here.
    pub(super) fn of_new_run() -> Self {
        RunCounts {
            newton: true,
            retried_before: Some(0),
            unconverged_before: Some(0),
            step_errors: StepErrorHistogram::new().ok(),
            worst_out_of_range: Some(0.0),
        }
    }

    /// Counts of a run that began earlier.
    pub(super) fn of_old_run() -> Self {
        RunCounts { newton: false, retried_before: None, unconverged_before: None, step_errors: None, worst_out_of_range: None }
    }

    /// Forgets the counts that a dropped sample may have changed.
    pub(super) fn samples_are_missing(&mut self) {
        self.worst_out_of_range = None;
    }

    /// Adds a step.
    pub(super) fn stepped(&mut self, simulation: &Simulation) {
        self.newton = true;
        if let Some((errors, error)) = self.step_errors.as_mut().zip(simulation.error_estimate()) {
            errors.record(error.last_step_rad);
        }
    }

    /// Adds a sample that bends a link beyond the model's range.
    pub(super) fn sampled(&mut self, out_of_range: Option<f64>) {
        self.worst_out_of_range = self.worst_out_of_range.map(|worst| worst.max(out_of_range.unwrap_or(0.0)));
    }

    /// Replaces the fields of a recorded status that are known. `diverged` is the divergence in words, if the run ended so.
    pub(super) fn replace(&mut self, recorded: &Status, simulation: &Simulation, diverged: Option<&str>) -> Status {
        let mut status = recorded.clone();
        status.pulses_pending = u32::try_from(simulation.pulses_pending()).unwrap_or(u32::MAX);
        let setpoint = simulation.setpoint();
        status.setpoint_nm = setpoint.held.map(|held| held.torque_nm);
        status.setpoints_expired = setpoint.expirations;
        if self.newton {
            status.solver_iterations = simulation.newton_iterations();
        }
        let before = *self.retried_before.get_or_insert(recorded.retried_steps.wrapping_sub(simulation.retried()));
        status.retried_steps = before.wrapping_add(simulation.retried());
        let unconverged = recorded.unconverged_steps.wrapping_sub(simulation.unconverged());
        let before = *self.unconverged_before.get_or_insert(unconverged);
        status.unconverged_steps = before.wrapping_add(simulation.unconverged());
        if let Some(errors) = &self.step_errors {
            let quantiles = errors.quantiles();
            status.step_error_p50_rad = quantiles.map(|all| all.p50_rad);
            status.step_error_p99_rad = quantiles.map(|all| all.p99_rad);
            status.step_error_max_rad = quantiles.map(|all| all.max_rad);
        }
        if let Some(message) = self.message(recorded, simulation, diverged) {
            status.message = message;
        }
        status
    }

    /// The message of a status; `None` if only the service knows it.
    fn message(&self, recorded: &Status, simulation: &Simulation, diverged: Option<&str>) -> Option<String> {
        let stated = &recorded.message;
        let late = recorded.state() == State::Finished && stated.contains(LATE);
        if late || OF_THE_SERVICE.iter().any(|beginning| stated.starts_with(beginning)) {
            return None;
        }
        let verdict = simulation.energy_verdict();
        let known = diverged.map(str::to_owned).or_else(|| warning(verdict, self.worst_out_of_range.unwrap_or(0.0)));
        if known.is_none() && self.worst_out_of_range.is_none() && warning_of_range(stated) {
            return None;
        }
        Some(known.or_else(|| setpoint_warning(simulation.setpoint())).unwrap_or_default())
    }
}

fn warning_of_range(stated: &str) -> bool {
    stated.starts_with("out of the model's range")
}
