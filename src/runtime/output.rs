//! What leaves the stepping thread, in order.

use super::command::ReplyTo;
use crate::simulation::{Checkpoint, Sample, Stamp};
use crate::wire::{AppliedCommand, CommandReply, Shadow, Status, control};

/// One thing for the bus, the recording, or both.
pub enum Output {
    /// The state at one instant. Goes back to the stepping thread's pool afterwards.
    Sample(Box<Sample>),
    /// A second model against the first.
    Shadow(Box<Shadow>, Stamp),
    /// The service's state.
    Status(Box<Status>, Stamp),
    /// The answer to a command, and the record of it when it took effect.
    Answer(CommandReply, ReplyTo, Option<Box<AppliedCommand>>, Stamp),
    /// Starting or stopping a recording, which the receiver answers itself.
    Recording(RecordingRequest),
    /// Full state, for the recording.
    Checkpoint(Box<Checkpoint>, Stamp),
}

/// A wish about the recording that the stepping thread passes on.
pub struct RecordingRequest {
    /// `StartRecording` or `StopRecording`.
    pub action: control::Action,
    /// The answer, if it can be done.
    pub answer: CommandReply,
    /// Takes the answer.
    pub reply: ReplyTo,
    /// When.
    pub stamp: Stamp,
}
