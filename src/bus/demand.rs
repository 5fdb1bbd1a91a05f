//! Whether anybody wants a topic. zenoh is asked after it has said that something changed, and hardly ever else.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use zenoh::Wait;
use zenoh::pubsub::Publisher;

use super::BusError;

/// Of so many messages for subscribers, one asks whether they are still there: zenoh does not tell of one that has come and gone
/// before it told that it came.
const ASK_AGAIN: u32 = 128;

/// What is known of the subscriptions to one topic.
pub(super) struct Demand {
    doubtful: Arc<AtomicBool>,
    known: AtomicBool,
    looks: AtomicU32,
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
        Ok(Demand { doubtful, known: AtomicBool::new(false), looks: AtomicU32::new(0) })
    }

    /// Lets the next look ask zenoh, whose notice of a new subscription may come later than what its subscriber sends next.
    pub(super) fn doubt(&self) {
        self.doubtful.store(true, Ordering::Release);
    }

    /// Whether there is a subscription. `publisher` is the one that this is for.
    pub(super) fn exists(&self, publisher: &Publisher<'static>) -> bool {
        let known = self.known.load(Ordering::Relaxed);
        let again = known && self.looks.fetch_add(1, Ordering::Relaxed) % ASK_AGAIN == ASK_AGAIN - 1;
        if self.doubtful.swap(false, Ordering::AcqRel) || again {
            // A message too many does no harm.
            let matching = publisher.matching_status().wait().map_or(true, |status| status.matching());
            self.known.store(matching, Ordering::Relaxed);
        }
        self.known.load(Ordering::Relaxed)
    }
}
