//! The playing of an animation: its speed, and the recorded positions of its pictures.

use std::f64::consts::TAU;

use super::mechanism::{between, turned};

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
/// Slack for times that are sums of steps.
const SLACK: f64 = 1e-9;

/// A recorded time at one speed.
pub(super) struct Playback {
    /// Recorded seconds per second of playing.
    pub speed: f64,
    /// Recorded time that is played, s.
    pub recorded_s: f64,
    /// Places of the pictures between the recorded rows, at even times from the first to the last.
    pub places: Vec<f64>,
}

impl Playback {
    /// Plays recorded times at this speed, from the first on, for the longest time of playing at most.
    pub fn at(speed: f64, times: &[f64]) -> Self {
        let [start, end] = [times.first(), times.last()].map(|time| time.copied().unwrap_or_default());
        let recorded_s = (end - start).min(LONGEST_S * speed);
        let wanted = recorded_s / speed * PICTURES_HZ;
        // Less than one interval leaves the first picture alone.
        let intervals = if wanted < 1.0 - SLACK { 0.0 } else { (wanted - SLACK).ceil() };
        let at = |picture: u32| (start + recorded_s * f64::from(picture) / f64::max(intervals, 1.0)).min(end);
        let places = (0..=intervals as u32).filter_map(|picture| place(times, at(picture))).collect();
        Playback { speed, recorded_s, places }
    }

    /// Plays recorded times at the highest usual speed at which the motion is seen and a turn takes two seconds or more. If
    /// nothing turns, the whole takes two seconds or more.
    pub fn suitable(times: &[f64], turning_rad: &[f64]) -> Self {
        let end = turned(turning_rad).map_or(times.last(), |row| times.get(row));
        let [start, end] = [times.first(), end].map(|time| time.copied().unwrap_or_default());
        let fastest = (end - start + SLACK) / TURN_S;
        let suits = |playback: &Playback| playback.speed <= fastest && playback.shortcoming(turning_rad).is_none();
        let mut playbacks = SPEEDS.into_iter().map(|speed| Playback::at(speed, times));
        playbacks.find(suits).unwrap_or_else(|| Playback::at(SLOWEST, times))
    }

    /// The reason why the motion is not seen; `None` if it is seen. `turning_rad` is the turning up to every recorded row.
    pub fn shortcoming(&self, turning_rad: &[f64]) -> Option<String> {
        let apart_rad = self.turning_between_pictures_rad(turning_rad);
        let reason = match self.places.len() {
            _ if self.recorded_s <= 0.0 => return Some("only one position was recorded in this time".to_owned()),
            0 | 1 => "there is only one picture".to_owned(),
            few @ 2..FEWEST => format!("there are only {few} pictures"),
            _ if apart_rad > LARGEST_TURNING_RAD => {
                format!("the mechanism turns by up to {apart_rad:.1} rad from picture to picture")
            }
            _ => return None,
        };
        Some(format!("at {} times the real speed, {reason}", self.speed))
    }

    /// The largest turning from a picture to the next, rad.
    fn turning_between_pictures_rad(&self, turning_rad: &[f64]) -> f64 {
        let angles: Vec<f64> = self.places.iter().filter_map(|place| between(turning_rad, *place)).collect();
        angles.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
    }
}

/// The place of a time between the rows of recorded times; none after the last.
fn place(times: &[f64], at: f64) -> Option<f64> {
    let row = times.partition_point(|time| *time < at);
    let after = times.get(row)?;
    let before = row.checked_sub(1).and_then(|row| times.get(row));
    Some(before.map_or(0.0, |before| row as f64 - (after - at) / (after - before)))
}
