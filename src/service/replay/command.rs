//! Commands to a replay, from the bus and from the keyboard.

use std::ops::RangeInclusive;

use crate::runtime::{Reply, ReplyTo};
use crate::wire::{Next, Rate, Seek, replay_control};

/// Allowed rates of a replay, recorded seconds per second.
pub const RATES: RangeInclusive<f64> = 1e-3..=1e6;

/// The action of a command. Times are recorded time since the first message, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReplayAction {
    /// Pause.
    Pause,
    /// Continue.
    Resume,
    /// Pause if running, continue if paused.
    Toggle,
    /// Jump to this recorded time.
    Seek(f64),
    /// Jump by this recorded time, but not past either end.
    Skip(f64),
    /// Play at this rate.
    Rate(f64),
    /// Multiply the rate by this factor.
    Faster(f64),
    /// While paused, play this many messages.
    Next(u64),
    /// End the replay.
    Stop,
}

impl ReplayAction {
    /// Its kind, in a word.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            ReplayAction::Pause => "pause",
            ReplayAction::Resume => "resume",
            ReplayAction::Toggle => "toggle",
            ReplayAction::Seek(_) => "seek",
            ReplayAction::Skip(_) => "skip",
            ReplayAction::Rate(_) => "rate",
            ReplayAction::Faster(_) => "faster",
            ReplayAction::Next(_) => "next",
            ReplayAction::Stop => "stop",
        }
    }
}

impl TryFrom<replay_control::Action> for ReplayAction {
    type Error = String;

    fn try_from(action: replay_control::Action) -> Result<Self, String> {
        Ok(match action {
            replay_control::Action::Pause(_) => ReplayAction::Pause,
            replay_control::Action::Resume(_) => ReplayAction::Resume,
            replay_control::Action::Seek(Seek { time_s }) if time_s.is_finite() => ReplayAction::Seek(time_s),
            replay_control::Action::Seek(Seek { time_s }) => return Err(format!("time_s = {time_s} is not a time")),
            replay_control::Action::Rate(Rate { factor }) if RATES.contains(&factor) => ReplayAction::Rate(factor),
            replay_control::Action::Rate(Rate { factor }) => {
                return Err(format!("factor = {factor} is not allowed: {:?} to {:?}", RATES.start(), RATES.end()));
            }
            replay_control::Action::Next(Next { count }) => ReplayAction::Next(count.max(1)),
            replay_control::Action::Stop(_) => ReplayAction::Stop,
        })
    }
}

/// A command to a replay.
pub struct ReplayCommand {
    /// Identifies the command, for deduplication of retries; empty if the sender never retries.
    pub id: String,
    /// The action.
    pub action: ReplayAction,
    /// Sends the reply.
    pub reply: ReplyTo,
}

impl ReplayCommand {
    /// A command whose reply is discarded.
    pub fn quiet(action: ReplayAction) -> Self {
        ReplayCommand { id: String::new(), action, reply: Box::new(|_| {}) }
    }
}

/// Replies with a refusal.
pub(super) fn refuse(id: String, reason: String, reply: ReplyTo) {
    reply(Reply::refused(id, reason).into());
}
