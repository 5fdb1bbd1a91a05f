//! Samples that a recording lacks: another one that is computed from it lacks them too, and says so by gaps.

use std::collections::HashMap;

use super::event::topic;
use crate::recording::RecordedMessage;
use crate::wire::{Gap, Message, Topic};

/// Follows the numbers of a recording's messages.
#[derive(Debug, Default)]
pub(super) struct SourceLosses {
    last: HashMap<String, LastMessage>,
}

#[derive(Debug, Default, Clone, Copy)]
struct LastMessage {
    /// Number that the next message of the topic should have.
    next: u32,
    epoch: u64,
    step: u64,
}

impl SourceLosses {
    /// Takes a message before the re-simulation begins.
    pub(super) fn skip(&mut self, message: &RecordedMessage) {
        self.replace(message, LastMessage { next: message.sequence.wrapping_add(1), ..LastMessage::default() });
    }

    /// Takes a message; returns the gap that a new recording has before it, if samples are missing there. A gap that the old recording
    /// reports is repeated, but for lost commands: what is computed does without them.
    pub(super) fn take(&mut self, message: &RecordedMessage, event: &Message) -> Option<Gap> {
        if let Message::Gaps(gap) = event {
            return (gap.topic != Topic::Commands.chunk()).then(|| gap.as_ref().clone());
        }
        let stamp = event.stamp().filter(|_| event.topic().is_telemetry())?;
        let next = message.sequence.wrapping_add(1);
        let before = self.replace(message, LastMessage { next, epoch: stamp.epoch, step: stamp.step });
        let count = message.sequence.wrapping_sub(before.next);
        let first_step = if before.epoch == stamp.epoch { before.step + 1 } else { 0 };
        let topic = event.topic().chunk().to_owned();
        (count > 0).then(|| Gap { stamp: Some(stamp), topic, count: count.into(), first_step, published: false })
    }

    /// Notes the newest message of a topic; returns the one before.
    fn replace(&mut self, message: &RecordedMessage, by: LastMessage) -> LastMessage {
        match self.last.get_mut(topic(message)) {
            Some(last) => std::mem::replace(last, by),
            None => {
                self.last.insert(topic(message).to_owned(), by);
                LastMessage::default()
            }
        }
    }
}
