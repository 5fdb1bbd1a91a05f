//! Whether anybody wants a topic. zenoh is asked only after it has said that something changed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use zenoh::Wait;
use zenoh::pubsub::Publisher;

use super::BusError;

/// What is known of the subscriptions to one topic.
pub(super) struct Demand {
    doubtful: Arc<AtomicBool>,
    known: AtomicBool,
}

impl Demand {
    /// For a publisher, as long as it lives.
    pub(super) fn of(publisher: &Publisher<'static>) -> Result<Self, BusError> {
        let doubtful = Arc::new(AtomicBool::new(true));
        let changed = Arc::clone(&doubtful);
        publisher
            .matching_listener()
            .callback(move |_| changed.store(true, Ordering::Release))
            .background()
            .wait()
            .map_err(BusError::failed)?;
        Ok(Demand { doubtful, known: AtomicBool::new(false) })
    }

    /// Lets the next look ask zenoh, whose notice of a new subscription may come later than what its subscriber sends next.
    pub(super) fn doubt(&self) {
        self.doubtful.store(true, Ordering::Release);
    }

    /// Whether there is a subscription. `publisher` is the one that this is for.
    pub(super) fn exists(&self, publisher: &Publisher<'static>) -> bool {
        if self.doubtful.swap(false, Ordering::AcqRel) {
            // A message too many does no harm.
            let matching = publisher.matching_status().wait().map_or(true, |status| status.matching());
            self.known.store(matching, Ordering::Relaxed);
        }
        self.known.load(Ordering::Relaxed)
    }
}
