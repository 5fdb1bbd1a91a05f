//! Checkpoints as messages, and back.

use super::{ActivePulse, BadCommand};
use crate::scene::Pulse;
use crate::simulation::{Checkpoint, DeliveredImpulse, ErrorEstimate, LedgerEntries, Stamp, Work};

/// Encodes a checkpoint.
pub fn checkpoint(checkpoint: &Checkpoint, stamp: &Stamp) -> super::Checkpoint {
    let pulse = |pulse: &Pulse| ActivePulse {
        start_s: pulse.start_s,
        torque_nm: pulse.torque_nm,
        duration_s: pulse.duration_s,
        shape: super::shape(pulse.shape).into(),
    };
    let DeliveredImpulse { impulse_nm_s, over_s: impulse_over_s } = checkpoint.delivered;
    let LedgerEntries { work, fallen_j, worst_balance_j } = checkpoint.ledger;
    super::Checkpoint {
        stamp: Some(super::stamp(stamp)),
        state: checkpoint.state.clone(),
        pulses: checkpoint.pulses.iter().map(pulse).collect(),
        work_in_j: work.put_in_j,
        dissipated_j: work.dissipated_j,
        work_put_in_j: work.magnitude_j,
        fallen_j,
        worst_balance_j,
        error_estimate: checkpoint.error.map_or(Vec::new(), |error| error.numbers().to_vec()),
        torque_nm: checkpoint.torque_nm,
        impulse_nm_s,
        impulse_over_s,
        epoch_start_s: stamp.epoch_start_s,
    }
}

/// Decodes a recorded checkpoint.
///
/// # Errors
/// [`BadCommand::Shape`] for a pulse of an unknown shape.
pub fn recorded_checkpoint(message: &super::Checkpoint) -> Result<Checkpoint, BadCommand> {
    let stamp = message.stamp.unwrap_or_default();
    let pulse = |pulse: &ActivePulse| {
        let ActivePulse { start_s, torque_nm, duration_s, .. } = *pulse;
        Ok(Pulse { start_s, torque_nm, duration_s, shape: super::pulse_shape(pulse.shape)? })
    };
    Ok(Checkpoint {
        step: stamp.step,
        epoch: stamp.epoch,
        state: message.state.clone(),
        pulses: message.pulses.iter().map(pulse).collect::<Result<_, _>>()?,
        ledger: LedgerEntries {
            work: Work { put_in_j: message.work_in_j, dissipated_j: message.dissipated_j, magnitude_j: message.work_put_in_j },
            fallen_j: message.fallen_j,
            worst_balance_j: message.worst_balance_j,
        },
        error: message.error_estimate.as_slice().try_into().ok().map(ErrorEstimate::from_numbers),
        torque_nm: message.torque_nm,
        delivered: DeliveredImpulse { impulse_nm_s: message.impulse_nm_s, over_s: message.impulse_over_s },
    })
}
