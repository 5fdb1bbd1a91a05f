//! The record of a command.

use crate::runtime::{Reply, Request};
use crate::simulation::Stamp;
use crate::wire::{self, AppliedCommand, applied_command};

/// The record of a command that took effect.
pub(super) fn applied(request: Request, reply: Reply, stamp: &Stamp) -> AppliedCommand {
    let id = reply.id.clone();
    let command = match request {
        Request::Torque(pulse) => applied_command::Command::Torque(wire::pulse_message(&id, &pulse)),
        Request::Setpoint(setpoint) => applied_command::Command::Setpoint(wire::setpoint_message(&id, &setpoint)),
        Request::Advance(advance) => applied_command::Command::Advance(wire::advance_message(&id, &advance)),
        Request::Control(action) => applied_command::Command::Control(wire::Control { id, action: Some(action.into()) }),
    };
    AppliedCommand { stamp: Some(wire::stamp(stamp)), reply: Some(reply.into()), command: Some(command), scene: String::new() }
}
