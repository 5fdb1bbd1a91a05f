//! The full state of a simulation.

use super::error_estimate::ErrorEstimate;
use super::ledger::LedgerEntries;
use crate::scene::Pulse;

/// Everything needed to go on from where the simulation is, alike to the bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// Steps since the epoch began.
    pub step: u64,
    /// The epoch.
    pub epoch: u64,
    /// Coordinates, velocities and what else the integrator carries, in the model's own order.
    pub state: Vec<f64>,
    /// Pulses that wait or act.
    pub pulses: Vec<Pulse>,
    /// The account of energy and work.
    pub ledger: LedgerEntries,
    /// The estimated error; `None` where the method cannot tell.
    pub error: Option<ErrorEstimate>,
    /// Torque at the pivot at this instant, N·m.
    pub torque_nm: f64,
    /// Angular impulse (N·m·s) delivered since the mean torque was last taken, and the time since then (s).
    pub impulse: [f64; 2],
}
