//! Pacing by absolute deadlines. A pure type: time is passed in, so tests drive it by hand.

use std::time::Duration;

/// How fast simulated time goes by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// As fast as the machine can.
    Max,
    /// Simulated seconds per wall second.
    Factor(f64),
}

/// What to do about deadlines that were missed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overrun {
    /// Go as fast as possible until deadlines are met again; what is further behind than [`GIVE_UP`] is given up.
    #[default]
    CatchUp,
    /// Move the deadlines by what was missed: nothing is hurried.
    Skip,
    /// End the run.
    Stop,
}

/// Further behind than this, deadlines are moved rather than chased.
pub const GIVE_UP: Duration = Duration::from_secs(1);

/// A thread wakes for steps at most so often: shorter ones are taken several at a time. Where deadlines begin, and by how much they are
/// moved, are whole multiples of it, so that they keep their place beside what the system does periodically.
pub(super) const WAKE_UP_PERIOD: Duration = Duration::from_micros(500);

/// Deadlines of simulated instants: `anchor + (t − t_anchor) / factor`, never accumulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pacer {
    pace: Pace,
    anchor: Duration,
    anchor_s: f64,
    /// By how much deadlines were moved since.
    given_up: Duration,
}

impl Pacer {
    /// Simulated time `session_s` is due `now`, or at the next multiple of half a millisecond; what comes then, at `pace`.
    pub fn new(pace: Pace, now: Duration, session_s: f64) -> Self {
        let anchor = match pace {
            Pace::Max => now,
            Pace::Factor(_) => whole(now),
        };
        Pacer { pace, anchor, anchor_s: session_s, given_up: Duration::ZERO }
    }

    /// When simulated time `session_s` is due; `None` when at once.
    pub fn deadline(&self, session_s: f64) -> Option<Duration> {
        match self.pace {
            Pace::Max => None,
            Pace::Factor(factor) => {
                let since = Duration::from_secs_f64(((session_s - self.anchor_s) / factor).max(0.0));
                Some(self.anchor + self.given_up + since)
            }
        }
    }

    /// Starts anew from `now`: after a pause or a reset.
    pub fn anchor(&mut self, now: Duration, session_s: f64) {
        *self = Pacer::new(self.pace, now, session_s);
    }

    /// By how much deadlines are to be moved when one was missed by `late`, in whole half milliseconds; `None` when
    /// they stay.
    pub fn verdict(policy: Overrun, late: Duration) -> Option<Duration> {
        let moved = match policy {
            Overrun::Skip => true,
            Overrun::CatchUp | Overrun::Stop => late > GIVE_UP,
        };
        moved.then(|| whole(late))
    }

    /// Moves all deadlines from here on.
    pub fn give_up(&mut self, late: Duration) {
        self.given_up += late;
    }

    /// Simulated over wall time since the last anchor, moved deadlines or not; `None` before any time has passed.
    pub fn real_time_factor(&self, now: Duration, session_s: f64) -> Option<f64> {
        let wall_s = now.saturating_sub(self.anchor).as_secs_f64();
        (wall_s > 0.0).then(|| (session_s - self.anchor_s) / wall_s)
    }
}

/// The next whole multiple of [`WAKE_UP_PERIOD`].
fn whole(time: Duration) -> Duration {
    let beyond = time.subsec_nanos() % WAKE_UP_PERIOD.subsec_nanos();
    if beyond == 0 { time } else { time + WAKE_UP_PERIOD - Duration::from_nanos(beyond.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Duration = Duration::from_secs(100);

    #[test]
    fn prop_deadlines_do_not_drift() {
        let pacer = Pacer::new(Pace::Factor(1.0), START, 0.0);
        let billion = 1_000_000_000_u64;
        let due = pacer.deadline(billion as f64 * 1e-3).unwrap_or_default();
        assert_eq!(due, START + Duration::from_secs(1_000_000));
    }

    #[test]
    fn val_half_speed_doubles_the_time_between_deadlines() {
        let pacer = Pacer::new(Pace::Factor(0.5), START, 2.0);
        assert_eq!(pacer.deadline(3.0), Some(START + Duration::from_secs(2)));
        assert_eq!(pacer.real_time_factor(START + Duration::from_secs(2), 3.0), Some(0.5));
    }

    #[test]
    fn val_no_deadlines_at_full_speed() {
        assert_eq!(Pacer::new(Pace::Max, START, 0.0).deadline(5.0), None);
    }

    #[test]
    fn prop_moved_deadlines_hide_no_lost_time() {
        let mut pacer = Pacer::new(Pace::Factor(1.0), START, 0.0);
        let late = Duration::from_millis(250);
        pacer.give_up(late);
        assert_eq!(pacer.deadline(1.0), Some(START + Duration::from_secs(1) + late));
        assert_eq!(pacer.real_time_factor(START + Duration::from_millis(1250), 1.0), Some(0.8));
    }

    #[test]
    fn val_what_is_missed_is_chased_for_a_second_or_skipped() {
        let (little, much) = (Duration::from_millis(900), Duration::from_millis(1100));
        assert_eq!(Pacer::verdict(Overrun::CatchUp, little), None);
        assert_eq!(Pacer::verdict(Overrun::CatchUp, much), Some(much));
        assert_eq!(Pacer::verdict(Overrun::Skip, little), Some(little));
    }

    #[test]
    fn prop_deadlines_keep_their_place() {
        let mut pacer = Pacer::new(Pace::Factor(1.0), Duration::from_nanos(1_999_999_999), 0.0);
        assert_eq!(pacer.deadline(1.0), Some(Duration::from_secs(3)));
        let late = Duration::from_micros(4_001);
        assert_eq!(Pacer::verdict(Overrun::Skip, late), Some(Duration::from_micros(4_500)));
        pacer.anchor(Duration::from_micros(2_500_001), 1.0);
        assert_eq!(pacer.deadline(1.0), Some(Duration::from_micros(2_500_500)));
    }

    #[test]
    fn prop_a_new_anchor_forgets_a_pause() {
        let mut pacer = Pacer::new(Pace::Factor(1.0), START, 0.0);
        let resumed = START + Duration::from_secs(60);
        pacer.anchor(resumed, 1.0);
        assert_eq!(pacer.deadline(1.5), Some(resumed + Duration::from_millis(500)));
    }
}
