//! Recorded messages, decoded by type.

use prost::{DecodeError, Message as _};

use crate::recording::RecordedMessage;
use crate::wire::{
    Angles, AppliedCommand, Checkpoint, Displacements, Energies, Gap, Loads, Stamp, Status, applied_command, control,
};

/// A decoded message.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Event {
    Displacements(Displacements),
    Angles(Angles),
    Loads(Loads),
    Energies(Energies),
    Status(Box<Status>),
    Command(Box<AppliedCommand>),
    Checkpoint(Box<Checkpoint>),
    Gap(Gap),
    /// A message without meaning for re-simulation.
    Other,
}

impl Event {
    /// Decodes a message by the name of its schema.
    pub(super) fn of(message: &RecordedMessage) -> Result<Self, DecodeError> {
        let data = message.data.as_ref();
        Ok(match schema(message) {
            "flexcrank.v1.Displacements" => Event::Displacements(Displacements::decode(data)?),
            "flexcrank.v1.Angles" => Event::Angles(Angles::decode(data)?),
            "flexcrank.v1.Loads" => Event::Loads(Loads::decode(data)?),
            "flexcrank.v1.Energies" => Event::Energies(Energies::decode(data)?),
            "flexcrank.v1.Status" => Event::Status(Box::new(Status::decode(data)?)),
            "flexcrank.v1.AppliedCommand" => Event::Command(Box::new(AppliedCommand::decode(data)?)),
            "flexcrank.v1.Checkpoint" => Event::Checkpoint(Box::new(Checkpoint::decode(data)?)),
            "flexcrank.v1.Gap" => Event::Gap(Gap::decode(data)?),
            _ => Event::Other,
        })
    }

    /// Fully qualified name of its type.
    pub(super) fn schema(&self) -> Option<&'static str> {
        Some(match self {
            Event::Displacements(_) => "flexcrank.v1.Displacements",
            Event::Angles(_) => "flexcrank.v1.Angles",
            Event::Loads(_) => "flexcrank.v1.Loads",
            Event::Energies(_) => "flexcrank.v1.Energies",
            Event::Status(_) => "flexcrank.v1.Status",
            Event::Command(_) => "flexcrank.v1.AppliedCommand",
            Event::Checkpoint(_) => "flexcrank.v1.Checkpoint",
            Event::Gap(_) => "flexcrank.v1.Gap",
            Event::Other => return None,
        })
    }

    /// Whether it is telemetry, encoded from a sample.
    pub(super) fn is_of_sample(&self) -> bool {
        matches!(self, Event::Displacements(_) | Event::Angles(_) | Event::Loads(_) | Event::Energies(_))
    }

    /// Stamp of the message.
    pub(super) fn stamp(&self) -> Option<Stamp> {
        match self {
            Event::Displacements(message) => message.stamp,
            Event::Angles(message) => message.stamp,
            Event::Loads(message) => message.stamp,
            Event::Energies(message) => message.stamp,
            Event::Status(message) => message.stamp,
            Event::Command(message) => message.stamp,
            Event::Checkpoint(message) => message.stamp,
            Event::Gap(message) => message.stamp,
            Event::Other => None,
        }
    }
}

/// Fully qualified name of a message's type; empty if the file has none.
pub(super) fn schema(message: &RecordedMessage) -> &str {
    message.channel.schema.as_ref().map_or("", |schema| &schema.name)
}

/// Last chunk of a message's topic.
pub(super) fn topic(message: &RecordedMessage) -> &str {
    message.channel.topic.rsplit('/').next().unwrap_or_default()
}

/// Whether a command resets the mechanism.
pub(super) fn resets(command: &AppliedCommand) -> bool {
    let Some(applied_command::Command::Control(control)) = &command.command else { return false };
    matches!(control.action, Some(control::Action::Reset(_)))
}
