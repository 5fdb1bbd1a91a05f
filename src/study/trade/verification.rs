//! Runs that verify a configuration: the same mechanism at another speed, by another pulse; or with more load.

use super::configuration::Configuration;
use super::demands::{Demands, Refusal, Unverified};
use super::errors::Errors;
use super::output_group::OutputGroup;
use super::reference::{Reference, WELL_RESOLVED};
use super::run::{Failed, energy_error, run, time};
use super::{REFERENCE_PART, Study};
use crate::scene::{Drive, End, Motion, Pulse, Resistance, Scene, System};
use std::fmt;

/// How the run that verifies differs from the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variation {
    /// Every motion is a fifth faster, every pulse a fifth weaker and half again as long (so its impulse a fifth larger).
    SpeedAndPulse,
    /// Nothing drives it: weight, resistance and the winding of its base spring are a fifth larger.
    Load,
}

/// One configuration's standing on the runs that verify it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// How the other run differs from the scene.
    pub variation: Variation,
    /// Errors on the other run.
    pub errors: Errors,
    /// The largest that counts.
    pub error: f64,
    /// The one of the first link's chord angle, rad; at least the uncertainty of the reference there.
    pub angle_rad: f64,
    /// Simulated seconds per second there, by the slowest repeat.
    pub real_time_factor: f64,
    /// Error of the energy balance in ten minutes of the scene itself, where energy counts and the rest holds.
    pub long_energy: Option<f64>,
}

const FASTER: f64 = 1.2;
const WEAKER: f64 = 0.8;
const LONGER: f64 = 1.5;
const HEAVIER: f64 = 1.2;
/// Duration over which energy must be kept, s. A short run shows little of a long one, in which energy errors reach the
/// vibrations that the step resolves worst.
const LONG_S: f64 = 600.0;

/// The other run and its reference.
pub(super) struct Verification<'a> {
    scene: &'a Scene,
    study: &'a Study,
    /// How the other run differs.
    pub(super) variation: Variation,
    other: Scene,
    reference: Reference,
}

impl<'a> Verification<'a> {
    /// Converges the other run's reference for errors of `tolerance`. `budget_s` bounds it; `progress` is called before every run.
    pub(super) fn new(
        scene: &'a Scene,
        study: &'a Study,
        tolerance: f64,
        budget_s: f64,
        progress: &mut dyn FnMut(&Configuration),
    ) -> Result<Self, Refusal> {
        let variation = Variation::of(scene);
        let other = variation.applied(scene);
        let chain = other.chain().ok_or(Refusal::Nothing)?;
        let wanted = (study.outputs.as_slice(), tolerance / WELL_RESOLVED);
        let reference = Reference::converge(&other, chain, &study.grid, wanted, REFERENCE_PART * budget_s, progress)
            .map_err(|none| Refusal::NoVerification(variation, none))?;
        Ok(Verification { scene, study, variation, other, reference })
    }

    /// Runs a configuration on the other run.
    pub(super) fn run(&self, configuration: &Configuration) -> Result<Trial, Failed> {
        let (run, seconds) = run(configuration, &self.other, &self.study.grid)?;
        let timing = time(configuration, &self.other, &self.study.grid, seconds)?;
        let errors = self.reference.errors(&run);
        let error = self.reference.bounded_error(&errors, &self.study.outputs);
        let angle_rad = self.reference.bounded_error(&errors, &[OutputGroup::Angle]);
        let real_time_factor = timing.slowest_per_s.recip();
        Ok(Trial { variation: self.variation, errors, error, angle_rad, real_time_factor, long_energy: None })
    }

    /// Error of the energy balance in ten minutes of the scene itself, if energy counts.
    pub(super) fn long_energy(&self, configuration: &Configuration) -> Result<Option<f64>, Failed> {
        let counts = self.study.outputs.contains(&OutputGroup::Energy);
        counts.then(|| energy_error(configuration, self.scene, &self.study.grid, LONG_S)).transpose()
    }

    /// The refusal of a configuration that does not hold, the nearest of so many.
    pub(super) fn refusal(&self, trial: &Trial, demands: &Demands, (configuration, tried): (&Configuration, usize)) -> Refusal {
        Refusal::Verification(Unverified {
            configuration: configuration.clone(),
            tried,
            error_times: trial.worst() / demands.tolerance,
            speed_times: trial.speed_times(demands),
            variation: self.variation,
            over_ten_minutes: trial.long_energy.is_some_and(|error| error > demands.tolerance),
            reference: self.reference_may_err(&trial.errors, demands.tolerance),
            sufficient_budget: self.reference.sufficient_budget(&self.study.outputs, demands.tolerance),
            left_out: self.study.left_out > 0,
        })
    }

    /// Whether errors are beyond the tolerance on the other run, but by no more than the uncertainty of its reference.
    fn reference_may_err(&self, errors: &Errors, tolerance: f64) -> bool {
        let (reference, outputs) = (&self.reference, &self.study.outputs);
        let may_hold = |output: &OutputGroup| errors.of(*output) - reference.estimate.of(*output) <= tolerance;
        reference.bounded_error(errors, outputs) > tolerance && outputs.iter().all(may_hold)
    }
}

impl Trial {
    fn worst(&self) -> f64 {
        self.error.max(self.long_energy.unwrap_or(0.0))
    }

    fn speed_times(&self, demands: &Demands) -> f64 {
        demands.real_time_factor / self.real_time_factor
    }

    /// The larger of its error over the tolerance and the demanded speed over its own: above 1 if it does not hold.
    pub(super) fn missed_times(&self, demands: &Demands) -> f64 {
        (self.worst() / demands.tolerance).max(self.speed_times(demands))
    }

    pub(super) fn holds(&self, demands: &Demands) -> bool {
        self.worst() <= demands.tolerance && self.real_time_factor >= demands.real_time_factor
    }
}

impl Variation {
    fn of(scene: &Scene) -> Self {
        let starts_at_speed = scene.chain().is_some_and(|chain| chain.start.rate_rad_per_s != 0.0);
        let is_driven = match &scene.drive {
            Drive::Torque { constant_nm, pulses } => *constant_nm != 0.0 || pulses.iter().any(|pulse| pulse.torque_nm != 0.0),
            Drive::Motion(Motion::Speed(rate)) => *rate != 0.0,
            Drive::Motion(_) => true,
        };
        if starts_at_speed || is_driven { Variation::SpeedAndPulse } else { Variation::Load }
    }

    /// The same mechanism on the other run.
    fn applied(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        match self {
            Variation::SpeedAndPulse => change_speed_and_pulse(&mut scene),
            Variation::Load => add_load(&mut scene),
        }
        scene
    }
}

impl fmt::Display for Variation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Variation::SpeedAndPulse => "on another speed and pulse",
            Variation::Load => "with a fifth more load",
        })
    }
}

fn change_speed_and_pulse(scene: &mut Scene) {
    if let System::Chain(chain) = &mut scene.system {
        chain.start.rate_rad_per_s *= FASTER;
    }
    match &mut scene.drive {
        Drive::Torque { constant_nm, pulses } => {
            *constant_nm *= FASTER;
            for Pulse { torque_nm, duration_s, .. } in pulses {
                *torque_nm *= WEAKER;
                *duration_s *= LONGER;
            }
        }
        Drive::Motion(Motion::Speed(rate)) => *rate *= FASTER,
        Drive::Motion(Motion::Ramp { to_rad_per_s, .. }) => *to_rad_per_s *= FASTER,
        Drive::Motion(Motion::Table(rows)) => rows.iter_mut().for_each(|row| row[0] /= FASTER),
    }
}

fn add_load(scene: &mut Scene) {
    let System::Chain(chain) = &mut scene.system else { return };
    chain.gravity_m_per_s2.iter_mut().for_each(|g| *g *= HEAVIER);
    if let End::Slider(slider) = &mut chain.end {
        match &mut slider.resistance {
            Resistance::Constant(force_n) => *force_n *= HEAVIER,
            Resistance::Table(rows) => rows.iter_mut().for_each(|row| row[1] *= HEAVIER),
        }
    }
    // Unstressed at crank angle 0.
    if chain.base.torsion_spring_nm_per_rad > 0.0 && !chain.start.static_equilibrium {
        chain.start.angle_rad *= HEAVIER;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    #[test]
    fn regress_whatever_moves_a_scene_is_varied_and_named() -> Result<(), Box<dyn std::error::Error>> {
        for (moved_by, varied) in [
            ("torque.constant_nm=1", Variation::SpeedAndPulse),
            ("start.rate_rad_per_s=5", Variation::SpeedAndPulse),
            ("gravity.y_m_per_s2=-9.81", Variation::Load),
            ("slider.resistance_n=10", Variation::Load),
            ("slider.resistance_table=[[0, 10], [3, 20]]", Variation::Load),
            ("base.torsion_spring_nm_per_rad=3", Variation::Load),
        ] {
            let keys = ["pulse.0.torque_nm=0", "start.angle_rad=1", moved_by].map(str::to_owned);
            let scene = SceneSource::open("crank-slider", &keys)?.scene;
            let variation = Variation::of(&scene);
            assert_eq!(variation, varied, "{moved_by}");
            assert_ne!(variation.applied(&scene), scene, "{moved_by}");
        }
        Ok(())
    }
}
