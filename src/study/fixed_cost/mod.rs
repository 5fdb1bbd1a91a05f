//! Finds the number of Newton corrections that suffices for steps of fixed cost: see [`FixedCost`](crate::integrate::FixedCost).

mod error;
mod limits;
mod trial;

use std::fmt;

use crate::scene::Scene;
use crate::simulation::{Diverged, PulseRequest};
use crate::study::duration::usual_until_s;
pub use error::NotRated;
use limits::{LARGEST_TOLERANCE, MOST_CORRECTIONS, MOST_LEFT, SMALLEST_TOLERANCE};
pub use trial::TrialErrors;
use trial::{Trial, Window, test_pulse};

/// The iteration may add this part of the time step's own error.
pub const PART: f64 = 0.1;
/// The loads that move a scene.
const LOADS_OF_CHAIN: &str = "pulses, a torque, a start rate or a [drive]";
const LOADS_OF_OSCILLATOR: &str = "start_m or forces_n";
/// A step is counted as unconverged if it leaves this many times the most that any step of the trials left.
const MARGIN: f64 = 10.0;

/// The corrections that suffice for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Rating {
    /// Newton corrections in each stage; 0 with a method that does not iterate.
    pub corrections: usize,
    /// Residual above which a step is counted as unconverged, relative to the forces at work; `None` without iteration.
    pub tolerance: Option<f64>,
    /// Simulated duration of each trial, s.
    pub until_s: f64,
    /// The scene as it stands, and with a test pulse if torque acts on it; those in which something moves.
    pub trials: Vec<TrialErrors>,
    /// Unit of the errors: of an angle, or of a deflection over the link's length; or of a displacement.
    pub unit: &'static str,
}

/// Finds the least number of corrections whose motion differs from that of the converged iteration by less than [`PART`] of the time
/// step's own error, in every trial. `progress` gets the number of corrections that is tried.
///
/// The time step's error is the difference between steps to the tolerance and steps half as long. Trials are the scene from its start,
/// and the same with a rectangular pulse that begins and ends inside steps. No clock decides: the result is the same on every machine.
///
/// # Errors
/// [`NotRated`] when the scene does not run, or no number suffices.
pub fn rate(scene: &Scene, progress: &mut dyn FnMut(usize)) -> Result<Rating, NotRated> {
    let mut scene = scene.clone();
    scene.solver.tolerance = scene.solver.tolerance.min(SMALLEST_TOLERANCE);
    let window = Window::new(&scene, usual_until_s(&scene))?;
    let pulses = [Some(None), test_pulse(&scene, &window).map(Some)];
    let most = if scene.solver.iterates() { MOST_CORRECTIONS } else { 0 };
    progress(most);
    let trials = pulses.into_iter().flatten().map(|pulse| Trial::new(&scene, window, pulse, most));
    let mut trials = trials.collect::<Result<Vec<_>, _>>()?;
    // At rest, every number suffices, and errors are rounding.
    trials.retain(Trial::moves);
    if trials.is_empty() {
        let loads = if scene.chain().is_some() { LOADS_OF_CHAIN } else { LOADS_OF_OSCILLATOR };
        return Err(NotRated::Still { until_s: window.until_s(), loads });
    }
    for corrections in most.min(1)..=most {
        progress(corrections);
        // A run that diverges has too few.
        let errors: Result<Vec<TrialErrors>, Diverged> = trials.iter().map(|trial| trial.errors(&scene, corrections)).collect();
        let Ok(errors) = errors else { continue };
        let left = errors.iter().map(|errors| errors.left_over).fold(0.0, f64::max);
        let suffices = errors.iter().all(|errors| errors.by_iteration <= PART * errors.of_step);
        if suffices && left <= MOST_LEFT {
            let tolerance = (most > 0).then(|| rounded_up(MARGIN * left).clamp(SMALLEST_TOLERANCE, LARGEST_TOLERANCE));
            let unit = if scene.chain().is_some() { "rad" } else { "m" };
            return Ok(Rating { corrections, tolerance, until_s: window.until_s(), trials: errors, unit });
        }
    }
    Err(NotRated::TooSlow)
}

/// The next number with two digits.
fn rounded_up(x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let digit = 10_f64.powf(x.log10().floor() - 1.0);
    let rounded = (x / digit).ceil() * digit;
    format!("{rounded:.1e}").parse().unwrap_or(rounded)
}

impl Rating {
    /// The keys that set it, as `KEY=VALUE` of `--set`.
    pub fn keys(&self) -> Vec<String> {
        let tolerance = self.tolerance.map(|tolerance| format!("solver.tolerance={tolerance:e}"));
        std::iter::once(format!("solver.corrections={}", self.corrections)).chain(tolerance).collect()
    }
}

impl fmt::Display for Rating {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.corrections {
            0 => f.write_str("fixed cost: the method does not iterate")?,
            1 => f.write_str("fixed cost: 1 correction a stage")?,
            number => write!(f, "fixed cost: {number} corrections a stage")?,
        }
        for TrialErrors { pulse, of_step, by_iteration, by_loads, .. } in &self.trials {
            match pulse {
                None => write!(f, ", adds ")?,
                Some(PulseRequest { torque_nm, .. }) => write!(f, "; with a pulse of {torque_nm} N·m inside steps, adds ")?,
            }
            if self.corrections > 0 {
                write!(f, "{by_iteration:.1e} {} to an error of {of_step:.1e} {}", self.unit, self.unit)?;
            } else {
                write!(f, "nothing to an error of {of_step:.1e} {}", self.unit)?;
            }
            if *by_loads > by_iteration.max(PART * of_step) {
                write!(f, ", and {by_loads:.1e} {} because loads that jump do not cut a step", self.unit)?;
            }
        }
        write!(f, " (over {} s)", crate::shown::shown_s(self.until_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    fn rated(overrides: &[&str]) -> Result<Rating, NotRated> {
        let overrides: Vec<String> = overrides.iter().map(|change| (*change).to_owned()).collect();
        rate(&SceneSource::open("crank-slider", &overrides).unwrap().scene, &mut |_| ())
    }

    /// One correction was "the least that suffices" for a scene at rest, and a pulse then ended the run; under weight, rounding asked
    /// for twenty.
    #[test]
    fn regress_a_scene_at_rest_is_not_rated() {
        assert_eq!(rated(&["pulse=[]"]), Err(NotRated::Still { until_s: 2.0, loads: LOADS_OF_CHAIN }));
        let under_weight = ["pulse=[]", "drive.speed_rad_per_s=0", "gravity.y_m_per_s2=-9.81", "start.static_equilibrium=true"];
        assert_eq!(rated(&under_weight), Err(NotRated::Still { until_s: 2.0, loads: LOADS_OF_CHAIN }));
        // All of the motion in one step.
        assert!(rated(&["pulse=[]", "drive.table=[[0,0],[0.002,0.1]]"]).is_ok_and(|rating| rating.until_s == 0.002));
        // The scene's pulse comes after the trial, and the test pulse in it.
        let late = rated(&["solver.step_s=1e-4", "pulse.0.start_s=1.9"]).unwrap();
        assert!(late.trials.len() == 1 && late.trials.iter().all(|trial| trial.pulse.is_some()), "{late}");
    }

    #[test]
    fn val_tolerances_have_two_digits() {
        assert_eq!([3.21e-7, 9.99e-5, 1e-3, 0.0].map(rounded_up), [3.3e-7, 1e-4, 1e-3, 0.0]);
    }
}
