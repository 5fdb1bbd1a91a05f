//! Ranges of speed in which a mode of a periodic motion is unstable.

use super::periodic::Found;
use crate::small_motion::{PeriodicMode, PeriodicModes};

/// Speeds that follow one another, at which one mode is the most unstable.
pub(super) struct Range {
    /// The mode.
    pub name: String,
    /// First and last speed, rad/s.
    pub from: f64,
    pub to: f64,
    /// Largest magnitude of its multiplier, and the speed there, rad/s.
    pub largest: f64,
    pub at: f64,
}

/// The ranges of a row of motions at these speeds.
pub(super) fn ranges(speeds: &[f64], found: &[Found]) -> Vec<Range> {
    let mut ranges: Vec<Range> = Vec::new();
    let mut open = false;
    for (speed, found) in speeds.iter().zip(found) {
        let size = |mode: &PeriodicMode| mode.multiplier.value.norm();
        let most = |modes: &PeriodicModes| modes.unstable().max_by(|one, other| size(one).total_cmp(&size(other))).cloned();
        let Some(unstable) = found.as_ref().and_then(|found| most(found.as_ref().ok()?)) else {
            open = false;
            continue;
        };
        let (name, size) = (unstable.mode.name(), unstable.multiplier.value.norm());
        match ranges.last_mut().filter(|range| open && range.name == name) {
            Some(range) => {
                range.to = *speed;
                if size > range.largest {
                    (range.largest, range.at) = (size, *speed);
                }
            }
            None => ranges.push(Range { name, from: *speed, to: *speed, largest: size, at: *speed }),
        }
        open = true;
    }
    ranges
}
