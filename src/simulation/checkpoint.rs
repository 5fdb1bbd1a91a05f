//! The full state of a simulation.

use super::drive::MotionOrigin;
use super::drive::Torque;
use super::error_estimate::ErrorEstimate;
use super::ledger::Ledger;
use super::ledger::{ChangedEnergy, LedgerEntries};
use super::load::{DeliveredImpulse, margin_s};
use super::setpoint::SetpointState;
use super::{Simulation, StepGrid};
use crate::mechanics::Energy;
use crate::scene::Pulse;

/// The full state: a simulation that is restored from it goes on equal to the bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// Steps since the epoch began.
    pub step: u64,
    /// The epoch.
    pub epoch: u64,
    /// Coordinates, velocities and further state of the integrator, in the model's own order.
    pub state: Vec<f64>,
    /// Pulses that wait or act.
    pub pulses: Vec<Pulse>,
    /// The setpoint and its watchdog.
    pub setpoint: SetpointState,
    /// The account of energy and work.
    pub ledger: LedgerEntries,
    /// The estimated error; `None` where the method cannot tell.
    pub error: Option<ErrorEstimate>,
    /// Torque at the pivot at this instant, N·m.
    pub torque_nm: f64,
    /// Impulse delivered since the mean torque was last taken.
    pub delivered: DeliveredImpulse,
    /// Traces of changes of the scene in this epoch; `None` if there was none.
    pub changes: Option<EpochChanges>,
}

/// Traces that changes of the scene leave in an epoch, which neither the state nor the scene in force determines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EpochChanges {
    /// Times of steps.
    pub grid: StepGrid,
    /// Since when the crank turns at its present speed, if a constant speed is prescribed.
    pub motion: Option<MotionOrigin>,
    /// Energies at the epoch's start, of the scene that was in force there.
    pub start: Energy,
    /// Energies that changes brought in or took, and their magnitude.
    pub changed: ChangedEnergy,
}

impl Simulation {
    /// Everything needed to go on from here.
    pub fn checkpoint(&self) -> Checkpoint {
        self.checkpoint_in(Vec::new(), Vec::new())
    }

    /// As [`Simulation::checkpoint`], in the memory of an earlier one, so that nothing is allocated.
    pub(crate) fn checkpoint_in(&self, mut state: Vec<f64>, mut pulses: Vec<Pulse>) -> Checkpoint {
        state.clear();
        self.engine.save(&mut state);
        pulses.clear();
        pulses.extend(self.load.pulses.iter());
        Checkpoint {
            step: self.step,
            epoch: self.epoch,
            state,
            pulses,
            setpoint: self.load.setpoint,
            ledger: self.ledger.entries(),
            error: self.error,
            torque_nm: self.law.torque.mean_nm,
            delivered: self.load.delivered,
            changes: self.epoch_changes(),
        }
    }

    /// Goes back (or on) to a checkpoint of the same scene, of the one in force then if it was changed; `false`, and nothing changed, when it does not fit.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> bool {
        let other_step = |changes: &EpochChanges| changes.grid.step_s.to_bits() != self.grid.step_s.to_bits();
        if checkpoint.changes.as_ref().is_some_and(other_step) || !self.engine.restore(&checkpoint.state) {
            return false;
        }
        (self.step, self.epoch) = (checkpoint.step, checkpoint.epoch);
        self.passed.restart();
        self.load.replace_pulses(&checkpoint.pulses);
        self.load.setpoint = checkpoint.setpoint;
        self.load.delivered = checkpoint.delivered;
        // Recordings of older builds have one where there is none.
        self.error = checkpoint.error.filter(|_| self.error.is_some());
        let changes = checkpoint.changes;
        self.changed = changes.is_some();
        self.grid = changes.map_or(StepGrid::new(self.grid.step_s), |changes| changes.grid);
        self.law.set_origin(changes.and_then(|changes| changes.motion));
        let (torque, time_s) = (Torque::constant(checkpoint.torque_nm), self.time_s());
        match self.step {
            0 => self.law.begin(torque),
            _ => self.law.during(torque, [time_s - margin_s(time_s, self.grid.step_s), time_s]),
        }
        let energy = self.engine.energy(&self.law, self.time_s());
        let unchanged = (self.observed.start.energy, ChangedEnergy::default());
        let start = changes.map_or(unchanged, |changes| (changes.start, changes.changed));
        self.ledger = Ledger::at(start, &checkpoint.ledger, energy).with_least(self.least_j);
        true
    }
}
