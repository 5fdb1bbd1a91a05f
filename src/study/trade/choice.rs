//! The cheapest configuration that holds what a user demands, verified on runs that it was not chosen by.

use std::fmt;

use super::Study;
use super::configuration::Configuration;
use super::output_group::OutputGroup;
use super::run::Failed;
use super::sweep::{Measured, Row};
use super::verification::{Trial, Verification};
use crate::scene::Scene;

/// Requirements on the choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Demands {
    /// Bound of the largest relative error among the outputs.
    pub tolerance: f64,
    /// Simulated seconds per second of computing, at least.
    pub real_time_factor: f64,
}

/// The configuration that holds both demands on all runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// Its row of the study.
    pub row: Row,
    /// Simulated seconds per second there, by the slowest repeat.
    pub real_time_factor: f64,
    /// Its verification.
    pub trial: Trial,
    /// Cheaper ones that failed only their verification.
    pub passed_over: usize,
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

/// Chosen, or refused.
pub type Choice = Result<Chosen, Refusal>;

/// Candidates that are verified at most.
const CANDIDATES: usize = 12;

/// Chooses from a study of `scene`. `budget_s` bounds the reference of the verifying run; `progress` is called before every run.
///
/// # Errors
/// [`Refusal`] if no configuration meets the requirements.
pub fn choose(
    scene: &Scene,
    study: &Study,
    demands: &Demands,
    budget_s: f64,
    progress: &mut dyn FnMut(&Configuration),
) -> Choice {
    let candidates = candidates(study, demands)?;
    let verification = Verification::new(scene, study, demands.tolerance, budget_s, progress)?;
    let mut refusal = Refusal::Nothing;
    for (passed_over, (row, measured)) in candidates.into_iter().take(CANDIDATES).enumerate() {
        progress(&row.configuration);
        let Ok(mut trial) = verification.run(&row.configuration) else { continue };
        if trial.holds(demands) {
            let Ok(error) = verification.long_energy(&row.configuration) else { continue };
            trial.long_energy = error;
        }
        if trial.holds(demands) {
            return Ok(Chosen { row: row.clone(), real_time_factor: speed(measured), trial, passed_over });
        }
        refusal = trial.refusal(demands, &row.configuration);
    }
    Err(refusal)
}

/// Simulated seconds per second, by the slowest repeat.
pub(super) fn speed(measured: &Measured) -> f64 {
    measured.timing.slowest_per_s.recip()
}

/// Returns the configurations that meet the requirements, cheapest first by counted work, or the requirement that fails.
pub(super) fn candidates<'a>(study: &'a Study, demands: &Demands) -> Result<Vec<(&'a Row, &'a Measured)>, Refusal> {
    let mut all: Vec<(&Row, &Measured)> = study.measured().collect();
    all.sort_by(|a, b| a.1.counted_s_per_s.total_cmp(&b.1.counted_s_per_s));
    let (accurate, fast) = (|m: &Measured| m.error <= demands.tolerance, |m: &Measured| speed(m) >= demands.real_time_factor);
    let holding: Vec<_> = all.iter().copied().filter(|(_, m)| accurate(m) && fast(m)).collect();
    if !holding.is_empty() {
        return Ok(holding);
    }
    let fastest = all.iter().copied().filter(|(_, m)| accurate(m)).max_by(|a, b| speed(a.1).total_cmp(&speed(b.1)));
    let best = all.iter().copied().filter(|(_, m)| fast(m)).min_by(|a, b| a.1.error.total_cmp(&b.1.error));
    Err(match (fastest, best) {
        (Some((a, m)), Some((b, n))) => Refusal::Both {
            accurate: Box::new(a.configuration.clone()),
            speed_times: demands.real_time_factor / speed(m),
            fast: Box::new(b.configuration.clone()),
            error_times: n.error / demands.tolerance,
        },
        (None, _) => no_accuracy(study, &all, demands),
        (Some((row, measured)), None) => {
            let (row, measured) = all.iter().copied().max_by(|a, b| speed(a.1).total_cmp(&speed(b.1))).unwrap_or((row, measured));
            Refusal::Speed { best: row.configuration.clone(), times: demands.real_time_factor / speed(measured) }
        }
    })
}

fn no_accuracy(study: &Study, all: &[(&Row, &Measured)], demands: &Demands) -> Refusal {
    let Some((row, measured)) = all.iter().min_by(|a, b| a.1.error.total_cmp(&b.1.error)) else { return Refusal::Nothing };
    let told = |output: &OutputGroup| measured.errors.of(*output).max(study.reference.estimate.of(*output));
    let output = study.outputs.iter().copied().max_by(|a, b| told(a).total_cmp(&told(b))).unwrap_or(OutputGroup::Angle);
    Refusal::Tolerance {
        best: row.configuration.clone(),
        times: measured.error / demands.tolerance,
        output,
        reference: study.reference.estimate.of(output) > demands.tolerance,
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Tolerance { best, times, output, reference } => {
                write!(f, "the tolerance fails: the best, {best}, is {times:.3} times over it in {}", output.as_str())?;
                if *reference {
                    write!(f, ", where the reference itself is not known so well (see its estimate)")
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
