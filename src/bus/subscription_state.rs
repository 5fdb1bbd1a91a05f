//! Whether anybody wants a topic. zenoh tells of changes, a moment late: until what it told is what it answers, it is asked.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use zenoh::Wait;
use zenoh::pubsub::Publisher;

use super::BusError;

/// What is known of the subscriptions to one topic.
///
/// zenoh judges every change some time after it, beside what it judged last, and tells only of what differs then: who has gone
/// and come again in between is not told of. What it told last is right in the end, so an answer that differs from it is
/// not the last word.
#[derive(Default)]
pub(super) struct SubscriptionState {
    notified: Arc<AtomicBool>,
    answered: AtomicBool,
    /// Whether it has been asked since the last expire, the first of which is at the start.
    certain: AtomicBool,
}

impl SubscriptionState {
    /// For a publisher, as long as it lives.
    pub(super) fn of(publisher: &Publisher<'static>) -> Result<Self, BusError> {
        let state = SubscriptionState::default();
        let notified = Arc::clone(&state.notified);
        publisher
            .matching_listener()
            .callback(move |status| notified.store(status.matching(), Ordering::Release))
            .background()
            .wait()
            .map_err(BusError::failed)?;
        Ok(state)
    }

    /// Lets the next look ask zenoh, whose notice of a new subscription may come later than what its subscriber sends next.
    pub(super) fn expire(&self) {
        self.certain.store(false, Ordering::Release);
    }

    /// Whether there is a subscription. `publisher` is the one that this is for.
    pub(super) fn has_subscribers(&self, publisher: &Publisher<'static>) -> bool {
        // A message too many does no harm.
        self.resolve(|| publisher.matching_status().wait().map_or(true, |status| status.matching()))
    }

    fn resolve(&self, ask: impl FnOnce() -> bool) -> bool {
        let answered = self.answered.load(Ordering::Relaxed);
        let certain = self.certain.swap(true, Ordering::AcqRel);
        if certain && answered == self.notified.load(Ordering::Acquire) {
            return answered;
        }
        let answer = ask();
        self.answered.store(answer, Ordering::Relaxed);
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unasked() -> bool {
        unreachable!("zenoh is asked without need")
    }

    #[test]
    fn regress_who_was_there_before_is_known_before_zenoh_tells_of_him() {
        assert!(SubscriptionState::default().resolve(|| true));
    }

    #[test]
    fn regress_who_asked_for_the_snapshot_is_known_before_zenoh_tells_of_him() {
        let state = SubscriptionState::default();
        assert!(!state.resolve(|| false));
        assert!(!state.resolve(unasked));
        state.expire();
        assert!(state.resolve(|| true));
        assert!(state.resolve(|| true), "asked until it is told");
        state.notified.store(true, Ordering::Release);
        assert!(state.resolve(unasked));
    }

    #[test]
    fn regress_who_comes_before_zenoh_told_that_another_had_gone_is_known() {
        let state = SubscriptionState::default();
        state.notified.store(true, Ordering::Release);
        assert!(state.resolve(|| true));
        state.expire();
        assert!(!state.resolve(|| false), "gone, which is not told yet");
        assert!(state.resolve(|| true), "another has come, which zenoh never tells of: it still has the one before");
    }

    #[test]
    fn regress_who_has_gone_before_zenoh_told_that_he_had_come_is_not_known_for_ever() {
        let state = SubscriptionState::default();
        state.expire();
        assert!(state.resolve(|| true));
        assert!(!state.resolve(|| false), "zenoh never tells of him");
        assert!(!state.resolve(unasked));
    }
}
