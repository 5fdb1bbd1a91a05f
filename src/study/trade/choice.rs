//! The cheapest configuration that holds what a user demands, verified on runs that it was not chosen by.

use super::Study;
use super::configuration::Configuration;
use super::demands::{Demands, Excess, Refusal};
use super::reference::largest;
use super::sweep::{Measured, Row};
use super::verification::{Trial, Verification};
use crate::scene::Scene;

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

/// Chosen, or refused.
pub type Choice = Result<Chosen, Refusal>;

/// Runs over ten minutes at most, where energy counts.
const LONG_RUNS: usize = 12;

/// Chooses from a study of `scene`: verifies the candidates, the cheapest first, until one holds. Each takes the time that it took in
/// the study, at most. `budget_s` bounds the reference of the verifying run; `progress` is called before every run.
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
    let (mut nearest, mut tried, mut long_runs): (Option<(Trial, &Row)>, Vec<f64>, usize) = (None, Vec::new(), 0);
    for (row, measured) in candidates {
        progress(&row.configuration);
        let cost_s = measured.counted_s_per_s;
        tried.push(cost_s);
        let Ok(mut trial) = verification.run(&row.configuration) else { continue };
        if trial.holds(demands) {
            let Ok(error) = verification.long_energy(&row.configuration) else { continue };
            trial.long_energy = error;
            long_runs += usize::from(error.is_some());
        }
        if trial.holds(demands) {
            let passed_over = tried.iter().filter(|other_s| **other_s < cost_s).count();
            return Ok(Chosen { row: row.clone(), real_time_factor: speed(measured), trial, passed_over });
        }
        let missed = |trial: &Trial| trial.missed_times(demands);
        if nearest.as_ref().is_none_or(|(nearest, _)| missed(&trial) < missed(nearest)) {
            nearest = Some((trial, row));
        }
        if long_runs == LONG_RUNS {
            break;
        }
    }
    Err(nearest.map_or(Refusal::Nothing, |(trial, row)| verification.refusal(&trial, demands, (&row.configuration, tried.len()))))
}

/// Simulated seconds per second, by the slowest repeat.
pub(super) fn speed(measured: &Measured) -> f64 {
    measured.timing.slowest_per_s.recip()
}

/// Returns the configurations that meet the requirements, or the requirement that fails. The cheapest by counted work is the first; those
/// whose runs do not keep their energy balance come last.
pub(super) fn candidates<'a>(study: &'a Study, demands: &Demands) -> Result<Vec<(&'a Row, &'a Measured)>, Refusal> {
    let mut all: Vec<(&Row, &Measured)> = study.measured().collect();
    all.sort_by(|a, b| a.1.counted_s_per_s.total_cmp(&b.1.counted_s_per_s));
    let (accurate, fast) = (|m: &Measured| m.error <= demands.tolerance, |m: &Measured| speed(m) >= demands.real_time_factor);
    let holding: Vec<_> = all.iter().copied().filter(|(_, m)| accurate(m) && fast(m)).collect();
    if !holding.is_empty() {
        let (kept, other): (Vec<_>, Vec<_>) = holding.into_iter().partition(|(_, m)| m.balance_kept);
        return Ok([kept, other].concat());
    }
    let fastest = all.iter().copied().filter(|(_, m)| accurate(m)).max_by(|a, b| speed(a.1).total_cmp(&speed(b.1)));
    let best = all.iter().copied().filter(|(_, m)| fast(m)).min_by(|a, b| a.1.error.total_cmp(&b.1.error));
    Err(match (fastest, best) {
        (Some((a, m)), Some((b, n))) => Refusal::Both {
            accurate: Box::new(a.configuration.clone()),
            speed_times: demands.real_time_factor / speed(m),
            fast: Box::new(b.configuration.clone()),
            error_times: n.error / demands.tolerance,
            left_out: study.left_out,
        },
        (None, _) => no_accuracy(study, &all, demands),
        (Some((row, measured)), None) => {
            let (row, measured) = all.iter().copied().max_by(|a, b| speed(a.1).total_cmp(&speed(b.1))).unwrap_or((row, measured));
            Refusal::Speed { best: row.configuration.clone(), times: demands.real_time_factor / speed(measured) }
        }
    })
}

/// The refusal where no configuration is measured.
fn none_measured(study: &Study) -> Refusal {
    let Study { left_out, budget_s, .. } = *study;
    if study.rows.is_empty() && left_out > 0 { Refusal::NoneBegun { budget_s, left_out } } else { Refusal::Nothing }
}

/// The refusal where no configuration is known to be within the tolerance. The best has the least error that is certain: errors
/// that the reference does not know well may be less than measured.
fn no_accuracy(study: &Study, all: &[(&Row, &Measured)], demands: &Demands) -> Refusal {
    let (reference, outputs) = (&study.reference, study.outputs.as_slice());
    let certain = |m: &Measured| largest(outputs, |output| reference.certain_error(&m.errors, output));
    let certain_and_measured = |m: &Measured| [certain(m).map_or(0.0, |(_, error)| error), m.errors.worst(outputs)];
    let compared = |one: &Measured, other: &Measured| {
        let ([certain, measured], [other_certain, other_measured]) = (certain_and_measured(one), certain_and_measured(other));
        certain.total_cmp(&other_certain).then(measured.total_cmp(&other_measured))
    };
    let Some((row, best)) = all.iter().copied().min_by(|a, b| compared(a.1, b.1)) else { return none_measured(study) };
    let bounded = || largest(outputs, |output| reference.bounded_error(&best.errors, &[output]));
    let surely_over = certain(best).filter(|(_, error)| *error > demands.tolerance);
    let Some((output, error)) = surely_over.or_else(bounded) else { return Refusal::Nothing };
    let excess = match (surely_over, reference.mark(&best.errors, output)) {
        (Some(_), "") => Excess::Measured,
        (Some(_), _) => Excess::AtLeast,
        (None, _) => Excess::AtMost { sufficient_budget: reference.sufficient_budget(outputs, demands.tolerance) },
    };
    let larger = surely_over.and_then(|_| bounded()).filter(|(_, bound)| *bound > error);
    Refusal::Tolerance {
        perhaps: larger.map(|(other, bound)| (study.word(other), bound / demands.tolerance)),
        best: Box::new(row.configuration.clone()),
        times: error / demands.tolerance,
        output,
        word: study.word(output),
        excess,
        left_out: study.left_out,
    }
}
