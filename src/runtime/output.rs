//! Everything that the stepping thread sends to the output thread.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::command::ReplyTo;
use super::rates::{DueTopics, TELEMETRY};
use crate::simulation::{Checkpoint, Sample, Stamp};
use crate::wire::{AppliedCommand, CommandReply, Overruns, Shadow, Status, control};

/// One message for the bus, the recording, or both.
pub enum Output {
    /// The state at one instant, and the topics to publish it on. The sample returns to the pool afterwards.
    Sample(Arc<Sample>, DueTopics),
    /// The difference between the shadow model and the main model.
    Shadow(Box<Shadow>, Stamp),
    /// The state of the service.
    Status(Box<Status>, Stamp),
    /// The reply to a command, and the message that records it if it took effect.
    Answer(CommandReply, ReplyTo, Option<Box<AppliedCommand>>, Stamp),
    /// A request to start or stop a recording. The output thread decides and replies.
    Recording(RecordingRequest),
    /// The full state, for the recording.
    Checkpoint(Box<Checkpoint>, Stamp),
    /// Samples dropped because the pool was empty.
    MissedSamples(MissedSamplesByTopic, Stamp),
    /// Missed deadlines.
    Overruns(Box<Overruns>, Stamp),
    /// The simulator has ended: nothing follows.
    Over,
}

/// The sending end of the output queue of one simulator. Several simulators share a queue.
#[derive(Clone)]
pub struct Outbox {
    sender: Sender<(usize, Output)>,
    index: usize,
}

impl Outbox {
    /// Creates a sender that marks its messages with `index`.
    pub fn new(sender: Sender<(usize, Output)>, index: usize) -> Self {
        Outbox { sender, index }
    }

    /// Sends a message; returns `false` if the receiver is gone.
    pub fn send(&self, output: Output) -> bool {
        self.sender.send((self.index, output)).is_ok()
    }
}

/// Consecutive dropped samples of one epoch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissedSamples {
    /// Step of the first dropped sample.
    pub first_step: u64,
    /// Stamp of the last dropped sample.
    pub last: Stamp,
    /// Number of dropped samples.
    pub count: u64,
}

/// Dropped samples by topic, in the order of [`DueTopics::by_topic`].
pub type MissedSamplesByTopic = [Option<MissedSamples>; TELEMETRY];

impl MissedSamples {
    /// Adds a dropped sample to those before it.
    pub fn and(missed: Option<MissedSamples>, last: Stamp) -> MissedSamples {
        let (first_step, count) = missed.map_or((last.step, 0), |missed| (missed.first_step, missed.count));
        MissedSamples { first_step, last, count: count + 1 }
    }
}

/// A request to start or stop a recording.
pub struct RecordingRequest {
    /// `StartRecording` or `StopRecording`.
    pub action: control::Action,
    /// The reply, if the request succeeds.
    pub answer: CommandReply,
    /// Sends the reply.
    pub reply: ReplyTo,
    /// When the stepping thread took the command.
    pub stamp: Stamp,
}
