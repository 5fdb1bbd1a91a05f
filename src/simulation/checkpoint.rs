//! The full state of a simulation.

use super::StepGrid;
use super::drive::MotionOrigin;
use super::error_estimate::ErrorEstimate;
use super::ledger::{ChangedEnergy, LedgerEntries};
use super::load::DeliveredImpulse;
use super::setpoint::SetpointState;
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
