//! The log time of the message that a service publishes at this instant, for viewers in the same process.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The log time of the message that is being published: the one that a recording has for it.
///
/// zenoh calls the subscribers of a session on the thread that publishes. A subscriber that shares this value therefore reads the
/// time of its own message.
#[derive(Debug, Clone, Default)]
pub struct LogTime(Arc<AtomicU64>);

impl LogTime {
    /// Sets the time of the next message, ns since 1970.
    pub fn set(&self, log_time_ns: u64) {
        self.0.store(log_time_ns, Ordering::Release);
    }

    /// The time of the last message, ns since 1970; 0 before the first.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Acquire)
    }
}
