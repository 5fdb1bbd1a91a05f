//! Checkpoints as messages.

use super::ActivePulse;
use crate::simulation::{Checkpoint, Stamp};

/// A checkpoint as it is recorded.
pub fn checkpoint(checkpoint: &Checkpoint, stamp: &Stamp) -> super::Checkpoint {
    let pulse = |pulse: &crate::scene::Pulse| ActivePulse {
        start_s: pulse.start_s,
        torque_nm: pulse.torque_nm,
        duration_s: pulse.duration_s,
        shape: super::shape(pulse.shape).into(),
    };
    super::Checkpoint {
        stamp: Some(super::stamp(stamp)),
        state: checkpoint.state.clone(),
        pulses: checkpoint.pulses.iter().map(pulse).collect(),
        work_in_j: checkpoint.work_j[0],
        dissipated_j: checkpoint.work_j[1],
        work_put_in_j: checkpoint.work_put_in_j,
    }
}
