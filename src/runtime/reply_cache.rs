//! Replies by command id, for deduplication: a retry under the same id is answered from this cache and not applied again.

use std::collections::{HashMap, VecDeque};

use super::reply::Reply;

/// Replies kept; the oldest is dropped first.
const CAPACITY: usize = 65_536;

/// Replies to the last accepted commands, by id.
#[derive(Debug, Default)]
pub(crate) struct ReplyCache {
    answers: HashMap<String, Accepted>,
    order: VecDeque<String>,
}

/// An accepted command.
#[derive(Debug)]
struct Accepted {
    /// Its kind, such as `pause`; `None` if it is from a resumed recording.
    kind: Option<&'static str>,
    reply: Reply,
}

impl ReplyCache {
    /// The reply to a retry: to a command under the id of one that was accepted before. Refuses a command of another kind.
    pub(crate) fn get(&self, id: &str, kind: &str) -> Option<Reply> {
        let Accepted { kind: before, reply } = self.answers.get(id)?;
        match before {
            Some(other) if *other != kind => {
                let reason = format!("this id belongs to an earlier command, {other}: give each command its own");
                Some(Reply::refused(id.to_owned(), reason))
            }
            _ => Some(Reply { reason: "a repetition: applied once".to_owned(), ..reply.clone() }),
        }
    }

    /// Stores a reply to a command of a kind, unless its id is empty.
    pub(crate) fn insert(&mut self, reply: &Reply, kind: Option<&'static str>) {
        if reply.id.is_empty() {
            return;
        }
        if self.order.len() == CAPACITY
            && let Some(oldest) = self.order.pop_front()
        {
            self.answers.remove(&oldest);
        }
        self.order.push_back(reply.id.clone());
        self.answers.insert(reply.id.clone(), Accepted { kind, reply: reply.clone() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_reply_cache_is_bounded_and_drops_the_oldest() {
        let mut cache = ReplyCache::default();
        for n in 0..CAPACITY + 10 {
            cache.insert(&Reply { id: n.to_string(), accepted: true, ..Reply::default() }, Some("pause"));
        }
        assert_eq!(cache.answers.len(), CAPACITY);
        assert!(cache.get("9", "pause").is_none() && cache.get("10", "pause").is_some_and(|reply| reply.accepted));
    }

    #[test]
    fn regress_an_id_of_another_kind_of_command_is_refused() {
        let mut cache = ReplyCache::default();
        let accepted = |id: &str| Reply { id: id.to_owned(), accepted: true, ..Reply::default() };
        cache.insert(&accepted("a"), Some("torque"));
        cache.insert(&accepted("resumed"), None);
        assert!(cache.get("a", "pause").is_some_and(|reply| !reply.accepted && reply.reason.contains("torque")));
        for (id, kind) in [("a", "torque"), ("resumed", "pause")] {
            assert!(cache.get(id, kind).is_some_and(|reply| reply.accepted), "{id}");
        }
    }
}
