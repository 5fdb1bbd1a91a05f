//! The full state of a simulation.

use super::error_estimate::ErrorEstimate;
use super::ledger::LedgerEntries;
use super::load::DeliveredImpulse;
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
    /// The account of energy and work.
    pub ledger: LedgerEntries,
    /// The estimated error; `None` where the method cannot tell.
    pub error: Option<ErrorEstimate>,
    /// Torque at the pivot at this instant, N·m.
    pub torque_nm: f64,
    /// Impulse delivered since the mean torque was last taken.
    pub delivered: DeliveredImpulse,
}
