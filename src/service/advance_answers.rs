//! The last answers to advances: a retry under the same id is answered from here.

use std::collections::VecDeque;

use crate::runtime::ReplyTo;
use crate::wire::{AdvanceReply, CommandReply};

/// Answers kept; the oldest is dropped first.
const CAPACITY: usize = 256;
/// Retries that wait for the end of the advance under way; further ones are answered without a state.
const RETRIES: usize = 16;

/// Answers to the last advances that have an id, and the retries that came before theirs was over.
#[derive(Default)]
pub(super) struct AdvanceAnswers {
    last: VecDeque<AdvanceReply>,
    /// Id of the advance under way; empty if there is none.
    under_way: String,
    early: Vec<(CommandReply, ReplyTo)>,
}

impl AdvanceAnswers {
    /// An advance begins.
    pub(super) fn begin(&mut self, id: &str) {
        self.under_way.clear();
        self.under_way.push_str(id);
    }

    /// Replies to a retry of any command: with the stored state, if it was an advance.
    pub(super) fn reply_to_retry(&mut self, reply: CommandReply, reply_to: ReplyTo) {
        if !reply.id.is_empty() && reply.id == self.under_way && self.early.len() < RETRIES {
            return self.early.push((reply, reply_to));
        }
        let stored = self.last.iter().rev().find(|answer| answer.reply.as_ref().is_some_and(|of| of.id == reply.id));
        reply_to(again(reply, stored));
    }

    /// The advance under way is over: answers it, and its early retries.
    pub(super) fn finish(&mut self, answer: AdvanceReply, reply_to: ReplyTo) {
        if !self.under_way.is_empty() {
            self.under_way.clear();
            for (reply, reply_to) in self.early.drain(..) {
                reply_to(again(reply, Some(&answer)));
            }
            if self.last.len() == CAPACITY {
                self.last.pop_front();
            }
            self.last.push_back(answer.clone());
        }
        reply_to(answer);
    }
}

/// The answer to a retry.
fn again(reply: CommandReply, stored: Option<&AdvanceReply>) -> AdvanceReply {
    AdvanceReply { reply: Some(reply), ..stored.cloned().unwrap_or_default() }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, channel};

    use super::*;
    use crate::wire::Energies;

    fn answer(id: &str, work_j: f64) -> AdvanceReply {
        let reply = CommandReply { id: id.to_owned(), accepted: true, ..CommandReply::default() };
        AdvanceReply { energies: Some(Energies { work_in_j: Some(work_j), ..Energies::default() }), ..reply.into() }
    }

    fn retry(answers: &mut AdvanceAnswers, id: &str) -> Receiver<AdvanceReply> {
        let (sender, replies) = channel();
        let reply = answer(id, 0.0).reply.unwrap();
        answers.reply_to_retry(reply, Box::new(move |reply| sender.send(reply).unwrap()));
        replies
    }

    fn work_j(reply: &AdvanceReply) -> Option<f64> {
        reply.energies.as_ref().and_then(|energies| energies.work_in_j)
    }

    #[test]
    fn prop_a_retry_gets_the_stored_answer_or_waits_for_it() {
        let mut answers = AdvanceAnswers::default();
        answers.begin("a");
        let early = retry(&mut answers, "a");
        assert!(early.try_recv().is_err(), "it waits");
        answers.finish(answer("a", 1.0), Box::new(|_| {}));
        assert_eq!(work_j(&early.recv().unwrap()), Some(1.0));
        assert_eq!(work_j(&retry(&mut answers, "a").recv().unwrap()), Some(1.0));
        assert_eq!(work_j(&retry(&mut answers, "a pulse").recv().unwrap()), None);
    }

    #[test]
    fn prop_the_store_is_bounded_and_drops_the_oldest() {
        let mut answers = AdvanceAnswers::default();
        for n in 0..CAPACITY + 10 {
            answers.begin(&n.to_string());
            answers.finish(answer(&n.to_string(), n as f64), Box::new(|_| {}));
        }
        answers.begin("");
        answers.finish(answer("", -1.0), Box::new(|_| {}));
        assert_eq!(answers.last.len(), CAPACITY);
        assert_eq!(work_j(&retry(&mut answers, "9").recv().unwrap()), None);
        assert_eq!(work_j(&retry(&mut answers, "10").recv().unwrap()), Some(10.0));
    }
}
