//! Status messages and reports of dropped samples.

use std::time::Duration;

use super::Stepper;
use crate::runtime::output::Output;
use crate::runtime::pacer::Pace;
use crate::runtime::rate::PublishRate;
use crate::simulation::EnergyVerdict;
use crate::wire::{self, Status, status::State};

/// Wall time between two status messages.
pub(super) const STATUS_PERIOD: Duration = Duration::from_millis(500);
/// Status messages per simulated second when the pace is not real time.
const STATUS_RATE: PublishRate = PublishRate::Hz(2.0);

impl Stepper {
    pub(super) fn status_if_due(&mut self) {
        if self.clock.elapsed() >= self.schedule.next_status {
            self.status(if self.run.paused { State::Paused } else { State::Running }, String::new());
        }
    }

    /// Publishes a status every half simulated second if the pace is not real time. It follows the step count, not the clock. The
    /// last status is published by the end of the run.
    pub(super) fn status_by_simulated_time(&mut self) {
        let real = self.stepping.pace == Pace::Factor(1.0) && !self.run.paused;
        let due = !real && STATUS_RATE.is_due(self.simulation.step_count(), self.simulation.step_s());
        if !due || self.finished() {
            return;
        }
        let begun = self.clock.elapsed();
        self.status(if self.run.paused { State::Paused } else { State::Running }, String::new());
        self.deadlines.timings.sending += self.clock.elapsed().saturating_sub(begun);
    }

    /// Reports the samples dropped since the last report.
    pub(super) fn report_missed_samples(&mut self) {
        let missed = std::mem::take(&mut self.drops.unreported);
        if missed.iter().any(Option::is_some) {
            let stamp = self.stamp();
            self.send(Output::MissedSamples(missed, stamp));
        }
    }

    pub(super) fn status(&mut self, state: State, message: String) {
        self.report_missed_samples();
        let now = self.clock.elapsed();
        self.schedule.next_status = now + STATUS_PERIOD;
        let message = if message.is_empty() { self.warning() } else { message };
        let errors = self.statistics.step_errors.quantiles();
        let (lateness, cost) = (self.statistics.lateness.quantiles(), self.statistics.step_cost.quantiles());
        let stamp = self.stamp();
        let status = Status {
            stamp: Some(wire::stamp(&stamp)),
            state: state.into(),
            real_time_factor: if self.run.paused { None } else { self.deadlines.pacer.real_time_factor(now, self.session_s()) },
            lateness_p50_s: lateness.map(|all| all.p50_s),
            lateness_p99_s: lateness.map(|all| all.p99_s),
            lateness_p999_s: lateness.map(|all| all.p999_s),
            lateness_max_s: lateness.map(|all| all.max_s),
            overruns: self.deadlines.overruns,
            dropped_samples: self.drops.count + self.ports.shared.dropped(),
            step_error_p50_rad: errors.map(|all| all.p50_rad),
            step_error_p99_rad: errors.map(|all| all.p99_rad),
            step_error_max_rad: errors.map(|all| all.max_rad),
            solver_iterations: self.simulation.newton_iterations(),
            message,
            pulses_pending: u32::try_from(self.simulation.pulses_pending()).unwrap_or(u32::MAX),
            recording: None,
            retried_steps: self.simulation.retried(),
            step_cost_p50_s: cost.map(|all| all.p50_s),
            step_cost_p99_s: cost.map(|all| all.p99_s),
            step_cost_p999_s: cost.map(|all| all.p999_s),
            step_cost_max_s: cost.map(|all| all.max_s),
            lateness: self.statistics.lateness.histogram(),
            step_cost: self.statistics.step_cost.histogram(),
            pacing_epoch: self.deadlines.pacing_epoch,
            given_up_s: self.deadlines.given_up.as_secs_f64(),
            drops: Vec::new(),
            spin_s: self.has_deadlines().then_some(self.spin.as_secs_f64()),
            ..Status::default()
        }
        .with_account(&self.simulation);
        self.send(Output::Status(Box::new(status), stamp));
    }

    /// The warning of the status message: shadow lost, energy out of balance, or deflections out of range.
    fn warning(&self) -> String {
        if let Some(diverged) = self.shadow.as_ref().and_then(|shadow| shadow.lost()) {
            return format!("the shadow {diverged}");
        }
        if let EnergyVerdict::Unbalanced { worst_j, in_play_j } = self.simulation.energy_verdict() {
            return unbalanced(worst_j, in_play_j);
        }
        if self.statistics.worst_out_of_range > 0.0 {
            return format!(
                "out of the model's range: a link was worst_out_of_range by {:.1} % of its length",
                100.0 * self.statistics.worst_out_of_range
            );
        }
        String::new()
    }
}

/// The warning that the energy balance of a run was off.
pub(crate) fn unbalanced(worst_j: f64, in_play_j: f64) -> String {
    let part = worst_j / in_play_j;
    format!("not to be trusted: the energy balance was off by {worst_j:.2e} J, {part:.1e} of the {in_play_j:.2e} J in play")
}
