//! Demands on a configuration, and the refusal where none holds them.

use std::fmt;

use super::configuration::Configuration;
use super::output_group::OutputGroup;
use super::run::Failed;

/// Requirements on the choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Demands {
    /// Bound of the largest relative error among the outputs.
    pub tolerance: f64,
    /// Simulated seconds per second of computing, at least.
    pub real_time_factor: f64,
}

/// Why no configuration will do.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The tolerance is met by none, at any speed.
    Tolerance {
        /// The most accurate.
        best: Configuration,
        /// Its error over the tolerance.
        times: f64,
        /// The output that errs most.
        output: OutputGroup,
        /// Whether it is the reference that is not known well enough.
        reference: bool,
    },
    /// The speed is reached by none, at any accuracy.
    Speed {
        /// The fastest.
        best: Configuration,
        /// The demand over what it reaches.
        times: f64,
    },
    /// Each demand can be met, but not both.
    Both {
        /// The fastest within the tolerance.
        accurate: Box<Configuration>,
        /// The demanded speed over what it reaches.
        speed_times: f64,
        /// The most accurate at the speed.
        fast: Box<Configuration>,
        /// Its error over the tolerance.
        error_times: f64,
    },
    /// All that held both failed on the other run.
    Verification {
        /// The last that was tried.
        last: Configuration,
        /// Its error there over the tolerance.
        error_times: f64,
        /// The demanded speed over what it reached there.
        speed_times: f64,
    },
    /// The other run has no reference.
    NoVerification(Failed),
    /// No configuration ran.
    Nothing,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Tolerance { best, times, output, reference } => {
                write!(f, "the tolerance fails: the best, {best}, is {times:.3} times over it in {}", output.as_str())?;
                if *reference {
                    f.write_str(
                        ", where the reference itself is not known so well (see its estimate): a larger --budget refines it",
                    )
                } else {
                    Ok(())
                }
            }
            Refusal::Speed { best, times } => {
                write!(f, "the real-time factor fails: the fastest, {best}, is {times:.3} times too slow")
            }
            Refusal::Both { accurate, speed_times, fast, error_times } => write!(
                f,
                "no configuration holds both: within the tolerance the fastest, {accurate}, is {speed_times:.3} times too slow; \
                 at the speed the best, {fast}, is {error_times:.3} times over the tolerance"
            ),
            Refusal::Verification { last, error_times: 0.0, speed_times } => {
                write!(f, "verification fails on another speed and pulse: {last} needs {speed_times:.3} times the time allowed")
            }
            Refusal::Verification { last, error_times, speed_times } => write!(
                f,
                "verification fails on another speed and pulse, or in energy over ten minutes: {last} has {error_times:.3} times \
                 the tolerance there, and needs {speed_times:.3} times the time allowed"
            ),
            Refusal::NoVerification(failed) => write!(f, "verification fails: no reference at another speed and pulse: {failed}"),
            Refusal::Nothing => f.write_str("no configuration ran to its end"),
        }
    }
}
