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
pub(super) struct Demand {
    told: Arc<AtomicBool>,
    answered: AtomicBool,
    /// Whether it has been asked since the last doubt, the first of which is at the start.
    sure: AtomicBool,
}

impl Demand {
    /// For a publisher, as long as it lives.
    pub(super) fn of(publisher: &Publisher<'static>) -> Result<Self, BusError> {
        let demand = Demand::default();
        let told = Arc::clone(&demand.told);
        publisher
            .matching_listener()
            .callback(move |status| told.store(status.matching(), Ordering::Release))
            .background()
            .wait()
            .map_err(BusError::failed)?;
        Ok(demand)
    }

    /// Lets the next look ask zenoh, whose notice of a new subscription may come later than what its subscriber sends next.
    pub(super) fn doubt(&self) {
        self.sure.store(false, Ordering::Release);
    }

    /// Whether there is a subscription. `publisher` is the one that this is for.
    pub(super) fn exists(&self, publisher: &Publisher<'static>) -> bool {
        // A message too many does no harm.
        self.judge(|| publisher.matching_status().wait().map_or(true, |status| status.matching()))
    }

    fn judge(&self, ask: impl FnOnce() -> bool) -> bool {
        let answered = self.answered.load(Ordering::Relaxed);
        let sure = self.sure.swap(true, Ordering::AcqRel);
        if sure && answered == self.told.load(Ordering::Acquire) {
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
        assert!(Demand::default().judge(|| true));
    }

    #[test]
    fn regress_who_asked_for_the_snapshot_is_known_before_zenoh_tells_of_him() {
        let demand = Demand::default();
        assert!(!demand.judge(|| false));
        assert!(!demand.judge(unasked));
        demand.doubt();
        assert!(demand.judge(|| true));
        assert!(demand.judge(|| true), "asked until it is told");
        demand.told.store(true, Ordering::Release);
        assert!(demand.judge(unasked));
    }

    #[test]
    fn regress_who_comes_before_zenoh_told_that_another_had_gone_is_known() {
        let demand = Demand::default();
        demand.told.store(true, Ordering::Release);
        assert!(demand.judge(|| true));
        demand.doubt();
        assert!(!demand.judge(|| false), "gone, which is not told yet");
        assert!(demand.judge(|| true), "another has come, which zenoh never tells of: it still has the one before");
    }

    #[test]
    fn regress_who_has_gone_before_zenoh_told_that_he_had_come_is_not_known_for_ever() {
        let demand = Demand::default();
        demand.doubt();
        assert!(demand.judge(|| true));
        assert!(!demand.judge(|| false), "zenoh never tells of him");
        assert!(!demand.judge(unasked));
    }
}
