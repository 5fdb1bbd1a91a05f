//! Which command ids were answered, and how: so that a retry is harmless.

use std::collections::{HashMap, VecDeque};

use crate::wire::CommandReply;

/// Ids remembered; older ones are forgotten.
const REMEMBERED: usize = 65_536;

/// Answers to the last commands that were accepted under an id.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    answers: HashMap<String, CommandReply>,
    order: VecDeque<String>,
}

impl Memory {
    /// The answer that this id was given before.
    pub(crate) fn recall(&self, id: &str) -> Option<CommandReply> {
        self.answers.get(id).cloned()
    }

    /// Remembers an answer; an empty id is never remembered.
    pub(crate) fn keep(&mut self, reply: &CommandReply) {
        if reply.id.is_empty() {
            return;
        }
        if self.order.len() == REMEMBERED
            && let Some(oldest) = self.order.pop_front()
        {
            self.answers.remove(&oldest);
        }
        self.order.push_back(reply.id.clone());
        self.answers.insert(reply.id.clone(), reply.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_memory_is_bounded_and_forgets_the_oldest() {
        let mut memory = Memory::default();
        for n in 0..REMEMBERED + 10 {
            memory.keep(&CommandReply { id: n.to_string(), accepted: true, ..CommandReply::default() });
        }
        assert_eq!(memory.answers.len(), REMEMBERED);
        assert!(memory.recall("9").is_none() && memory.recall("10").is_some());
    }
}
