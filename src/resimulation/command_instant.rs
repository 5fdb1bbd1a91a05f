//! The instants of recorded commands on a grid of other steps.

use crate::simulation::Simulation;
use crate::wire::{AppliedCommand, applied_command};

/// Parts of a step that are rounding.
const ROUNDING: f64 = 1e-6;

/// The step at which a command is applied, for its instant in `steps` of the grid: a pulse may begin within a step, all else begins with
/// one.
pub(super) fn step_of(command: &AppliedCommand, steps: f64) -> f64 {
    let step = match command.command {
        Some(applied_command::Command::Torque(_)) => (steps + ROUNDING).floor(),
        _ => (steps - ROUNDING).ceil(),
    };
    step.max(0.0)
}

/// Whether a command at the instant `steps` of the grid falls into the step that ends at `step`, where it is applied.
pub(super) fn begins_within(steps: f64, step: f64) -> bool {
    steps + ROUNDING < step
}

/// Delays a pulse to its recorded instant, which may lie within the step that begins now.
pub(super) fn keep_instant(command: &mut AppliedCommand, simulation: &Simulation) {
    let recorded_s = command.stamp.unwrap_or_default().sim_time_s;
    if let Some(applied_command::Command::Torque(pulse)) = &mut command.command {
        let wait_s = recorded_s - simulation.time_s();
        if wait_s > ROUNDING * simulation.step_s() {
            pulse.delay_s += wait_s;
        }
    }
}
