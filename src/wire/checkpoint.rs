//! Checkpoints as messages, and back.

use super::commands::pulse_shape;
use super::{ActivePulse, ActiveSetpoint, BadCommand};
use crate::mechanics::Energy;
use crate::scene::Pulse;
use crate::simulation::{
    ChangedEnergy, Checkpoint, DeliveredImpulse, EpochChanges, ErrorEstimate, HeldTorque, LedgerEntries, MotionOrigin,
    SetpointState, Stamp, StepGrid, Work,
};

/// Encodes a checkpoint.
pub fn checkpoint(checkpoint: &Checkpoint, stamp: &Stamp) -> super::Checkpoint {
    let pulse = |pulse: &Pulse| ActivePulse {
        start_s: pulse.start_s,
        torque_nm: pulse.torque_nm,
        duration_s: pulse.duration_s,
        shape: super::shape(pulse.shape).into(),
    };
    let DeliveredImpulse { impulse_nm_s, over_s: impulse_over_s } = checkpoint.delivered;
    let LedgerEntries { work, fallen_j, worst_balance_j, settled_balance_j } = checkpoint.ledger;
    super::Checkpoint {
        stamp: Some(super::stamp(stamp)),
        state: checkpoint.state.clone(),
        pulses: checkpoint.pulses.iter().map(pulse).collect(),
        work_in_j: work.put_in_j,
        dissipated_j: work.dissipated_j,
        work_put_in_j: work.magnitude_j,
        fallen_j,
        worst_balance_j,
        settled_balance_j,
        error_estimate: checkpoint.error.map_or(Vec::new(), |error| error.numbers()),
        torque_nm: checkpoint.torque_nm,
        impulse_nm_s,
        impulse_over_s,
        epoch_start_s: stamp.epoch_start_s,
        setpoint: checkpoint.setpoint.held.map(active_setpoint),
        setpoints_expired: checkpoint.setpoint.expirations,
        setpoint_expired: checkpoint.setpoint.expired,
        changes: checkpoint.changes.as_ref().map(epoch_changes),
        // Scene and level are no part of a simulation's state; whoever knows them adds them.
        scene: String::new(),
        level: String::new(),
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
        Ok(Pulse { start_s, torque_nm, duration_s, shape: pulse_shape(pulse.shape)? })
    };
    Ok(Checkpoint {
        step: stamp.step,
        epoch: stamp.epoch,
        state: message.state.clone(),
        pulses: message.pulses.iter().map(pulse).collect::<Result<_, _>>()?,
        setpoint: SetpointState {
            held: message.setpoint.map(held_torque),
            expired: message.setpoint_expired,
            expirations: message.setpoints_expired,
        },
        ledger: LedgerEntries {
            work: Work { put_in_j: message.work_in_j, dissipated_j: message.dissipated_j, magnitude_j: message.work_put_in_j },
            fallen_j: message.fallen_j,
            worst_balance_j: message.worst_balance_j,
            settled_balance_j: message.settled_balance_j,
        },
        error: ErrorEstimate::from_numbers(&message.error_estimate),
        torque_nm: message.torque_nm,
        delivered: DeliveredImpulse { impulse_nm_s: message.impulse_nm_s, over_s: message.impulse_over_s },
        changes: message.changes.as_ref().map(recorded_changes),
    })
}

fn epoch_changes(changes: &EpochChanges) -> super::EpochChanges {
    let EpochChanges { grid: StepGrid { origin_step, origin_s, step_s, previous_step_s }, motion, start, changed } = *changes;
    super::EpochChanges {
        origin_step,
        origin_s,
        step_s,
        previous_step_s,
        motion_origin_s: motion.map(|motion| motion.time_s),
        motion_origin_rad: motion.map(|motion| motion.angle_rad),
        start_kinetic_j: Some(start.kinetic_j),
        start_strain_j: start.strain_j,
        start_potential_j: start.potential_j,
        changed_moving_j: changed.moving_j,
        changed_potential_j: changed.potential_j,
        changed_magnitude_j: changed.magnitude_j,
    }
}

fn recorded_changes(message: &super::EpochChanges) -> EpochChanges {
    let super::EpochChanges { origin_step, origin_s, step_s, previous_step_s, .. } = *message;
    let motion = message.motion_origin_s.zip(message.motion_origin_rad);
    EpochChanges {
        grid: StepGrid { origin_step, origin_s, step_s, previous_step_s },
        motion: motion.map(|(time_s, angle_rad)| MotionOrigin { time_s, angle_rad }),
        start: Energy {
            kinetic_j: message.start_kinetic_j.unwrap_or(0.0),
            strain_j: message.start_strain_j,
            potential_j: message.start_potential_j,
        },
        changed: ChangedEnergy {
            moving_j: message.changed_moving_j,
            potential_j: message.changed_potential_j,
            magnitude_j: message.changed_magnitude_j,
        },
    }
}

fn active_setpoint(held: HeldTorque) -> ActiveSetpoint {
    let HeldTorque { start_s, torque_nm, hold_s, watched } = held;
    ActiveSetpoint { start_s, torque_nm, hold_s, watched }
}

fn held_torque(active: ActiveSetpoint) -> HeldTorque {
    let ActiveSetpoint { start_s, torque_nm, hold_s, watched } = active;
    HeldTorque { start_s, torque_nm, hold_s, watched }
}
