//! The error of a scene's time step, seen by a run with half of it.

use std::time::{Duration, Instant};

use super::trial_run::{LONGEST, Look, Trial};
use crate::scene::Scene;
use crate::simulation::Simulation;

/// Longest run with half the step, computing time.
const LONGEST_HALVED: Duration = LONGEST.saturating_mul(2);

/// The first link's angle in two runs, with the scene's step and with half of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StepError {
    /// Largest difference, rad.
    pub(super) largest_rad: f64,
    /// Simulated time over which they were compared, s.
    pub(super) until_s: f64,
}

impl StepError {
    /// Compares a run of the scene with one of half the step, as far as that comes in [`LONGEST_HALVED`]. `None` if there is no link, or
    /// nothing to compare.
    ///
    /// A method of order p errs by `2ᵖ/(2ᵖ − 1)` times the difference, 4/3 times for p = 2, where the step is short enough.
    pub(super) fn of(scene: &Scene, own: &Trial) -> Option<Self> {
        let mut halved = scene.clone();
        halved.solver.step_s *= 0.5;
        let (begun, mut run) = (Instant::now(), Simulation::new(&halved).ok()?);
        let (mut found, mut steps): (Option<Self>, u32) = (None, 0);
        'looks: for Look { step, angle_rad } in &own.looks {
            while steps < 2 * step {
                if begun.elapsed() > LONGEST_HALVED || run.step().is_err() {
                    break 'looks;
                }
                steps += 1;
            }
            let Some(other_rad) = run.observe().ok().and_then(|seen| Some(seen.links.first()?.chord_rad)) else { break };
            let largest_rad = (angle_rad - other_rad).abs().max(found.map_or(0.0, |found| found.largest_rad));
            found = Some(StepError { largest_rad, until_s: run.time_s() });
        }
        found
    }
}
