//! Waiting for a deadline: sleep until shortly before it, then busy-wait, because a sleeping thread wakes late. These are pure
//! functions of time, so tests run them with a simulated clock.

use std::time::Duration;

/// The next thing to do while waiting for a deadline; ask again after doing it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeadlineWait {
    /// Sleep for this long.
    Sleep(Duration),
    /// Busy-wait: the deadline is too close to sleep.
    Watch,
    /// The deadline has come.
    Due,
}

/// Returns the next thing to do at `now`, for a `deadline` whose last `watch` must not be slept through.
///
/// The caller asks again after every sleep, so late wake-ups never add up.
pub fn deadline_wait(now: Duration, deadline: Duration, watch: Duration) -> DeadlineWait {
    match deadline.saturating_sub(now) {
        Duration::ZERO => DeadlineWait::Due,
        left if left <= watch => DeadlineWait::Watch,
        left => DeadlineWait::Sleep(left - watch),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATCH: Duration = Duration::from_micros(100);
    const GLANCE: Duration = Duration::from_nanos(50);

    /// Waits for a deadline with a clock on which every sleep ends `over` too late. Returns when the wait ended, and the part of
    /// it that was busy-waiting.
    fn wait(mut now: Duration, deadline: Duration, over: Duration) -> (Duration, Duration) {
        let mut watched = Duration::ZERO;
        loop {
            match deadline_wait(now, deadline, WATCH) {
                DeadlineWait::Sleep(time) => now += time + over,
                DeadlineWait::Watch => (now, watched) = (now + GLANCE, watched + GLANCE),
                DeadlineWait::Due => return (now, watched),
            }
        }
    }

    #[test]
    fn val_a_sleep_that_ends_late_by_less_than_the_watch_costs_nothing() {
        let (from, deadline) = (Duration::from_secs(7), Duration::from_secs(8));
        for over_us in [0, 30, 99] {
            let over = Duration::from_micros(over_us);
            let (done, watched) = wait(from, deadline, over);
            assert!(done >= deadline && done - deadline < GLANCE, "{over_us} us: {done:?}");
            assert!(watched <= WATCH - over + GLANCE, "{over_us} us: watched for {watched:?}");
        }
        let (done, watched) = wait(from, deadline, Duration::from_micros(250));
        assert_eq!((done, watched), (deadline + Duration::from_micros(150), Duration::ZERO));
    }

    #[test]
    fn prop_late_sleeps_do_not_add_up() {
        let mut now = Duration::ZERO;
        for n in 1..=10_000 {
            let deadline = Duration::from_millis(n);
            now = wait(now, deadline, Duration::from_micros(60 + n % 60)).0;
            assert!(now >= deadline && now - deadline <= Duration::from_micros(20), "deadline {n}: {now:?}");
        }
    }

    #[test]
    fn prop_what_is_past_is_due() {
        assert_eq!(deadline_wait(Duration::from_secs(2), Duration::from_secs(1), WATCH), DeadlineWait::Due);
        assert_eq!(deadline_wait(Duration::ZERO, Duration::ZERO, WATCH), DeadlineWait::Due);
        assert_eq!(deadline_wait(Duration::ZERO, WATCH, WATCH), DeadlineWait::Watch);
    }
}
