//! Recorded messages, decoded by type.

use prost::DecodeError;

use crate::recording::RecordedMessage;
use crate::wire::{AppliedCommand, Message, applied_command, control};

/// Decodes a message by the name of its schema; `None` for a message without meaning for re-simulation.
pub(super) fn decode(message: &RecordedMessage) -> Result<Option<Message>, DecodeError> {
    let decoded = Message::decode(schema(message), &message.data)?;
    Ok(decoded.filter(|message| !matches!(message, Message::Shadow(_) | Message::Overruns(_))))
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
