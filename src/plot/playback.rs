//! The playing of an animation: its speed, and the recorded positions of its pictures.

use std::f64::consts::TAU;

use super::mechanism::turned;
use super::recorded_motion::RecordedMotion;

/// Pictures per second of playing; the viewer moves evenly from one to the next.
const PICTURES_HZ: f64 = 15.0;
/// Longest time of playing, s: a file in a README should stay small.
const LONGEST_S: f64 = 10.0;
/// Time in which a turn can be followed by eye, s.
const TURN_S: f64 = 2.0;
/// The usual speeds, recorded seconds per second, and the least of them.
const SPEEDS: [f64; 10] = [1.0, 0.5, 0.25, 0.1, 0.05, 0.025, 0.01, 0.005, 0.0025, SLOWEST];
const SLOWEST: f64 = 0.001;
/// Fewest pictures in which a motion is seen.
const FEWEST: usize = 10;
/// Largest turning from picture to picture in which a turn is seen, rad.
const LARGEST_TURNING_RAD: f64 = TAU / 8.0;
/// Most that lines from picture to picture may be off, over the largest bending. Lines of a vibration about the chord exceed it
/// with fewer than four pictures in a period, `1 − cos(π/4)`.
const ROUGH: f64 = 0.3;
/// The same at a speed that is suggested: with fewer than eight.
const SMOOTH: f64 = 0.08;
/// Slack for times that are sums of steps.
const SLACK: f64 = 1e-9;

/// A recorded time at one speed.
pub(super) struct Playback {
    /// Recorded seconds per second of playing.
    pub speed: f64,
    /// Recorded time that is played, s.
    pub recorded_s: f64,
    /// Whether all of the recorded time is played.
    pub is_whole: bool,
    /// Places of the pictures between the recorded rows, at even times from the first to the last.
    pub places: Vec<f64>,
}

impl Playback {
    /// Plays recorded times at this speed, from the first on, for the longest time of playing at most.
    pub fn at(speed: f64, times: &[f64]) -> Self {
        Playback::lasting(LONGEST_S, speed, times)
    }

    /// Plays recorded times at this speed, from the first on, for `longest_s` at most.
    fn lasting(longest_s: f64, speed: f64, times: &[f64]) -> Self {
        let [start, end] = [times.first(), times.last()].map(|time| time.copied().unwrap_or_default());
        let recorded_s = (end - start).min(longest_s * speed);
        let wanted = recorded_s / speed * PICTURES_HZ;
        // Less than one interval leaves the first picture alone.
        let intervals = if wanted < 1.0 - SLACK { 0.0 } else { (wanted - SLACK).ceil() };
        let at = |picture: u32| (start + recorded_s * f64::from(picture) / f64::max(intervals, 1.0)).min(end);
        let places = (0..=intervals as u32).filter_map(|picture| place(times, at(picture))).collect();
        Playback { speed, recorded_s, is_whole: end - start < recorded_s + SLACK, places }
    }

    /// Plays at each of the usual speeds at which the first turn takes two seconds or more, from the highest to the least of all. If
    /// nothing turns, the whole takes as long.
    fn usual(motion: &RecordedMotion<'_>) -> impl Iterator<Item = Self> {
        let times = motion.times;
        let end = turned(&motion.turning_rad).map_or(times.last(), |row| times.get(row));
        let [start, end] = [times.first(), end].map(|time| time.copied().unwrap_or_default());
        let fastest = SLOWEST.max((end - start + SLACK) / TURN_S);
        SPEEDS.into_iter().filter(move |speed| *speed <= fastest).map(move |speed| Playback::at(speed, times))
    }

    /// Plays at the highest usual speed at which turning is seen. If that misses a vibration, plays at a lower one that shows it,
    /// unless it leaves out a part of the recorded time.
    pub fn suitable(motion: &RecordedMotion<'_>) -> Self {
        let shows_turning = |playback: &Playback| playback.hidden_turning(motion).is_none();
        let suitable = Playback::usual(motion).find(shows_turning).unwrap_or_else(|| Playback::slowest(motion));
        let slower = suitable.hidden_vibration(motion).and_then(|_| Playback::showing(motion));
        slower.filter(|slower| slower.is_whole).unwrap_or(suitable)
    }

    /// Plays at the highest usual speed whose pictures show turning and vibrations of all the recorded time smoothly, even if only a
    /// part of it is played; or at the least of all, if that shows them roughly.
    pub fn showing(motion: &RecordedMotion<'_>) -> Option<Self> {
        let shows = |played: &Playback| played.hidden_turning(motion).or_else(|| played.hidden_vibration(motion)).is_none();
        let shows_all = |played: &Playback, most_off: f64| {
            let all = Playback::lasting(f64::INFINITY, played.speed, motion.times);
            all.hidden_turning(motion).is_none() && motion.missed_links(&all.places, most_off).is_empty()
        };
        let smooth = Playback::usual(motion).filter(shows).find(|played| shows_all(played, SMOOTH));
        smooth.or_else(|| Some(Playback::slowest(motion)).filter(shows).filter(|played| shows_all(played, ROUGH)))
    }

    /// Plays all of the recorded time at the least speed, however long.
    pub fn slowest_whole(motion: &RecordedMotion<'_>) -> Self {
        Playback::lasting(f64::INFINITY, SLOWEST, motion.times)
    }

    /// Plays at the least speed.
    fn slowest(motion: &RecordedMotion<'_>) -> Self {
        Playback::at(SLOWEST, motion.times)
    }

    /// The reason why turning is not seen; `None` if it is seen.
    pub fn hidden_turning(&self, motion: &RecordedMotion<'_>) -> Option<String> {
        let apart_rad = motion.turning_between_pictures_rad(&self.places);
        let reason = match self.places.len() {
            _ if self.recorded_s <= 0.0 => return Some("only one position was recorded in this time".to_owned()),
            0 | 1 => "there is only one picture".to_owned(),
            few @ 2..FEWEST => format!("there are only {few} pictures"),
            _ if apart_rad > LARGEST_TURNING_RAD => {
                format!("the mechanism turns by up to {apart_rad:.1} rad from picture to picture")
            }
            _ => return None,
        };
        Some(self.at_this_speed(&reason))
    }

    /// The reason why a vibration is not seen, or seen slower than it is; `None` if it is seen.
    pub fn hidden_vibration(&self, motion: &RecordedMotion<'_>) -> Option<String> {
        let missed = motion.missed_links(&self.places, ROUGH);
        let reason = || format!("pictures are too rare for the bending of the {}", missed.join(" and the "));
        (!missed.is_empty()).then(|| self.at_this_speed(&reason()))
    }

    fn at_this_speed(&self, reason: &str) -> String {
        format!("at {} times the real speed, {reason}", self.speed)
    }
}

/// The place of a time between the rows of recorded times; none after the last.
fn place(times: &[f64], at: f64) -> Option<f64> {
    let row = times.partition_point(|time| *time < at);
    let after = times.get(row)?;
    let before = row.checked_sub(1).and_then(|row| times.get(row));
    Some(before.map_or(0.0, |before| row as f64 - (after - at) / (after - before)))
}
