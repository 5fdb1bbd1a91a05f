//! Replies by command id, for deduplication: a retry under the same id is answered from this cache and not applied again.

use std::collections::{HashMap, VecDeque};

use crate::wire::CommandReply;

/// Replies kept; the oldest is dropped first.
const CAPACITY: usize = 65_536;

/// Replies to the last accepted commands, by id.
#[derive(Debug, Default)]
pub(crate) struct ReplyCache {
    answers: HashMap<String, CommandReply>,
    order: VecDeque<String>,
}

impl ReplyCache {
    /// The reply to a retry: to a command under the id of one that was accepted before.
    pub(crate) fn get(&self, id: &str) -> Option<CommandReply> {
        let reply = self.answers.get(id)?.clone();
        Some(CommandReply { reason: "a repetition: applied once".to_owned(), ..reply })
    }

    /// Stores a reply, unless its id is empty.
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
    fn prop_reply_cache_is_bounded_and_drops_the_oldest() {
        let mut cache = ReplyCache::default();
        for n in 0..CAPACITY + 10 {
            cache.insert(&CommandReply { id: n.to_string(), accepted: true, ..CommandReply::default() });
        }
        assert_eq!(cache.answers.len(), CAPACITY);
        assert!(cache.get("9").is_none() && cache.get("10").is_some());
    }
}
