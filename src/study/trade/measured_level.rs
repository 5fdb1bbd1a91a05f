//! A setting that is a level, with everything measured of it.

use super::sweep::Row;
use super::verification::Trial;

/// A setting that is a level.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredLevel {
    /// Its row of the study.
    pub row: Row,
    /// Simulated seconds per second there, by the slowest repeat.
    pub real_time_factor: f64,
    /// Its verification.
    pub trial: Trial,
    /// Error of the first link's chord angle, rad: the larger one of the study and the verification.
    pub error_rad: f64,
}

impl MeasuredLevel {
    /// Errors and speeds, as in a comment.
    pub(super) fn comment(&self) -> String {
        let (mark, error) = self.row.outcome.as_ref().map_or(("", f64::NAN), |measured| (measured.mark, measured.error));
        let (speed, trial) = (self.real_time_factor, &self.trial);
        let other = format!("{} {:.2e} at {:.2}", trial.variation, trial.error, trial.real_time_factor);
        format!("error {mark}{error:.2e} at {speed:.2} times real time by its slowest repeat; {other}")
    }
}
