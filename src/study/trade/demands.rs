//! Demands on a configuration, and the refusal where none holds them.

use std::fmt;

use super::configuration::Configuration;
use super::output_group::OutputGroup;
use super::reference::{FinerBudget, NoReference};
use super::verification::Variation;

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
    /// The tolerance is not known to be met by any, at any speed.
    Tolerance {
        /// The one with the least error that is certain.
        best: Box<Configuration>,
        /// Its error over the tolerance.
        times: f64,
        /// The output that errs most.
        output: OutputGroup,
        /// The study's word for it.
        word: &'static str,
        /// How well the reference knows this error.
        excess: Excess,
        /// The word for the output whose error may be larger, as the reference does not know it well, and the error that is reported
        /// for it over the tolerance.
        perhaps: Option<(&'static str, f64)>,
        /// Configurations that the budget did not allow.
        left_out: usize,
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
        /// Configurations that the budget did not allow.
        left_out: usize,
    },
    /// All that held both failed when they were verified.
    Verification(Unverified),
    /// The other run has no reference.
    NoVerification(Variation, NoReference),
    /// The budget allowed none.
    NoneBegun {
        /// The budget, s.
        budget_s: f64,
        /// Configurations that it did not allow.
        left_out: usize,
    },
    /// No configuration ran to its end.
    Nothing,
}

/// How well the reference knows an error that is not within the tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Excess {
    /// The error is measured, by a reference that is ten times better.
    Measured,
    /// The error is at least this, whatever the reference becomes.
    AtLeast,
    /// The error is at most this: a finer reference may find it within the tolerance.
    AtMost {
        /// Time budget of a study that refines it so far, as is expected or may be; `None` if no study does.
        sufficient_budget: Option<FinerBudget>,
    },
}

/// The configuration that came nearest, or the last one tried as a level, and why its verification failed.
#[derive(Debug, Clone, PartialEq)]
pub struct Unverified {
    /// The configuration.
    pub configuration: Configuration,
    /// Number of configurations that were tried.
    pub tried: usize,
    /// Its error over the tolerance.
    pub error_times: f64,
    /// The demanded speed over what it reached.
    pub speed_times: f64,
    /// How the run that verifies differs from the scene.
    pub variation: Variation,
    /// Whether the error is that of energy over ten minutes, instead of that other run.
    pub over_ten_minutes: bool,
    /// Whether the uncertainty of the reference may account for the error.
    pub reference: bool,
    /// Time budget that refines that reference so far that it can be judged, as is expected or may be; `None` if none does.
    pub sufficient_budget: Option<FinerBudget>,
    /// Whether the budget left out finer configurations.
    pub left_out: bool,
}

/// The beginning of a refusal where the budget ended the table.
const NONE_MEASURED: &str = "no configuration that was measured holds the tolerance";

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Tolerance { best, times, word, excess, perhaps, left_out, .. } => {
                let (fails, part) = match excess {
                    Excess::Measured if *left_out > 0 => (NONE_MEASURED, ""),
                    Excess::AtLeast if *left_out > 0 => (NONE_MEASURED, "at least "),
                    Excess::Measured => ("the tolerance fails", ""),
                    Excess::AtLeast => ("the tolerance fails", "at least "),
                    Excess::AtMost { .. } => ("no configuration is known to hold the tolerance", "up to "),
                };
                let (reason, skipped) = (excess.reason(), skipped(*left_out));
                write!(f, "{fails}: the best, {best}, is {part}{} times over it in {word}{reason}", factor(*times))?;
                if let Some((larger, times)) = perhaps {
                    let within = if larger == word { String::new() } else { format!(" in {larger}") };
                    write!(f, ", and perhaps {} times{within}, which the reference does not know well", factor(*times))?;
                }
                f.write_str(&skipped)
            }
            Refusal::Speed { best, times } => {
                write!(
                    f,
                    "the real-time factor fails: the fastest, {best}, is {} times too slow by its slowest repeat",
                    factor(*times)
                )
            }
            Refusal::Both { accurate, speed_times, fast, error_times, left_out } => write!(
                f,
                "no configuration holds both: within the tolerance the fastest, {accurate}, is {} times too slow \
                 by its slowest repeat; at the speed the best, {fast}, is {} times over the tolerance{}",
                factor(*speed_times),
                factor(*error_times),
                skipped(*left_out)
            ),
            Refusal::Verification(unverified) => write!(f, "verification fails {unverified}"),
            Refusal::NoVerification(variation, none) => write!(f, "verification fails {variation}: no reference: {none}"),
            Refusal::NoneBegun { budget_s, left_out } => write!(
                f,
                "the budget of {budget_s} s allows no configuration to be measured ({left_out} skipped): choose a larger --budget"
            ),
            Refusal::Nothing => f.write_str("no configuration ran to its end"),
        }
    }
}

/// The remark on configurations that the budget did not allow, among which one may hold.
fn skipped(left_out: usize) -> String {
    match left_out {
        0 => String::new(),
        count => format!("; with a larger --budget, more are measured ({count} skipped)"),
    }
}

impl Excess {
    /// The rest of a refusal that is due to the reference, with the budget that should help; empty of any other.
    fn reason(self) -> String {
        let Excess::AtMost { sufficient_budget } = self else { return String::new() };
        let remedy = match sufficient_budget {
            Some(budget) if budget.is_likely => format!("--budget {}min should refine it so far", budget.minutes()),
            Some(budget) => format!("--budget {}min refines it further, perhaps so far", budget.minutes()),
            None => "no --budget refines it so far".to_owned(),
        };
        format!(": the reference itself is not known well enough to judge (see its estimate); {remedy}")
    }
}

/// A factor with three decimals, or as a power of ten where it would be long.
fn factor(times: f64) -> String {
    if times < 1e4 { format!("{times:.3}") } else { format!("{times:.1e}") }
}

impl fmt::Display for Unverified {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Unverified { configuration, tried, error_times, speed_times, .. } = self;
        let run = if self.over_ten_minutes { "in energy over ten minutes".to_owned() } else { self.variation.to_string() };
        let error = format!("has {} times the tolerance there", factor(*error_times));
        let time = format!("needs in its slowest repeat {} times the time allowed", factor(*speed_times));
        let looser = match (self.reference, self.sufficient_budget, self.left_out) {
            (true, Some(budget), _) => {
                let refines =
                    if budget.is_likely { "should refine the reference so far" } else { "refines the reference further" };
                format!("a looser --tolerance, or --budget {}min, which {refines}", budget.minutes())
            }
            (true, None, _) => "a looser --tolerance, as no --budget refines the reference so far".to_owned(),
            (false, _, true) => "a looser --tolerance, or a larger --budget, which measures finer configurations".to_owned(),
            (false, _, false) => "a looser --tolerance".to_owned(),
        };
        let nearest = if *tried > 1 { format!("the nearest of {tried}, {configuration},") } else { configuration.to_string() };
        write!(f, "{run}: {nearest} ")?;
        match (*error_times > 1.0, *speed_times > 1.0) {
            (true, true) => write!(f, "{error}, and {time}; choose {looser}, and a smaller --real-time-factor"),
            (true, false) => write!(f, "{error}; choose {looser}"),
            (false, true) => write!(f, "{time}; choose a smaller --real-time-factor"),
            // A level may be refused without a tolerance.
            (false, false) => f.write_str("errs by more than is of use there"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::configuration::Family;
    use super::*;
    use crate::scene::{IntegratorKind, ModelKind};

    #[test]
    fn regress_a_failed_verification_names_its_reasons_and_the_way_on() {
        let family = Family {
            model: ModelKind::Modal,
            integrator: IntegratorKind::Esdirk,
            resolution: 3,
            rigid: vec![false, false],
            axial: vec![false; 2],
        };
        let own = Configuration { family, step_s: 5e-4 };
        let unverified = |[error_times, speed_times]: [f64; 2], [over_ten_minutes, reference, left_out]: [bool; 3]| {
            let (configuration, tried) = (own.clone(), if over_ten_minutes { 12 } else { 1 });
            let sufficient_budget = left_out.then_some(FinerBudget { budget_s: 530.0, is_likely: true });
            Refusal::Verification(Unverified {
                configuration,
                tried,
                error_times,
                speed_times,
                variation: Variation::SpeedAndPulse,
                over_ten_minutes,
                reference,
                sufficient_budget,
                left_out,
            })
        };
        let [other, energy] = ["on another speed and pulse", "in energy over ten minutes"];
        let [error, time] = ["has 1.055 times the tolerance there", "needs in its slowest repeat 1.200 times the time allowed"];
        let [looser, slower] = ["choose a looser --tolerance", "a smaller --real-time-factor"];
        let (budget, refines) = ("or a larger --budget, which", "which should refine the reference so far");
        for (times, facts, run, said) in [
            ([1.055, 0.014], [false; 3], other, format!("{error}; {looser}")),
            ([1.055, 0.014], [true, false, false], energy, format!("{error}; {looser}")),
            ([1.055, 0.014], [false, true, true], other, format!("{error}; {looser}, or --budget 9min, {refines}")),
            (
                [1.055, 0.014],
                [false, true, false],
                other,
                format!("{error}; {looser}, as no --budget refines the reference so far"),
            ),
            ([1.055, 0.014], [true, false, true], energy, format!("{error}; {looser}, {budget} measures finer configurations")),
            ([0.0, 1.2], [false, false, true], other, format!("{time}; choose {slower}")),
            ([1.055, 1.2], [false; 3], other, format!("{error}, and {time}; {looser}, and {slower}")),
            ([2.5e8, 0.0], [false; 3], other, format!("has 2.5e8 times the tolerance there; {looser}")),
            ([0.0, 0.9], [false; 3], other, "errs by more than is of use there".to_owned()),
        ] {
            let nearest = if facts[0] { format!("the nearest of 12, {own},") } else { own.to_string() };
            assert_eq!(unverified(times, facts).to_string(), format!("verification fails {run}: {nearest} {said}"));
        }
    }
}
