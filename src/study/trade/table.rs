//! A study as a table of numbers.

use super::fixed_cost::Corrections;
use super::lost_modes::{LostModes, ModeError};
use super::output_group::CHANNELS;
use super::reference::BOUND;
use super::sweep::{Measured, Row};
use super::{Study, WELL_RESOLVED};
use crate::study::Table;

/// The column, 1 in every row, that only the table of an interrupted study has: it is a part.
pub const INTERRUPTED: &str = "interrupted";
/// The column that is 1 where `error` is an upper bound: it is below the reference's own uncertainty, which stands in its place.
pub const ERROR_IS_BOUND: &str = "error_is_bound";
/// The column of the reference's own uncertainty in the output that `error` is of, relative as that.
pub const REFERENCE_ERROR: &str = "reference_error";

/// Every configuration with everything measured of it; what failed has empty measurements. Without `modes`, as after an
/// interruption, the cells of vibrations are empty.
pub fn table(study: &Study, modes: Option<&LostModes>) -> Table {
    let mut table = Table::default();
    let words = |of: &dyn Fn(&Row) -> String| study.rows.iter().map(of).collect::<Vec<_>>();
    let numbers = |of: &dyn Fn(&Measured) -> f64| -> Vec<f64> {
        study.rows.iter().map(|row| row.outcome.as_ref().map_or(f64::NAN, of)).collect()
    };
    table.push_words("model", words(&|row| row.configuration.family.model.as_str().to_owned()));
    table.push_words("integrator", words(&|row| row.configuration.family.integrator.as_str().to_owned()));
    table.push_words("discretization", words(&|row| row.configuration.family.discretization()));
    table.push_words("failure", words(&|row| row.outcome.as_ref().err().map(ToString::to_string).unwrap_or_default()));
    table.push("step_s", study.rows.iter().map(|row| row.configuration.step_s).collect());
    table.push("on_front", numbers(&|m| f64::from(u8::from(m.on_front))));
    let (reference, outputs) = (&study.reference, study.outputs.as_slice());
    let is_bound = |m: &Measured| reference.bounded_mark(&m.errors, outputs) == BOUND;
    table.push("error", numbers(&|m| m.error));
    table.push(ERROR_IS_BOUND, numbers(&|m| f64::from(u8::from(is_bound(m)))));
    table.push(REFERENCE_ERROR, numbers(&|m| reference.bounded_uncertainty(&m.errors, outputs)));
    let well = |m: &Measured| outputs.iter().all(|o| m.errors.of(*o) >= WELL_RESOLVED * reference.estimate.of(*o));
    table.push("reference_ten_times_better", numbers(&|m| f64::from(u8::from(well(m)))));
    table.push("observed_order", numbers(&|m| m.order.unwrap_or(f64::NAN)));
    table.push("observed_mesh_order", numbers(&|m| m.mesh_order.unwrap_or(f64::NAN)));
    table.push("seconds_per_simulated_s", numbers(&|m| m.timing.seconds_per_s));
    table.push("quickest_seconds_per_simulated_s", numbers(&|m| m.timing.quickest_per_s));
    table.push("slowest_seconds_per_simulated_s", numbers(&|m| m.timing.slowest_per_s));
    table.push("counted_seconds_per_simulated_s", numbers(&|m| m.counted_s_per_s));
    table.push("repeats", numbers(&|m| m.timing.repeats as f64));
    table.push("steps_per_s", study.rows.iter().map(steps_per_s).collect());
    table.push("step_p999_s", numbers(&|m| m.timing.step_p999_s));
    table.push("step_worst_s", numbers(&|m| m.timing.step_worst_s));
    table.push("steps", numbers(&|m| m.effort.steps as f64));
    table.push("residuals", numbers(&|m| m.effort.residuals as f64));
    table.push("newton_iterations", numbers(&|m| m.effort.newton_iterations as f64));
    table.push("factorizations", numbers(&|m| m.effort.factorizations as f64));
    table.push("steps_retried", numbers(&|m| m.effort.retried as f64));
    if study.is_rated() {
        let corrections = |m: &Measured| match m.corrections {
            Corrections::Suffice(number) => number as f64,
            Corrections::NotAsked | Corrections::NoneSuffice => f64::NAN,
        };
        table.push("corrections", numbers(&corrections));
    }
    table.push("balance_kept", numbers(&|m| f64::from(u8::from(m.balance_kept))));
    table.push("out_of_range", numbers(&|m| f64::from(u8::from(m.out_of_range))));
    for (k, channel) in CHANNELS.iter().enumerate() {
        table.push(format!("rms_error_{}", channel.name), numbers(&|m| m.errors.rms[k]));
        table.push(format!("max_error_{}", channel.name), numbers(&|m| m.errors.max[k]));
        table.push(format!("relative_error_{}", channel.name), numbers(&|m| m.errors.relative[k]));
    }
    table.push("estimated_error_angle_rad", numbers(&|m| m.estimated_angle_rad.unwrap_or(f64::NAN)));
    table.push("relative_error_energy", numbers(&|m| m.errors.energy));
    push_modes(&mut table, study.rows.len(), modes);
    if study.interrupted {
        table.push(INTERRUPTED, vec![1.0; study.rows.len()]);
    }
    table
}

/// The vibrations that each configuration loses, and its errors in the one that it computes worst; empty where these are not
/// known.
fn push_modes(table: &mut Table, rows: usize, modes: Option<&LostModes>) {
    let known = |row: usize| modes.filter(|modes| modes.is_known(row));
    let lost = |row: usize| known(row).map_or(String::new(), |modes| lost_or_none(&modes.lost(row)));
    table.push_words("lost_modes", (0..rows).map(lost).collect());
    let worst = |row: usize| known(row).and_then(|modes| modes.worst(row));
    let name = |row: usize| worst(row).map_or(String::new(), |(mode, _)| mode.name.clone());
    table.push_words("worst_mode", (0..rows).map(name).collect());
    let numbers = |of: &dyn Fn(&ModeError) -> f64| -> Vec<f64> {
        (0..rows).map(|row| worst(row).map_or(f64::NAN, |(_, error)| of(error))).collect()
    };
    table.push("worst_frequency_error", numbers(&|error| error.frequency));
    table.push("worst_damping_error", numbers(&|error| error.damping));
}

/// A cell that is not empty, as that of an unknown is.
fn lost_or_none(lost: &[String]) -> String {
    if lost.is_empty() { "none".to_owned() } else { lost.join(", ") }
}

/// Steps per second of computing.
fn steps_per_s(row: &Row) -> f64 {
    let measured = row.outcome.as_ref().ok();
    measured.map_or(f64::NAN, |measured| 1.0 / (row.configuration.step_s * measured.timing.seconds_per_s))
}
