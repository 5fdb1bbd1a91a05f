//! The setpoint: a torque that holds until the next one, at most for its hold.

use super::error::PulseRefused;
use super::pulses;
use super::{Effective, Simulation};
use crate::scene::{Pulse, PulseShape};

/// Shortest hold of a commanded setpoint, s.
pub const SHORTEST_HOLD_S: f64 = 1e-6;
/// Longest hold of a commanded setpoint, s: a controller that has died lets go within a minute.
pub const LONGEST_HOLD_S: f64 = 60.0;

/// A commanded setpoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetpointRequest {
    /// Torque, N·m.
    pub torque_nm: f64,
    /// Simulated time after which the torque ends unless another setpoint comes, s.
    pub hold_s: f64,
}

/// A commanded advance in lock-step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdvanceRequest {
    /// Torque over the steps, N·m; `None` leaves the setpoint in force.
    pub torque_nm: Option<f64>,
    /// Number of steps.
    pub steps: u64,
}

/// A torque in force: a rectangular pulse that the next setpoint cuts off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldTorque {
    /// Start, s.
    pub start_s: f64,
    /// Torque, N·m.
    pub torque_nm: f64,
    /// Longest duration, s.
    pub hold_s: f64,
    /// Whether its end is counted as expired.
    pub watched: bool,
}

impl HeldTorque {
    fn pulse(&self) -> Pulse {
        let HeldTorque { start_s, torque_nm, hold_s, .. } = *self;
        Pulse { start_s, torque_nm, duration_s: hold_s, shape: PulseShape::Rectangular }
    }
}

/// The setpoint of a simulation, and its watchdog.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SetpointState {
    /// The torque in force.
    pub held: Option<HeldTorque>,
    /// Whether the last setpoint expired, and none has come since.
    pub expired: bool,
    /// Setpoints that expired since the epoch began.
    pub expirations: u64,
}

impl SetpointState {
    /// Replaces the torque in force. The next step is the first that feels the new one, so the impulse of both is exact.
    pub(super) fn replace(&mut self, held: HeldTorque) {
        (self.held, self.expired) = (Some(held), false);
    }

    /// Mean torque over `[from_s, to_s]`, N·m; `None` without a setpoint.
    pub(super) fn mean_nm(&self, from_s: f64, to_s: f64) -> Option<f64> {
        self.held.map(|held| pulses::mean_nm(&held.pulse(), from_s, to_s))
    }

    /// Torque at `time_s`, N·m; `None` without a setpoint.
    pub(super) fn value_nm(&self, time_s: f64) -> Option<f64> {
        self.held.map(|held| pulses::torque_nm(&held.pulse(), time_s, time_s))
    }

    /// The time between the two at which the torque ends, s. It begins between steps.
    pub(super) fn edge_within(&self, from_s: f64, to_s: f64) -> Option<f64> {
        self.held.map(|held| held.start_s + held.hold_s).filter(|edge_s| from_s < *edge_s && *edge_s < to_s)
    }

    /// Ends the torque if its hold is over by `time_s`.
    pub(super) fn retire(&mut self, time_s: f64) {
        if let Some(over) = self.held.take_if(|held| time_s - held.start_s >= held.hold_s) {
            self.expired = over.watched;
            self.expirations += u64::from(over.watched);
        }
    }
}

impl Simulation {
    /// Applies a setpoint before the next step, in place of the last one.
    ///
    /// # Errors
    /// [`PulseRefused`] when a number is out of range; nothing is changed then.
    pub fn set_torque(&mut self, request: &SetpointRequest) -> Result<Effective, PulseRefused> {
        self.load.set(request, self.time_s())?;
        Ok(self.now())
    }

    /// Applies a setpoint that holds for exactly the next `steps`, and ends without a warning.
    ///
    /// # Errors
    /// As of [`Simulation::set_torque`].
    pub fn set_torque_for(&mut self, torque_nm: f64, steps: u64) -> Result<Effective, PulseRefused> {
        let start_s = self.time_s();
        // As the last step computes its own end, so that the hold is over exactly there.
        let end_s = self.grid.time_s(self.step.saturating_add(steps));
        self.load.hold(HeldTorque { start_s, torque_nm, hold_s: end_s - start_s, watched: false })?;
        Ok(self.now())
    }

    /// Begins the period of [`Simulation::mean_torque_since_mark_nm`].
    pub fn mark_torque(&mut self) {
        self.load.mark();
    }

    /// Mean torque since the mark, N·m; of a prescribed motion, the torque that it needed when it was observed last.
    pub fn mean_torque_since_mark_nm(&self) -> f64 {
        let mean_nm = self.load.mean_since_mark_nm().unwrap_or(self.law.torque.mean_nm);
        self.observed.last.motion_torque_nm.unwrap_or(mean_nm)
    }

    /// The setpoint and its watchdog.
    pub fn setpoint(&self) -> &SetpointState {
        &self.load.setpoint
    }
}

#[cfg(test)]
mod tests;
