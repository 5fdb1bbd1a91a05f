//! The status of a service, from the states of its run and of its recording.

use crate::runtime::{DurationQuantiles, DurationSummary, OverrunCounts, RunStatus, SharedState};
use crate::wire::{self, Status, TopicDrops};

/// What the output thread knows of a service.
pub(super) struct OutputStatus<'a> {
    /// File of the recording, if one runs.
    pub recording: Option<String>,
    /// Why the last recording ended early.
    pub recording_failure: Option<String>,
    pub drops: Vec<TopicDrops>,
    pub shared: &'a SharedState,
}

/// Joins the states of run and output.
pub(super) fn status(run: RunStatus, output: OutputStatus) -> Status {
    let OverrunCounts { missed, pacing_epoch, given_up } = run.overruns;
    let [lateness, cost] = [&run.lateness, &run.step_cost].map(|summary| summary.as_ref().map(|summary| summary.quantiles));
    let [step_cost_p50_s, step_cost_p99_s, step_cost_p999_s, step_cost_max_s] = each(cost);
    let histogram = |summary: Option<DurationSummary>| summary.map(|summary| summary.histogram);
    Status {
        stamp: Some(wire::stamp(&run.stamp)),
        state: run.state.into(),
        real_time_factor: run.real_time_factor,
        overruns: missed,
        dropped_samples: run.dropped,
        step_error_p50_rad: run.step_errors.map(|all| all.p50_rad),
        step_error_p99_rad: run.step_errors.map(|all| all.p99_rad),
        step_error_max_rad: run.step_errors.map(|all| all.max_rad),
        solver_iterations: run.newton_iterations,
        message: output.recording_failure.into_iter().chain(run.message).collect::<Vec<_>>().join("; "),
        commands_accepted: output.shared.accepted(),
        commands_rejected: output.shared.rejected(),
        pulses_pending: u32::try_from(run.pulses_pending).unwrap_or(u32::MAX),
        recording: output.recording,
        retried_steps: run.retried_steps,
        step_cost_p50_s,
        step_cost_p99_s,
        step_cost_p999_s,
        step_cost_max_s,
        lateness: histogram(run.lateness),
        step_cost: histogram(run.step_cost),
        pacing_epoch,
        given_up_s: given_up.as_secs_f64(),
        drops: output.drops,
        spin_s: run.spin.map(|spin| spin.as_secs_f64()),
        ..with_lateness(lateness).with_account(run.account)
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
