//! Periodic motions that were not found: what is said of them, and the exit code.

use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::periodic::{Found, extent};
use super::signals::Interruption;
use crate::small_motion::NoModes;
use crate::small_motion::error::FloquetError;

/// The way on where a search ends without a motion.
const PERHAPS_NONE: &str = "there may be none, as near a resonance or where a link buckles: `flexcrank run` shows whether the motion \
                            repeats itself";

/// The warnings of motions that were not found, and how the command ends.
pub(super) fn conclude(speeds: &[f64], all_found: &[Vec<Found>], interruption: &Interruption) -> CommandResult {
    if let ([_], [found]) = (speeds, all_found)
        && let [Some(Err(refusal))] = found.as_slice()
    {
        return Err(match refusal {
            NoModes::NotPeriodic(FloquetError::Step { .. } | FloquetError::NotConverged { .. }) => {
                let sweep = "a sweep, as --speed 10:20:1, begins each search at the motion before";
                Failure::Usage(format!("{refusal}; {PERHAPS_NONE}, and {sweep}"))
            }
            _ => refusal.clone().into(),
        });
    }
    let mut refusals: Vec<(String, Vec<f64>)> = Vec::new();
    for (speed, refusal) in all_found.iter().flat_map(|found| speeds.iter().zip(found)) {
        let Some(Err(refusal)) = refusal else { continue };
        // The figures in it differ from speed to speed.
        let why = refusal.to_string();
        match refusals.iter_mut().find(|(other, _)| alike(other, &why)) {
            Some((_, speeds)) => speeds.push(*speed),
            None => refusals.push((why, vec![*speed])),
        }
    }
    for (why, speeds) in &refusals {
        match speeds.len() {
            1 => say!("warning: {} rad/s: {why}", extent(speeds)),
            count => say!("warning: {count} motions {} rad/s, such as this: {why}", extent(speeds)),
        }
    }
    let refused: usize = refusals.iter().map(|(_, speeds)| speeds.len()).sum();
    let all = all_found.len() * speeds.len();
    let done = all_found.iter().flatten().filter(|found| matches!(found, Some(Ok(_)))).count();
    if interruption.is_asked() && done + refused < all {
        say_reason!("warning: interrupted: {done} of {all} motions were found");
        return Ok(ExitStatus::Interrupted);
    }
    match refused {
        0 => Ok(ExitStatus::Success),
        _ => {
            let is_sought = refusals.iter().any(|(why, _)| why.starts_with("no periodic motion was found"));
            let perhaps = if is_sought { format!("; {PERHAPS_NONE}") } else { String::new() };
            Err(Failure::Failed(format!("{refused} of {all} motions were not found{perhaps}")))
        }
    }
}

/// Whether two sentences differ by figures at most.
fn alike(one: &str, other: &str) -> bool {
    let words = |text: &str| text.chars().filter(|c| c.is_alphabetic()).collect::<String>();
    words(one) == words(other)
}
