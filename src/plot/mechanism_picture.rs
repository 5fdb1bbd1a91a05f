//! Pictures of a recorded mechanism: still at several instants, or moving.

use super::canvas::Lettering;
use super::error::PlotError;
use super::mechanism::{Motion, times, turned};
use super::output::{Format, Picture};
use super::{animation, strobe};
use crate::study::Table;

/// Number of positions in a strobe figure.
const POSITIONS: usize = 12;
/// Pictures of an animation per second of playing; the viewer moves evenly from one to the next.
const PICTURES_HZ: f64 = 15.0;
/// Longest time of playing, s: a file in a README should stay small.
const LONGEST_S: f64 = 10.0;
/// Time in which a turn can be followed by eye, s.
const TURN_S: f64 = 2.0;

/// A mechanism at several instants, or moving.
#[derive(Debug, Clone, PartialEq)]
pub struct MechanismPicture {
    /// Instants, speed and magnification, in words.
    pub caption: String,
    title: String,
    motion: Motion,
    /// Time of playing; `None` for a still picture.
    playing_s: Option<f64>,
}

impl MechanismPicture {
    /// Positions of the topic `displacements` at even instants of its first turn, or of its whole time if nothing turns.
    ///
    /// # Errors
    /// [`PlotError::Request`] when no link is recorded.
    pub fn strobe(place: &str, displacements: &Table) -> Result<Self, PlotError> {
        let (times, turn) = (times(displacements), turned(displacements));
        let start = times.first().copied().unwrap_or_default();
        let end = turn.map_or(times.last(), |row| times.get(row)).copied().unwrap_or_default();
        // After a turn the mechanism is where it was.
        let (steps, during) = if turn.is_some() { (POSITIONS, "one turn") } else { (POSITIONS - 1, "the recorded time") };
        let apart_s = (end - start) / steps as f64;
        let row = |number: usize| times.partition_point(|time| *time < start + apart_s * number as f64 - 1e-9);
        let mut rows: Vec<usize> = (0..POSITIONS).map(row).filter(|row| *row < times.len()).collect();
        rows.dedup();
        let motion = Motion::new(place, displacements, &rows)?;
        let last = rows.last().map_or(start, |row| times[*row]);
        let caption = format!(
            "{} positions in {during}, from {start:.3} s (pale) to {last:.3} s (dark), {apart_s:.3} s apart{}",
            rows.len(),
            motion.magnification()
        );
        Ok(MechanismPicture { title: format!("{place}: the mechanism at even instants"), caption, motion, playing_s: None })
    }

    /// The topic `displacements` moving, at `speed` recorded seconds per second; without a speed, at the highest of the usual
    /// ones at which a turn takes two seconds or more.
    ///
    /// # Errors
    /// [`PlotError::Request`] when no link is recorded.
    pub fn animation(place: &str, displacements: &Table, speed: Option<f64>) -> Result<Self, PlotError> {
        let times = times(displacements);
        let slow = || {
            let turn_s = turned(displacements).map_or(TURN_S, |row| times[row] - times[0]);
            [1.0, 0.5, 0.25, 0.1, 0.05, 0.025].into_iter().find(|speed| turn_s / speed >= TURN_S).unwrap_or(0.01)
        };
        let speed = speed.unwrap_or_else(slow);
        let start = times.first().copied().unwrap_or_default();
        let row = |picture: u32| {
            let at = start + f64::from(picture) * speed / PICTURES_HZ;
            times.partition_point(|time| *time < at - 1e-9)
        };
        let pictures = 0..=(LONGEST_S * PICTURES_HZ) as u32;
        let rows: Vec<usize> = pictures.map(row).take_while(|row| *row < times.len()).collect();
        let motion = Motion::new(place, displacements, &rows)?;
        let recorded_s = rows.last().map_or(0.0, |last| times[*last] - start);
        let caption = format!("{recorded_s:.2} s at {speed} times the real speed{}", motion.magnification());
        let title = format!("{place}: the mechanism, moving");
        Ok(MechanismPicture { title, caption, motion, playing_s: Some(recorded_s / speed) })
    }
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
            Some(playing_s) => animation::draw(&format!("{}, {}", self.title, self.caption), &self.motion, playing_s, lettering),
            None => strobe::draw(&self.title, &self.caption, &self.motion, lettering),
        }
    }
}
