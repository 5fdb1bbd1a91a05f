//! Replies to commands.

use std::sync::Arc;

use crate::simulation::{Effective, Sample, SampleContext};

/// The reply to a command.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reply {
    /// Id of the command.
    pub id: String,
    /// Whether it was accepted.
    pub accepted: bool,
    /// Why it was refused, or what was done.
    pub reason: String,
    /// The first step that it affects; zero if it was refused.
    pub effective: Effective,
    /// Energy that a change of the scene brought in, J; `None` for other commands.
    pub changed_j: Option<f64>,
}

impl Reply {
    /// Accepts a command.
    pub fn accepted(id: String, effective: Effective) -> Self {
        Reply { id, accepted: true, effective, ..Reply::default() }
    }

    /// Refuses a command.
    pub fn refused(id: String, reason: String) -> Self {
        Reply { id, reason, ..Reply::default() }
    }
}

/// The state after the steps of an advance.
#[derive(Debug, Clone)]
pub struct StateAfter {
    /// The state.
    pub sample: Sample,
    /// Names, start and level of its scene.
    pub context: Arc<SampleContext>,
}

/// A reply, with the state after an advance.
#[derive(Debug, Clone)]
pub struct Response {
    /// The reply.
    pub reply: Reply,
    /// The state; `None` for all other commands, after a refusal, and where it is no longer stored.
    pub state: Option<Arc<StateAfter>>,
}

impl From<Reply> for Response {
    fn from(reply: Reply) -> Self {
        Response { reply, state: None }
    }
}

/// Sends the response to a command. Called off the stepping thread.
pub type ReplyTo = Box<dyn FnOnce(Response) + Send>;
