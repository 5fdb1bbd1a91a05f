//! Everything that the stepping thread sends to the output thread.

use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Instant;

use super::command::Request;
use super::ladder::SceneInForce;
use super::missed_deadlines::MissReport;
use super::reply::{Reply, ReplyTo};
use super::scene_change::PreparedChange;
use super::shadow::ModelDifference;
use super::status::RunStatus;
use crate::simulation::{Checkpoint, PerTelemetry, Sample, Stamp};

/// One message for the bus, the recording, or both.
pub enum Output {
    /// The state at one instant. The sample returns to the pool afterwards.
    Sample {
        /// The state.
        sample: Arc<Sample>,
        /// The topics to publish it on.
        topics: PerTelemetry<bool>,
        /// Deadline of its step, if that had one.
        deadline: Option<Instant>,
    },
    /// The difference between the shadow model and the main model.
    Shadow(Box<ModelDifference>, Stamp),
    /// The state of the run.
    Status(Box<RunStatus>),
    /// The reply to a command.
    Answer(Box<Answer>),
    /// The end of an advance.
    Advanced(Box<Advanced>),
    /// The full state, for the recording.
    Checkpoint(Box<Checkpoint>, Stamp),
    /// The scene in force from here on.
    Scene(Arc<SceneInForce>),
    /// The rest of a change of the scene, to be dropped.
    ChangeLeftOver(Box<PreparedChange>),
    /// Samples dropped because the pool was empty.
    MissedSamples(Box<PerTelemetry<Option<MissedSamples>>>, Stamp),
    /// Missed deadlines.
    Overruns(Box<MissReport>, Stamp),
    /// The simulator has ended: nothing follows.
    Over,
}

/// The reply to a command.
pub struct Answer {
    /// The reply. If the request starts or stops a recording, it is the reply if that succeeds: the output thread decides, and replies
    /// after the status that follows.
    pub reply: Reply,
    /// Sends the reply; `None` if nobody asked.
    pub reply_to: Option<ReplyTo>,
    /// The request, to be recorded if the reply accepts it; `None` for a retry.
    pub request: Option<Request>,
    /// When the stepping thread took the command.
    pub stamp: Stamp,
}

/// The end of an advance. Its command was recorded where it began.
pub struct Advanced {
    /// The state after its last step; `None` if that cannot be observed.
    pub sample: Option<Arc<Sample>>,
    /// The reply.
    pub reply: Reply,
    /// Sends the reply.
    pub reply_to: ReplyTo,
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

impl MissedSamples {
    /// Adds a dropped sample to those before it.
    pub fn and(missed: Option<MissedSamples>, last: Stamp) -> MissedSamples {
        let (first_step, count) = missed.map_or((last.step, 0), |missed| (missed.first_step, missed.count));
        MissedSamples { first_step, last, count: count + 1 }
    }
}
