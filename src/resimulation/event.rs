//! Recorded messages, decoded by type.

use prost::DecodeError;

use crate::recording::RecordedMessage;
use crate::wire::{AppliedCommand, Message, applied_command, control};

/// Decodes a message by the name of its schema; `None` if no topic has stamped messages of this schema.
pub(super) fn decode(message: &RecordedMessage) -> Result<Option<Message>, DecodeError> {
    Message::decode(schema(message), &message.data)
}

/// Whether a message is a report of the service, which re-simulation does not compute.
pub(super) fn is_report(message: &Message) -> bool {
    matches!(message, Message::Shadow(_) | Message::Overruns(_) | Message::Gaps(_))
}

/// Fully qualified name of a message's type; empty if the file has none.
pub(super) fn schema(message: &RecordedMessage) -> &str {
    message.channel.schema.as_ref().map_or("", |schema| &schema.name)
}

/// Last chunk of a message's topic.
pub(super) fn topic(message: &RecordedMessage) -> &str {
    message.channel.topic.rsplit('/').next().unwrap_or_default()
}

/// The name of the level that a command goes on at, if it does.
pub(super) fn new_level(command: &AppliedCommand) -> Option<&str> {
    let Some(applied_command::Command::Control(control)) = &command.command else { return None };
    match &control.action {
        Some(control::Action::Level(level)) => Some(&level.name),
        _ => None,
    }
}

/// The scene after a command that changes it.
pub(super) fn new_scene(command: &AppliedCommand) -> Option<&str> {
    changes(command).map(|_| command.scene.as_str())
}

/// The changes of the scene that a command asks for, if it does.
pub(super) fn changes(command: &AppliedCommand) -> Option<&[String]> {
    let Some(applied_command::Command::Control(control)) = &command.command else { return None };
    match &control.action {
        Some(control::Action::Set(set)) => Some(&set.changes),
        _ => None,
    }
}

/// Whether a command resets the mechanism.
pub(super) fn resets(command: &AppliedCommand) -> bool {
    let Some(applied_command::Command::Control(control)) = &command.command else { return false };
    matches!(control.action, Some(control::Action::Reset(_)))
}
