//! Checkpoints, status messages, and reports of dropped samples.

use std::time::Duration;

use super::{CHECKPOINT_PERIOD_S, Stepper};
use crate::runtime::duration_histogram::DurationHistogram;
use crate::runtime::output::Output;
use crate::runtime::pacer::Pace;
use crate::runtime::status::{RunPhase, RunStatus, SolverCounts};
use crate::simulation::{Checkpoint, EnergyVerdict, PerTelemetry, PublishRate, SetpointState, Stamp};

/// Wall time between two status messages.
pub const STATUS_PERIOD: Duration = Duration::from_millis(500);
/// Status messages per simulated second when the pace is not real time.
const STATUS_RATE: PublishRate = PublishRate::Hz(2.0);

impl Stepper {
    pub(super) fn status_if_due(&mut self) {
        if self.clock.elapsed() >= self.schedule.next_status {
            self.status(self.phase(), None);
        }
    }

    /// Publishes a status every half simulated second if the pace is not real time. It follows the step count, not the clock. The
    /// last status is published by the end of the run.
    pub(super) fn status_by_simulated_time(&mut self) {
        let real = self.stepping.pace == Pace::Factor(1.0) && !self.run.paused;
        let due = !real && STATUS_RATE.is_due(self.simulation.step_count(), &self.simulation.grid());
        if !due || self.finished() {
            return;
        }
        let begun = self.clock.elapsed();
        self.status(self.phase(), None);
        self.deadlines.timings.sending += self.clock.elapsed().saturating_sub(begun);
    }

    /// Reports the samples dropped since the last report.
    pub(super) fn report_missed_samples(&mut self) {
        let missed = std::mem::take(&mut self.drops.unreported);
        if missed != PerTelemetry::default() {
            let stamp = self.stamp();
            self.send(Output::MissedSamples(Box::new(missed), stamp));
        }
    }

    pub(super) fn phase(&self) -> RunPhase {
        if self.run.paused { RunPhase::Paused } else { RunPhase::Running }
    }

    pub(super) fn status(&mut self, phase: RunPhase, message: Option<String>) {
        self.report_missed_samples();
        let now = self.clock.elapsed();
        self.schedule.next_status = now + STATUS_PERIOD;
        let summary = |durations: &DurationHistogram| durations.quantiles().zip(durations.bins());
        let status = RunStatus {
            stamp: self.stamp(),
            phase,
            message: message.or_else(|| self.warning()),
            real_time_factor: if self.run.paused { None } else { self.deadlines.pacer.real_time_factor(now, self.session_s()) },
            lateness: summary(&self.statistics.lateness),
            step_cost: summary(&self.statistics.step_cost),
            step_errors: self.statistics.step_errors.quantiles(),
            overruns: self.deadlines.overruns,
            dropped: self.drops.count + self.ports.shared.dropped(),
            spin: self.has_deadlines().then_some(self.spin),
            account: self.simulation.account(),
            solver: SolverCounts {
                newton_iterations: self.simulation.newton_iterations(),
                retried_steps: self.simulation.retried(),
                unconverged_steps: self.simulation.unconverged(),
            },
            pulses_pending: self.simulation.pulses_pending(),
            setpoint: *self.simulation.setpoint(),
        };
        self.send(Output::Status(Box::new(status)));
    }

    /// The warning of the status message: shadow lost, energy out of balance, deflections out of range, or a setpoint expired.
    fn warning(&self) -> Option<String> {
        if let Some(diverged) = self.shadow.as_ref().and_then(|shadow| shadow.lost()) {
            return Some(format!("the shadow {diverged}"));
        }
        let of_model = warning(self.simulation.energy_verdict(), self.statistics.worst_out_of_range);
        of_model.or_else(|| setpoint_warning(self.simulation.setpoint()))
    }

    pub(super) fn checkpoint_if_due(&mut self) {
        if self.session_s() >= self.schedule.next_checkpoint_s || self.ports.shared.take_checkpoint_wanted() {
            self.checkpoint();
        }
    }

    pub(super) fn checkpoint(&mut self) {
        self.send_checkpoint(self.simulation.checkpoint(), self.stamp());
    }

    pub(super) fn send_checkpoint(&mut self, state: Checkpoint, stamp: Stamp) {
        self.schedule.next_checkpoint_s = stamp.epoch_start_s + stamp.sim_time_s + CHECKPOINT_PERIOD_S;
        self.send(Output::Checkpoint(Box::new(state), stamp));
    }
}

/// The warning that a setpoint has expired.
const EXPIRED: &str = "the setpoint has expired: no other came within its hold_s, and the torque is zero";

/// The warning of the watchdog, until the next setpoint.
pub(crate) fn setpoint_warning(setpoint: &SetpointState) -> Option<String> {
    setpoint.expired.then(|| EXPIRED.to_owned())
}

/// Whether a warning is that of the watchdog.
pub(crate) fn is_expiry(warning: &str) -> bool {
    warning == EXPIRED
}

/// The warning of the simulation: energy out of balance, or a link bent by `worst_out_of_range` from its chord, rad.
pub(crate) fn warning(verdict: EnergyVerdict, worst_out_of_range: f64) -> Option<String> {
    if let EnergyVerdict::Unbalanced { worst_j, in_play_j } = verdict {
        return Some(unbalanced(worst_j, in_play_j));
    }
    beyond_range(worst_out_of_range)
}

/// The warning that a link was bent by this angle from its chord, rad, unless that is 0.
pub(crate) fn beyond_range(worst_out_of_range: f64) -> Option<String> {
    let bent_deg = worst_out_of_range.to_degrees();
    (bent_deg > 0.0).then(|| format!("out of the model's range: a link was bent by {bent_deg:.1}° from its chord"))
}

/// The beginning of the warning that a run is not to be trusted.
const DISTRUST: &str = "not to be trusted";

/// Whether a warning is that the energy balance of a run was off.
pub(crate) fn is_distrust(warning: &str) -> bool {
    warning.starts_with(DISTRUST)
}

/// The warning that the energy balance of a run was off.
pub(crate) fn unbalanced(worst_j: f64, in_play_j: f64) -> String {
    let part = worst_j / in_play_j;
    format!("{DISTRUST}: the energy balance was off by {worst_j:.2e} J, {part:.1e} of the {in_play_j:.2e} J in play")
}
