//! What a replayer can be told.

use std::ops::RangeInclusive;
use std::sync::mpsc::{SendError, Sender};

use crate::runtime::ReplyTo;
use crate::wire::{CommandReply, Next, Rate, Seek, replay_control};

/// Rates that a replay may have, recorded seconds per second.
pub const RATES: RangeInclusive<f64> = 1e-3..=1e6;

/// What to do. Times are recorded time since the first message, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReplayAction {
    /// Hold.
    Pause,
    /// Go on.
    Resume,
    /// The one or the other.
    Toggle,
    /// Go on from there.
    Seek(f64),
    /// Go on from there, counted from here; never beyond either end.
    Skip(f64),
    /// Play at this rate.
    Rate(f64),
    /// Play at so many times the rate.
    Faster(f64),
    /// When paused, play so many messages.
    Next(u64),
    /// End.
    Stop,
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

/// An order on its way to the replayer.
pub struct ReplayCommand {
    /// Chosen by the sender; empty when it does not care about repetition.
    pub id: String,
    /// What to do.
    pub action: ReplayAction,
    /// Takes the answer.
    pub reply: ReplyTo,
}

impl ReplayCommand {
    /// An order whose answer nobody needs.
    pub fn quiet(action: ReplayAction) -> Self {
        ReplayCommand { id: String::new(), action, reply: Box::new(|_| {}) }
    }
}

/// Hands an order over, or answers that it is too late.
pub(super) fn submit(commands: &Sender<ReplayCommand>, command: ReplayCommand) {
    if let Err(SendError(command)) = commands.send(command) {
        refuse(command.id, "the replay is over".to_owned(), command.reply);
    }
}

/// Answers no.
pub(super) fn refuse(id: String, reason: String, reply: ReplyTo) {
    reply(CommandReply { id, reason, ..CommandReply::default() });
}
