//! Pacing by absolute deadlines. A pure type: time is passed in, so tests use a simulated clock.

use std::time::Duration;

/// Speed of simulated time against wall time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// As fast as the machine can.
    Max,
    /// Not by itself: clients ask for the steps.
    Lockstep,
    /// Simulated seconds per wall second.
    Factor(f64),
}

/// Policy for missed deadlines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overrun {
    /// Run as fast as possible until deadlines are met again. Lateness beyond [`GIVE_UP`] is given up: the deadlines move.
    #[default]
    CatchUp,
    /// Move all later deadlines by the lateness, without hurrying.
    Skip,
    /// End the run.
    Stop,
    /// Go to a cheaper level of the scene before a deadline is missed, and back when there is room; missed ones are caught up with.
    Degrade,
}

/// Deadlines that are missed by more than this are moved instead of caught up with.
pub const GIVE_UP: Duration = Duration::from_secs(1);

/// Shortest time between two wake-ups of a stepping thread: shorter steps are taken in batches. The anchor and every shift of the
/// deadlines are whole multiples, so that deadlines keep their phase to periodic work of the system.
pub(super) const WAKE_UP_PERIOD: Duration = Duration::from_micros(500);

/// Deadlines of simulated instants: `anchor + (t − t_anchor) / factor`, never accumulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pacer {
    pace: Pace,
    anchor: Duration,
    anchor_s: f64,
    /// Sum of all shifts of the deadlines since the anchor.
    given_up: Duration,
}

impl Pacer {
    /// Makes simulated time `session_s` due `now`, rounded up to half a millisecond; later instants follow at `pace`.
    pub fn new(pace: Pace, now: Duration, session_s: f64) -> Self {
        let anchor = match pace {
            Pace::Max | Pace::Lockstep => now,
            Pace::Factor(_) => round_up(now),
        };
        Pacer { pace, anchor, anchor_s: session_s, given_up: Duration::ZERO }
    }

    /// Returns the deadline of simulated time `session_s`; `None` if there are no deadlines.
    pub fn deadline(&self, session_s: f64) -> Option<Duration> {
        match self.pace {
            Pace::Max | Pace::Lockstep => None,
            Pace::Factor(factor) => {
                let since = Duration::from_secs_f64(((session_s - self.anchor_s) / factor).max(0.0));
                Some(self.anchor + self.given_up + since)
            }
        }
    }

    /// Anchors the deadlines anew at `now`, after a pause or a reset.
    pub fn anchor(&mut self, now: Duration, session_s: f64) {
        *self = Pacer::new(self.pace, now, session_s);
    }

    /// Returns how far the deadlines move after lateness `late`, in whole half milliseconds; `None` if they stay.
    pub fn verdict(policy: Overrun, late: Duration) -> Option<Duration> {
        let moved = match policy {
            Overrun::Skip => true,
            Overrun::CatchUp | Overrun::Stop | Overrun::Degrade => late > GIVE_UP,
        };
        moved.then(|| round_up(late))
    }

    /// Moves all later deadlines by `late`.
    pub fn give_up(&mut self, late: Duration) {
        self.given_up += late;
    }

    /// Returns simulated over wall time since the anchor, shifts included; `None` before any time has passed.
    pub fn real_time_factor(&self, now: Duration, session_s: f64) -> Option<f64> {
        let wall_s = now.saturating_sub(self.anchor).as_secs_f64();
        (wall_s > 0.0).then(|| (session_s - self.anchor_s) / wall_s)
    }
}

/// Rounds up to a multiple of [`WAKE_UP_PERIOD`].
fn round_up(time: Duration) -> Duration {
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
    fn val_lateness_is_caught_up_with_for_a_second_or_skipped() {
        let (little, much) = (Duration::from_millis(900), Duration::from_millis(1100));
        assert_eq!(Pacer::verdict(Overrun::CatchUp, little), None);
        assert_eq!(Pacer::verdict(Overrun::CatchUp, much), Some(much));
        assert_eq!(Pacer::verdict(Overrun::Skip, little), Some(little));
    }

    #[test]
    fn prop_deadlines_keep_their_phase() {
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
