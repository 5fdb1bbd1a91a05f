//! The recorded motion that the pictures of an animation have to show: turning, and the bending of links.
//!
//! Pictures that are too rare for a vibration show it at another, lower frequency (aliasing). The samples between two pictures
//! betray it: they leave the line from picture to picture.

use super::mechanism::{bending, between, times, turning_rad};
use crate::study::Table;

/// Fewer lines from picture to picture may be off, as at a single knock.
const FEWEST: usize = 2;
/// Bending of less than this part of the length is hardly seen, even drawn 1000 times as large.
const HARDLY_SEEN: f64 = 2e-5;
/// Slack for places between rows, in rows.
const SLACK: f64 = 1e-6;

/// The motion in the first epoch of a recording.
pub(super) struct RecordedMotion<'a> {
    /// Times of the rows, s.
    pub times: &'a [f64],
    /// Turning of the first link up to every row, rad.
    pub turning_rad: Vec<f64>,
    /// Bending of the links in every row, over their lengths.
    bending: Vec<(&'static str, Vec<f64>)>,
}

impl<'a> RecordedMotion<'a> {
    /// The motion in the topic `displacements`.
    pub fn of(displacements: &'a Table) -> Self {
        let (times, turning_rad) = (times(displacements), turning_rad(displacements));
        RecordedMotion { times, turning_rad, bending: bending(displacements) }
    }

    /// The largest turning from a picture to the next, rad, with pictures at these places between the rows.
    pub fn turning_between_pictures_rad(&self, places: &[f64]) -> f64 {
        let angles: Vec<f64> = places.iter().filter_map(|place| between(&self.turning_rad, *place)).collect();
        angles.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
    }

    /// The links of which lines from picture to picture miss a vibration: they are off by more than `most_off`, over the largest
    /// bending of all links meanwhile.
    pub fn missed_links(&self, places: &[f64], most_off: f64) -> Vec<&'static str> {
        let (Some(first), Some(last)) = (places.first(), places.last()) else { return Vec::new() };
        let rows = first.floor() as usize..last.ceil() as usize + 1;
        let meanwhile = self.bending.iter().filter_map(|(_, values)| values.get(rows.clone())).flatten();
        let largest = meanwhile.fold(HARDLY_SEEN, |most, value| most.max(value.abs()));
        let is_missed = |values: &[f64]| {
            let offs = places.windows(2).filter_map(|pair| self.off(values, [pair[0], pair[1]]));
            offs.filter(|off| *off > most_off * largest).count() >= FEWEST
        };
        self.bending.iter().filter(|(_, values)| is_missed(values)).map(|(link, _)| *link).collect()
    }

    /// The most by which the line between pictures at two places is off the samples between them; `None` where pictures are no
    /// rarer than samples, of which they show everything.
    fn off(&self, values: &[f64], [from, to]: [f64; 2]) -> Option<f64> {
        let [start_s, end_s] = [between(self.times, from)?, between(self.times, to)?];
        let [first, last] = [between(values, from)?, between(values, to)?];
        let line = |time_s: f64| first + (time_s - start_s) / (end_s - start_s) * (last - first);
        let off = |row: usize| (values[row] - line(self.times[row])).abs();
        let rows = from.ceil() as usize..to.floor() as usize + 1;
        (to - from > 1.0 + SLACK).then(|| rows.map(off).fold(0.0, f64::max))
    }
}
