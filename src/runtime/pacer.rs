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

/// Deadlines of simulated instants: `anchor + (t − t_anchor) / factor`, never accumulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pacer {
    pace: Pace,
    anchor: Duration,
    anchor_s: f64,
}

/// Further behind than this, deadlines are moved rather than chased.
const GIVE_UP: Duration = Duration::from_secs(1);

impl Pacer {
    /// Simulated time `session_s` is due at `now`; what follows, at `pace`.
    pub fn new(pace: Pace, now: Duration, session_s: f64) -> Self {
        Pacer { pace, anchor: now, anchor_s: session_s }
    }

    /// When simulated time `session_s` is due; `None` when at once.
    pub fn deadline(&self, session_s: f64) -> Option<Duration> {
        match self.pace {
            Pace::Max => None,
            Pace::Factor(factor) => Some(self.anchor + Duration::from_secs_f64(((session_s - self.anchor_s) / factor).max(0.0))),
        }
    }

    /// Starts anew from `now`: after a pause, or when too far behind to catch up.
    pub fn anchor(&mut self, now: Duration, session_s: f64) {
        (self.anchor, self.anchor_s) = (now, session_s);
    }

    /// Whether a deadline was missed by so much that it is not worth chasing.
    pub fn hopeless(lateness: Duration) -> bool {
        lateness > GIVE_UP
    }

    /// Simulated over wall time since the last anchor; `None` before any time has passed.
    pub fn real_time_factor(&self, now: Duration, session_s: f64) -> Option<f64> {
        let wall_s = now.saturating_sub(self.anchor).as_secs_f64();
        (wall_s > 0.0).then(|| (session_s - self.anchor_s) / wall_s)
    }
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
    fn prop_a_new_anchor_forgets_a_pause() {
        let mut pacer = Pacer::new(Pace::Factor(1.0), START, 0.0);
        let resumed = START + Duration::from_secs(60);
        pacer.anchor(resumed, 1.0);
        assert_eq!(pacer.deadline(1.5), Some(resumed + Duration::from_millis(500)));
    }
}
