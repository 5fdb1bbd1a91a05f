//! The status of a service, from the states of its run and of its recording.

use super::output_worker::OutputWorker;
use crate::runtime::{DurationQuantiles, OverrunCounts, RunStatus};
use crate::wire::{self, Histogram, Status, status::State};

impl OutputWorker {
    /// Joins the state of the run with that of the output.
    pub(super) fn joined_status(&self, run: RunStatus) -> Status {
        let OverrunCounts { missed, pacing_epoch, given_up } = run.overruns;
        let (lateness, lateness_bins) = run.lateness.unzip();
        let (step_cost, step_cost_bins) = run.step_cost.unzip();
        let ages = &self.statistics.sample_age;
        let [sample_age_p50_s, sample_age_p99_s, sample_age_p999_s, sample_age_max_s] = each(ages.quantiles());
        let [step_cost_p50_s, step_cost_p99_s, step_cost_p999_s, step_cost_max_s] = each(step_cost);
        Status {
            stamp: Some(wire::stamp(&run.stamp)),
            state: State::from(run.phase).into(),
            real_time_factor: run.real_time_factor,
            overruns: missed,
            dropped_samples: run.dropped,
            step_error_p50_rad: run.step_errors.map(|all| all.p50_rad),
            step_error_p99_rad: run.step_errors.map(|all| all.p99_rad),
            step_error_max_rad: run.step_errors.map(|all| all.max_rad),
            solver_iterations: run.solver.newton_iterations,
            message: self.warnings().chain(run.message).collect::<Vec<_>>().join("; "),
            commands_accepted: self.statistics.commands_accepted,
            commands_rejected: self.shared.rejected(),
            pulses_pending: u32::try_from(run.pulses_pending).unwrap_or(u32::MAX),
            recording: self.recorder.as_ref().map(|recorder| recorder.path().display().to_string()),
            setpoint_nm: run.setpoint.held.map(|held| held.torque_nm),
            setpoints_expired: run.setpoint.expirations,
            retried_steps: run.solver.retried_steps,
            unconverged_steps: run.solver.unconverged_steps,
            step_cost_p50_s,
            step_cost_p99_s,
            step_cost_p999_s,
            step_cost_max_s,
            lateness: lateness_bins.map(Histogram::from),
            step_cost: step_cost_bins.map(Histogram::from),
            sample_age_p50_s,
            sample_age_p99_s,
            sample_age_p999_s,
            sample_age_max_s,
            sample_age: ages.bins().map(Histogram::from),
            pacing_epoch,
            given_up_s: given_up.as_secs_f64(),
            drops: self.drops.totals(),
            spin_s: run.spin.map(|spin| spin.as_secs_f64()),
            ..with_lateness(lateness).with_account(run.account).at_level(self.in_force.context.level.as_ref())
        }
    }
}

impl OutputWorker {
    /// Failures on other threads.
    fn warnings(&self) -> impl Iterator<Item = String> {
        let lost = self.beside.best_level.as_ref().and_then(|thread| thread.lost.clone());
        self.recordings.failure.clone().into_iter().chain(lost)
    }
}

/// A status with quantiles of the lateness, and nothing else.
pub(super) fn with_lateness(lateness: Option<DurationQuantiles>) -> Status {
    let [lateness_p50_s, lateness_p99_s, lateness_p999_s, lateness_max_s] = each(lateness);
    Status { lateness_p50_s, lateness_p99_s, lateness_p999_s, lateness_max_s, ..Status::default() }
}

fn each(quantiles: Option<DurationQuantiles>) -> [Option<f64>; 4] {
    quantiles.map_or([None; 4], |DurationQuantiles { p50_s, p99_s, p999_s, max_s }| [p50_s, p99_s, p999_s, max_s].map(Some))
}
