//! Pictures of a recorded mechanism: still at several instants, or moving.

use super::canvas::Lettering;
use super::error::PlotError;
use super::mechanism::{Motion, no_link, times, turned, turning_rad};
use super::output::{Format, Picture};
use super::playback::Playback;
use super::recorded::{find_topic, has_slider};
use super::recorded_motion::RecordedMotion;
use super::selection::Named;
use super::{animation, strobe};
use crate::shown::shown_s;
use crate::study::Table;

/// Number of positions in a strobe figure.
const POSITIONS: usize = 12;

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
    /// Recorded positions at even instants of the first turn, or of the whole time if nothing turns.
    ///
    /// # Errors
    /// [`PlotError::Request`] when no link is recorded.
    pub fn strobe(place: &str, topics: &[Named]) -> Result<Self, PlotError> {
        let displacements = displacements(place, topics)?;
        let (times, turn) = (times(displacements), turned(&turning_rad(displacements)));
        let start = times.first().copied().unwrap_or_default();
        let end = turn.map_or(times.last(), |row| times.get(row)).copied().unwrap_or_default();
        // After a turn the mechanism is where it was.
        let (steps, during) = if turn.is_some() { (POSITIONS, "one turn") } else { (POSITIONS - 1, "the recorded time") };
        let apart_s = (end - start) / steps as f64;
        let row = |number: usize| times.partition_point(|time| *time < start + apart_s * number as f64 - 1e-9);
        let mut rows: Vec<usize> = (0..POSITIONS).map(row).filter(|row| *row < times.len()).collect();
        rows.dedup();
        let places: Vec<f64> = rows.iter().map(|row| *row as f64).collect();
        let motion = Motion::new(place, displacements, &places, has_slider(topics))?;
        let last = rows.last().map_or(start, |row| times[*row]);
        let instants =
            format!("{} positions in {during}, from {start:.3} s (pale) to {last:.3} s (dark), {apart_s:.3} s apart", rows.len());
        let title = format!("{place}: the mechanism at even instants");
        Ok(MechanismPicture { warning: None, misses_vibration: false, title, instants, motion, playing_s: None })
    }

    /// The recorded mechanism moving, at `speed` recorded seconds per second; without a speed, at the highest of the usual ones
    /// at which the motion is seen and a turn takes two seconds or more. A vibration counts if the whole is not too long for it.
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
        let warning = shortcoming.map(|shortcoming| format!("{place}: {shortcoming}{}", advice(&recorded)));
        if playback.places.len() < 2 {
            return Err(PlotError::Request(warning.unwrap_or_default()));
        }
        let (speed, recorded_s) = (playback.speed, playback.recorded_s);
        let digits = if recorded_s < 0.1 - 1e-9 { 4 } else { 2 };
        let instants = format!("{recorded_s:.digits$} s at {speed} times the real speed");
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

/// Names a speed at which the motion is seen, after the reason why it is not. Nothing if no usual speed shows it.
fn advice(recorded: &RecordedMotion<'_>) -> String {
    let Some(Playback { speed, recorded_s, is_whole, .. }) = Playback::showing(recorded) else { return String::new() };
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
