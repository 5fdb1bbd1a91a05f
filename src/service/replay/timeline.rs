//! Recorded time against wall time during a replay. A pure type: wall time is passed in, so tests use a simulated clock.

use std::time::Duration;

use crate::runtime::GIVE_UP;

/// Position in recorded time: `position = anchor_s + rate (now − anchor)` while running.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Timeline {
    rate: f64,
    anchor: Duration,
    anchor_s: f64,
    running: bool,
    /// First and last message since the last interruption: the time at which the first was due and the last was published, and
    /// their recorded times.
    stretch: Option<[(Duration, f64); 2]>,
    /// Sums over all earlier stretches: wall time and recorded time, s.
    played: (f64, f64),
    /// Number of times the replay was too far behind to catch up.
    pub slips: u64,
}

impl Timeline {
    /// Creates a timeline that is paused at a recorded time.
    pub fn new(rate: f64, at_s: f64) -> Self {
        Timeline { rate, anchor: Duration::ZERO, anchor_s: at_s, running: false, stretch: None, played: (0.0, 0.0), slips: 0 }
    }

    pub fn rate(&self) -> f64 {
        self.rate
    }

    pub fn is_running(&self) -> bool {
        self.running
    }

    /// Position in recorded time, s.
    pub fn position_s(&self, now: Duration) -> f64 {
        if self.running { self.anchor_s + now.saturating_sub(self.anchor).as_secs_f64() * self.rate } else { self.anchor_s }
    }

    /// Deadline of a message at recorded time `at_s`; `None` while paused.
    pub fn deadline(&self, at_s: f64) -> Option<Duration> {
        let since_s = ((at_s - self.anchor_s) / self.rate).max(0.0);
        self.running.then(|| self.anchor.saturating_add(Duration::try_from_secs_f64(since_s).unwrap_or(Duration::MAX)))
    }

    /// Pauses, at the latest at the next message.
    pub fn hold(&mut self, now: Duration, next_s: f64) {
        let at_s = self.position_s(now).min(next_s);
        self.jump(now, at_s);
        self.running = false;
    }

    /// Continues from the present position.
    pub fn go(&mut self, now: Duration) {
        self.jump(now, self.anchor_s);
        self.running = true;
    }

    /// Changes the rate.
    pub fn set_rate(&mut self, now: Duration, rate: f64, next_s: f64) {
        self.jump(now, self.position_s(now).min(next_s));
        self.rate = rate;
    }

    /// Jumps to another recorded time.
    pub fn jump(&mut self, now: Duration, to_s: f64) {
        self.close_stretch();
        (self.anchor, self.anchor_s) = (now, to_s);
    }

    /// Notes that a message is published now. Returns its lateness; gives up catching up if that is too large.
    pub fn put(&mut self, now: Duration, at_s: f64) -> Option<Duration> {
        let Some(deadline) = self.deadline(at_s) else {
            self.anchor_s = at_s;
            return None;
        };
        let late = now.saturating_sub(deadline);
        if late > GIVE_UP {
            self.slips += 1;
            (self.anchor, self.anchor_s) = (now, at_s);
        }
        // The stretch begins when its first message is due: one that is late must not make the rate look higher.
        let due = if late > GIVE_UP { now } else { deadline.min(now) };
        let first = self.stretch.map_or((due, at_s), |[first, _]| first);
        self.stretch = Some([first, (now, at_s)]);
        Some(late)
    }

    /// Recorded over wall time, from when the first message was due to the last message, interruptions excluded; `None` before two
    /// messages.
    pub fn achieved_rate(&self) -> Option<f64> {
        let mut whole = self.clone();
        whole.close_stretch();
        let (wall_s, recorded_s) = whole.played;
        (wall_s > 0.0).then(|| recorded_s / wall_s)
    }

    fn close_stretch(&mut self) {
        if let Some([(from, from_s), (to, to_s)]) = self.stretch.take() {
            self.played.0 += (to - from).as_secs_f64();
            self.played.1 += to_s - from_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(s: f64) -> Duration {
        Duration::from_secs_f64(s)
    }

    #[test]
    fn val_deadlines_follow_the_rate_and_do_not_drift() {
        let mut timeline = Timeline::new(2.0, 10.0);
        assert_eq!(timeline.deadline(11.0), None, "standing still");
        timeline.go(wall(100.0));
        assert_eq!(timeline.deadline(11.0), Some(wall(100.5)));
        assert_eq!(timeline.deadline(10.0 + 2e6), Some(wall(1_000_100.0)));
        assert_eq!(timeline.deadline(9.0), Some(wall(100.0)), "what is past is due at once");
    }

    #[test]
    fn prop_a_pause_does_not_count_as_lateness() {
        let mut timeline = Timeline::new(1.0, 0.0);
        timeline.go(wall(0.0));
        for s in [0.0, 1.0, 2.0] {
            assert_eq!(timeline.put(wall(s), s), Some(Duration::ZERO));
        }
        timeline.hold(wall(2.5), 3.0);
        assert_eq!(timeline.position_s(wall(60.0)), 2.5);
        timeline.go(wall(60.0));
        assert_eq!(timeline.deadline(3.0), Some(wall(60.5)));
        timeline.put(wall(60.5), 3.0);
        timeline.put(wall(61.5), 4.0);
        assert_eq!(timeline.achieved_rate(), Some(1.0));
    }

    #[test]
    fn prop_a_pause_never_passes_the_next_message() {
        let mut timeline = Timeline::new(1.0, 0.0);
        timeline.go(wall(0.0));
        timeline.hold(wall(0.9), 0.5);
        assert_eq!(timeline.position_s(wall(9.0)), 0.5);
        timeline.set_rate(wall(9.0), 4.0, 0.5);
        timeline.go(wall(10.0));
        assert_eq!(timeline.deadline(4.5), Some(wall(11.0)));
    }

    #[test]
    fn regress_a_late_first_message_does_not_raise_the_achieved_rate() {
        let mut timeline = Timeline::new(1.0, 0.0);
        timeline.go(wall(0.0));
        timeline.put(wall(0.5), 0.0);
        timeline.put(wall(1.0), 1.0);
        assert_eq!(timeline.achieved_rate(), Some(1.0));
    }

    #[test]
    fn prop_lateness_beyond_a_second_is_given_up() {
        let mut timeline = Timeline::new(1.0, 0.0);
        timeline.go(wall(0.0));
        timeline.put(wall(0.0), 0.0);
        assert_eq!(timeline.put(wall(10.0), 1.0), Some(wall(9.0)));
        assert_eq!((timeline.slips, timeline.deadline(2.0)), (1, Some(wall(11.0))));
        assert_eq!(timeline.achieved_rate(), Some(0.1));
    }
}
