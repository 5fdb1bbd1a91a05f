//! Pictures of a recorded mechanism: still at several instants, or moving.

use std::f64::consts::TAU;

use super::canvas::Lettering;
use super::error::PlotError;
use super::mechanism::{Motion, no_link, reset_s, times, turning_rad};
use super::output::{Format, Picture};
use super::playback::Playback;
use super::recorded::{find_topic, has_slider};
use super::recorded_motion::RecordedMotion;
use super::selection::Named;
use super::{animation, strobe};
use crate::shown::shown_s;
use crate::study::Table;

/// Most positions in a strobe figure.
const POSITIONS: usize = 12;
/// After this turning, the mechanism is where it was, but for rounding and bending.
const FULL_TURN_RAD: f64 = 0.99 * TAU;

/// A mechanism at several instants, or moving.
#[derive(Debug, Clone, PartialEq)]
pub struct MechanismPicture {
    /// The reason why the motion is hardly seen at this speed, and a speed at which it is; `None` where it is seen.
    pub warning: Option<String>,
    /// Whether the reason is a vibration in the recorded samples, for which the pictures are too rare.
    pub misses_vibration: bool,
    title: String,
    /// Instants and speed, in words.
    instants: String,
    motion: Motion,
    /// Time of playing; `None` for a still picture.
    playing_s: Option<f64>,
}

impl MechanismPicture {
    /// Recorded positions at even instants of the first turn, or of the whole time up to a reset if nothing turns. Each is a sample,
    /// so that a turn of few samples has few positions.
    ///
    /// # Errors
    /// [`PlotError::Request`] when no link is recorded.
    pub fn strobe(place: &str, topics: &[Named]) -> Result<Self, PlotError> {
        let displacements = displacements(place, topics)?;
        let times = times(displacements);
        let turn = turning_rad(displacements).iter().position(|turned_rad| turned_rad.abs() >= FULL_TURN_RAD);
        let rows = even_rows(turn, times.len());
        let places: Vec<f64> = rows.iter().map(|row| *row as f64).collect();
        let motion = Motion::new(place, displacements, &places, has_slider(topics))?;
        let instants_s: Vec<f64> = rows.iter().filter_map(|row| times.get(*row)).copied().collect();
        let recorded_time = || format!("the recorded time{}", before_reset(" ", displacements));
        let during = turn.map_or_else(recorded_time, |_| "one turn".to_owned());
        let instants = positions_in_words(&instants_s, &during);
        let title = format!("{place}: the mechanism at even instants");
        Ok(MechanismPicture { warning: None, misses_vibration: false, title, instants, motion, playing_s: None })
    }

    /// The recorded mechanism moving, up to a reset, at `speed` recorded seconds per second; without a speed, at the highest of the
    /// usual ones at which the motion is seen and the first turn takes two seconds or more. A vibration counts if the whole is not
    /// too long for it.
    ///
    /// # Errors
    /// [`PlotError::Request`] when no link is recorded, and when there would be a single picture.
    pub fn animation(place: &str, topics: &[Named], speed: Option<f64>) -> Result<Self, PlotError> {
        let displacements = displacements(place, topics)?;
        let recorded = RecordedMotion::of(displacements);
        let asked = speed.map(|speed| Playback::at(speed, recorded.times));
        let playback = asked.unwrap_or_else(|| Playback::suitable(&recorded));
        let motion = Motion::new(place, displacements, &playback.places, has_slider(topics))?;
        let hidden_turning = playback.hidden_turning(&recorded);
        let hidden_vibration = playback.hidden_vibration(&recorded).filter(|_| hidden_turning.is_none());
        let misses_vibration = hidden_vibration.is_some();
        let shortcoming = hidden_turning.or(hidden_vibration);
        let warning = shortcoming.map(|shortcoming| format!("{shortcoming}{}", advice(&recorded)));
        if playback.places.len() < 2 {
            return Err(PlotError::Request(format!("{place}: {}", warning.unwrap_or_default())));
        }
        let (speed, recorded_s) = (playback.speed, playback.recorded_s);
        let digits = if recorded_s < 0.1 - 1e-9 { 4 } else { 2 };
        let before_reset = before_reset(", ", displacements);
        let instants = format!("{recorded_s:.digits$} s at {speed} times the real speed{before_reset}");
        let title = format!("{place}: the mechanism, moving");
        Ok(MechanismPicture { warning, misses_vibration, title, instants, motion, playing_s: Some(recorded_s / speed) })
    }

    /// Instants, speed and magnification, in words.
    pub fn caption(&self) -> String {
        format!("{}{}", self.instants, self.motion.magnification())
    }

    /// Magnifies bending in all still pictures by the smallest of their factors, and likewise in all moving ones, so that the
    /// pictures can be compared.
    pub fn magnify_alike<'a>(pictures: impl Iterator<Item = &'a mut Self>) {
        let bent = pictures.filter(|picture| picture.motion.magnified.is_some());
        let (mut moving, mut still): (Vec<&mut Self>, Vec<&mut Self>) = bent.partition(|picture| picture.playing_s.is_some());
        for alike in [&mut still, &mut moving] {
            if let Some(factor) = alike.iter().filter_map(|picture| picture.motion.magnified).reduce(f64::min) {
                alike.iter_mut().for_each(|picture| picture.motion.magnify(factor));
            }
        }
    }
}

/// Rows that are equally many samples apart: of a turn that is complete in the row `turn`, or of all `recorded` rows.
fn even_rows(turn: Option<usize>, recorded: usize) -> Vec<usize> {
    // A recorded time is mostly a round one: ten parts divide it, so that its end is drawn.
    let (end, most_parts) = turn.map_or((recorded, 10), |row| (row, POSITIONS));
    let apart = end.saturating_sub(1).div_ceil(most_parts).max(1);
    (0..end).step_by(apart).take(POSITIONS).collect()
}

/// Number, range and spacing of the positions at these instants; the least and the largest spacing where samples are uneven.
fn positions_in_words(instants_s: &[f64], during: &str) -> String {
    let [first_s, .., last_s] = instants_s else { return "the only recorded position".to_owned() };
    let (count, first_s, last_s) = (instants_s.len(), shown_s(*first_s), shown_s(*last_s));
    let apart_s = || instants_s.windows(2).map(|pair| shown_s(pair[1] - pair[0]));
    let (least_s, largest_s) = (apart_s().fold(f64::INFINITY, f64::min), apart_s().fold(0.0, f64::max));
    let apart = if least_s < largest_s { format!("{least_s} to {largest_s}") } else { largest_s.to_string() };
    format!("{count} positions in {during}, from {first_s} s (pale) to {last_s} s (dark), {apart} s apart")
}

/// The reset at which the pictures of a recording end, behind a separator; nothing if there is none.
fn before_reset(separator: &str, displacements: &Table) -> String {
    reset_s(displacements).map_or(String::new(), |reset_s| format!("{separator}before the reset at {} s", shown_s(reset_s)))
}

/// Names a speed at which the motion is seen, after the reason why it is not, or says that none is. Nothing of a recording that is too
/// short for any.
fn advice(recorded: &RecordedMotion<'_>) -> String {
    let Some(Playback { speed, recorded_s, is_whole, .. }) = Playback::showing(recorded) else {
        let slowest = Playback::slowest_whole(recorded);
        let too_fast = slowest.hidden_vibration(recorded).map(|_| format!("; none down to {} shows the bending", slowest.speed));
        return too_fast.unwrap_or_default();
    };
    let range = if is_whole { String::new() } else { format!(", with --from and --to at most {} s apart", shown_s(recorded_s)) };
    format!("; --animation={speed} shows the motion{range}")
}

/// The positions in a recording.
fn displacements<'a>(place: &str, topics: &'a [Named]) -> Result<&'a Table, PlotError> {
    find_topic(topics, "displacements").map(|topic| &topic.table).ok_or_else(|| no_link(place))
}

impl Picture for MechanismPicture {
    fn title(&self) -> &str {
        &self.title
    }

    fn formats(&self, asked: &[Format]) -> Vec<Format> {
        if self.playing_s.is_some() { vec![Format::Svg] } else { asked.to_vec() }
    }

    fn draw(&self, lettering: Lettering) -> String {
        match self.playing_s {
            Some(playing_s) => {
                animation::draw(&format!("{}, {}", self.title, self.caption()), &self.motion, playing_s, lettering)
            }
            None => strobe::draw(&self.title, &self.caption(), &self.motion, lettering),
        }
    }
}
