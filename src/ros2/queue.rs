//! A bounded queue that drops the oldest items and counts them.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A queue between threads.
pub(super) struct NewestQueue<T> {
    limit: usize,
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T> {
    items: VecDeque<T>,
    dropped: u64,
    closed: bool,
}

/// The result of waiting for an item.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Next<T> {
    Item(T),
    /// Nothing came in time.
    Nothing,
    /// The queue is closed and empty.
    Closed,
}

impl<T> NewestQueue<T> {
    /// A queue of at most `limit` items.
    pub(super) fn new(limit: usize) -> Self {
        let state = State { items: VecDeque::new(), dropped: 0, closed: false };
        NewestQueue { limit, state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Adds an item, without waiting for the reader.
    pub(super) fn push(&self, item: T) {
        let mut state = self.lock();
        if state.items.len() >= self.limit {
            state.items.pop_front();
            state.dropped += 1;
        }
        state.items.push_back(item);
        self.changed.notify_one();
    }

    /// Ends the queue: what is in it can still be read.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// Waits for the oldest item.
    pub(super) fn next(&self, patience: Duration) -> Next<T> {
        let state = self.lock();
        let waits = |state: &mut State<T>| state.items.is_empty() && !state.closed;
        let (mut state, _) = self.changed.wait_timeout_while(state, patience, waits).unwrap_or_else(PoisonError::into_inner);
        match state.items.pop_front() {
            Some(item) => Next::Item(item),
            None if state.closed => Next::Closed,
            None => Next::Nothing,
        }
    }

    /// Number of items dropped so far.
    pub(super) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_full_queue_drops_the_oldest_and_counts_them() {
        let queue = NewestQueue::new(3);
        (0..5).for_each(|item| queue.push(item));
        queue.close();
        let read: Vec<Next<i32>> = (0..4).map(|_| queue.next(Duration::ZERO)).collect();
        assert_eq!(read, [Next::Item(2), Next::Item(3), Next::Item(4), Next::Closed]);
        assert_eq!(queue.dropped(), 2);
    }
}
