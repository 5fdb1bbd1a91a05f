//! Whether a topic has subscribers. zenoh reports changes with a delay, so it is asked until its report agrees with its answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use zenoh::Wait;
use zenoh::pubsub::Publisher;

use super::BusError;

/// The known state of the subscriptions to one topic.
///
/// zenoh evaluates every change with a delay, against its last evaluation, and reports differences only. A subscriber that leaves
/// and another that comes in between are not reported. The last report is right in the end, so an answer that differs from it may
/// change.
#[derive(Default)]
pub(super) struct SubscriptionState {
    notified: Arc<AtomicBool>,
    answered: AtomicBool,
    /// Whether zenoh was asked since the last call of [`SubscriptionState::expire`], or at all.
    certain: AtomicBool,
}

impl SubscriptionState {
    /// Follows a publisher's subscriptions as long as the publisher lives.
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

    /// Makes the next look ask zenoh: its report of a new subscription may come after a query of the same client.
    pub(super) fn expire(&self) {
        self.certain.store(false, Ordering::Release);
    }

    /// Whether there is a subscription to `publisher`, which must be the one this follows.
    pub(super) fn has_subscribers(&self, publisher: &Publisher<'static>) -> bool {
        // Publishing without need does no harm.
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
        unreachable!("zenoh must not be asked again")
    }

    #[test]
    fn regress_an_earlier_subscriber_is_known_before_zenoh_reports_it() {
        assert!(SubscriptionState::default().resolve(|| true));
    }

    #[test]
    fn regress_a_snapshot_client_is_known_before_zenoh_reports_it() {
        let state = SubscriptionState::default();
        assert!(!state.resolve(|| false));
        assert!(!state.resolve(unasked));
        state.expire();
        assert!(state.resolve(|| true));
        assert!(state.resolve(|| true), "asked until reported");
        state.notified.store(true, Ordering::Release);
        assert!(state.resolve(unasked));
    }

    #[test]
    fn regress_a_subscriber_that_replaces_another_unreported_is_known() {
        let state = SubscriptionState::default();
        state.notified.store(true, Ordering::Release);
        assert!(state.resolve(|| true));
        state.expire();
        assert!(!state.resolve(|| false), "gone, not reported yet");
        assert!(state.resolve(|| true), "replaced, never reported: zenoh still reports the one before");
    }

    #[test]
    fn regress_a_subscriber_that_left_unreported_is_forgotten() {
        let state = SubscriptionState::default();
        state.expire();
        assert!(state.resolve(|| true));
        assert!(!state.resolve(|| false), "gone, never reported");
        assert!(!state.resolve(unasked));
    }
}
