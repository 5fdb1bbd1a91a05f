//! Which command ids were answered, and how: so that a retry is harmless.

use std::collections::{HashMap, VecDeque};

use crate::wire::CommandReply;

/// Ids remembered; older ones are forgotten.
const CAPACITY: usize = 65_536;

/// Answers to the last commands that were accepted under an id.
#[derive(Debug, Default)]
pub(crate) struct ReplyCache {
    answers: HashMap<String, CommandReply>,
    order: VecDeque<String>,
}

impl ReplyCache {
    /// The answer that this id was given before.
    pub(crate) fn get(&self, id: &str) -> Option<CommandReply> {
        self.answers.get(id).cloned()
    }

    /// Remembers an answer; an empty id is never remembered.
    pub(crate) fn insert(&mut self, reply: &CommandReply) {
        if reply.id.is_empty() {
            return;
        }
        if self.order.len() == CAPACITY
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
        let mut cache = ReplyCache::default();
        for n in 0..CAPACITY + 10 {
            cache.insert(&CommandReply { id: n.to_string(), accepted: true, ..CommandReply::default() });
        }
        assert_eq!(cache.answers.len(), CAPACITY);
        assert!(cache.get("9").is_none() && cache.get("10").is_some());
    }
}
