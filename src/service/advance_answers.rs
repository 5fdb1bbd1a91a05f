//! The last answers to advances: a retry under the same id is answered from here.

use std::collections::VecDeque;

use crate::runtime::ReplyTo;
use crate::wire::{AdvanceReply, CommandReply};

/// Answers kept; the oldest is dropped first.
const CAPACITY: usize = 256;
/// Answers to the last advances that have an id.
#[derive(Default)]
pub(super) struct AdvanceAnswers {
    last: VecDeque<AdvanceReply>,
}

impl AdvanceAnswers {
    /// Replies to a retry of any command: with the stored state, if it was an advance. The stepping thread lets retries of the advance
    /// under way wait.
    pub(super) fn reply_to_retry(&self, reply: CommandReply, reply_to: ReplyTo) {
        let stored = self.last.iter().rev().find(|answer| answer.reply.as_ref().is_some_and(|of| of.id == reply.id));
        reply_to(AdvanceReply { reply: Some(reply), ..stored.cloned().unwrap_or_default() });
    }

    /// Answers an advance that is over, and stores the answer.
    pub(super) fn answer(&mut self, answer: AdvanceReply, reply_to: ReplyTo) {
        if answer.reply.as_ref().is_some_and(|reply| !reply.id.is_empty()) {
            if self.last.len() == CAPACITY {
                self.last.pop_front();
            }
            self.last.push_back(answer.clone());
        }
        reply_to(answer);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;
    use crate::wire::Energies;

    fn answer(id: &str, work_j: f64) -> AdvanceReply {
        let reply = CommandReply { id: id.to_owned(), accepted: true, ..CommandReply::default() };
        AdvanceReply { energies: Some(Energies { work_in_j: Some(work_j), ..Energies::default() }), ..reply.into() }
    }

    /// Work in the answer to a retry.
    fn retried_j(answers: &AdvanceAnswers, id: &str) -> Option<f64> {
        let (sender, replies) = channel();
        let reply = answer(id, 0.0).reply.unwrap();
        answers.reply_to_retry(reply, Box::new(move |reply| sender.send(reply).unwrap()));
        replies.recv().unwrap().energies.and_then(|energies| energies.work_in_j)
    }

    #[test]
    fn prop_the_store_is_bounded_and_drops_the_oldest() {
        let mut answers = AdvanceAnswers::default();
        for n in 0..CAPACITY + 10 {
            answers.answer(answer(&n.to_string(), n as f64), Box::new(|_| {}));
        }
        answers.answer(answer("", -1.0), Box::new(|_| {}));
        assert_eq!(answers.last.len(), CAPACITY);
        let newest = (CAPACITY + 9).to_string();
        assert_eq!(
            [&newest, "10", "9", "a pulse"].map(|id| retried_j(&answers, id)),
            [Some((CAPACITY + 9) as f64), Some(10.0), None, None]
        );
    }
}
