//! What leaves the stepping thread, in order.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::command::ReplyTo;
use super::rates::{DueTopics, TELEMETRY};
use crate::simulation::{Checkpoint, Sample, Stamp};
use crate::wire::{AppliedCommand, CommandReply, Overruns, Shadow, Status, control};

/// One thing for the bus, the recording, or both.
pub enum Output {
    /// The state at one instant, and the topics that it is for. Goes back to the stepping thread's pool afterwards.
    Sample(Arc<Sample>, DueTopics),
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
    /// Samples that did not leave because none was free to be filled.
    MissedSamples(MissedSamplesByTopic, Stamp),
    /// Deadlines that were missed.
    Overruns(Box<Overruns>, Stamp),
    /// Nothing more comes from this simulator.
    Over,
}

/// The way out of one simulator, which shares it with others.
#[derive(Clone)]
pub struct Outbox {
    sender: Sender<(usize, Output)>,
    index: usize,
}

impl Outbox {
    /// What is sent is marked with `index`.
    pub fn new(sender: Sender<(usize, Output)>, index: usize) -> Self {
        Outbox { sender, index }
    }

    /// `false` when nobody takes it any more.
    pub fn send(&self, output: Output) -> bool {
        self.sender.send((self.index, output)).is_ok()
    }
}

/// Samples of one epoch that were left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissedSamples {
    /// Step of the first.
    pub first_step: u64,
    /// Stamp of the last.
    pub last: Stamp,
    /// How many.
    pub count: u64,
}

/// Samples that were left out, by topic: in the order of [`DueTopics::by_topic`].
pub type MissedSamplesByTopic = [Option<MissedSamples>; TELEMETRY];

impl MissedSamples {
    /// One more, after those there are.
    pub fn and(missed: Option<MissedSamples>, last: Stamp) -> MissedSamples {
        let (first_step, count) = missed.map_or((last.step, 0), |missed| (missed.first_step, missed.count));
        MissedSamples { first_step, last, count: count + 1 }
    }
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
