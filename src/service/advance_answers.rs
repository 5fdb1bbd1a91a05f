//! The last answers to advances: a retry under the same id is answered from here.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::runtime::{Reply, ReplyTo, Response, StateAfter};

/// Answers kept; the oldest is dropped first.
const CAPACITY: usize = 256;

/// States after the last advances that have an id, by id.
#[derive(Default)]
pub(super) struct AdvanceAnswers {
    last: VecDeque<(String, Option<Arc<StateAfter>>)>,
}

impl AdvanceAnswers {
    /// Replies to a retry of any command: with the stored state, if it was an advance. The stepping thread lets retries of the advance
    /// under way wait.
    pub(super) fn reply_to_retry(&self, reply: Reply, reply_to: ReplyTo) {
        let stored = self.last.iter().rev().find(|(id, _)| *id == reply.id);
        reply_to(Response { reply, state: stored.and_then(|(_, state)| state.clone()) });
    }

    /// Answers an advance that is over, and stores the answer.
    pub(super) fn answer(&mut self, answer: Response, reply_to: ReplyTo) {
        if !answer.reply.id.is_empty() {
            if self.last.len() == CAPACITY {
                self.last.pop_front();
            }
            self.last.push_back((answer.reply.id.clone(), answer.state.clone()));
        }
        reply_to(answer);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;
    use crate::scene::SceneSource;
    use crate::simulation::{SampleContext, Simulation};

    fn reply(id: &str) -> Reply {
        Reply { id: id.to_owned(), accepted: true, ..Reply::default() }
    }

    /// Torque in the answer to a retry.
    fn retried_nm(answers: &AdvanceAnswers, id: &str) -> Option<f64> {
        let (sender, replies) = channel();
        answers.reply_to_retry(reply(id), Box::new(move |answer| sender.send(answer).unwrap()));
        replies.recv().unwrap().state.map(|state| state.sample.driving_torque_nm)
    }

    #[test]
    fn prop_the_store_is_bounded_and_drops_the_oldest() {
        let scene = SceneSource::open("crank-slider", &[]).unwrap().scene;
        let simulation = Simulation::new(&scene).unwrap();
        let context = Arc::new(SampleContext::new(&scene.system, simulation.start(), None));
        let answer = |id: &str, torque_nm: f64| {
            let mut sample = simulation.blank_sample();
            sample.driving_torque_nm = torque_nm;
            Response { reply: reply(id), state: Some(Arc::new(StateAfter { sample, context: Arc::clone(&context) })) }
        };
        let mut answers = AdvanceAnswers::default();
        for n in 0..CAPACITY + 10 {
            answers.answer(answer(&n.to_string(), n as f64), Box::new(|_| {}));
        }
        answers.answer(answer("", -1.0), Box::new(|_| {}));
        assert_eq!(answers.last.len(), CAPACITY);
        let newest = (CAPACITY + 9).to_string();
        assert_eq!(
            [&newest, "10", "9", "a pulse"].map(|id| retried_nm(&answers, id)),
            [Some((CAPACITY + 9) as f64), Some(10.0), None, None]
        );
    }
}
