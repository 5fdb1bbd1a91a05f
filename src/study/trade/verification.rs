//! Runs that verify a configuration: the same mechanism at another speed, by another pulse.

use super::configuration::Configuration;
use super::demands::{Demands, Refusal, Unverified};
use super::errors::Errors;
use super::output_group::OutputGroup;
use super::reference::{Reference, WELL_RESOLVED};
use super::run::{Failed, energy_error, run, time};
use super::{REFERENCE_PART, Study};
use crate::scene::{Drive, Motion, Pulse, Scene, System};

/// One configuration's standing on the runs that verify it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Errors on another speed and pulse.
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

/// Speed factor of the verifying run.
const OTHER_SPEED: f64 = 1.2;
const OTHER_TORQUE: f64 = 0.8;
const OTHER_DURATION: f64 = 1.5;
/// Duration over which energy must be kept, s. A short run shows little of a long one, in which energy errors reach the
/// vibrations that the step resolves worst.
const LONG_S: f64 = 600.0;

/// The other run and its reference.
pub(super) struct Verification<'a> {
    scene: &'a Scene,
    study: &'a Study,
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
        let other = other(scene);
        let chain = other.chain().ok_or(Refusal::Nothing)?;
        let wanted = (study.outputs.as_slice(), tolerance / WELL_RESOLVED);
        let reference = Reference::converge(&other, chain, &study.grid, wanted, REFERENCE_PART * budget_s, progress)
            .map_err(Refusal::NoVerification)?;
        Ok(Verification { scene, study, other, reference })
    }

    /// Runs a configuration on the other speed and pulse.
    pub(super) fn run(&self, configuration: &Configuration) -> Result<Trial, Failed> {
        let (run, seconds) = run(configuration, &self.other, &self.study.grid)?;
        let timing = time(configuration, &self.other, &self.study.grid, seconds)?;
        let errors = self.reference.errors(&run);
        let error = self.reference.bounded_error(&errors, &self.study.outputs);
        let angle_rad = self.reference.bounded_error(&errors, &[OutputGroup::Angle]);
        Ok(Trial { errors, error, angle_rad, real_time_factor: timing.slowest_per_s.recip(), long_energy: None })
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

/// The same mechanism at another speed, by another pulse: every motion a fifth faster, every pulse a fifth weaker and half again
/// as long (so its impulse a fifth larger). Where neither is there, weight is a fifth larger.
fn other(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let is_driven = match &scene.drive {
        Drive::Torque { constant_nm, pulses } => *constant_nm != 0.0 || pulses.iter().any(|pulse| pulse.torque_nm != 0.0),
        Drive::Motion(Motion::Speed(rate)) => *rate != 0.0,
        Drive::Motion(_) => true,
    };
    if let System::Chain(chain) = &mut scene.system {
        if !is_driven && chain.start.rate_rad_per_s == 0.0 {
            chain.gravity_m_per_s2.iter_mut().for_each(|g| *g *= OTHER_SPEED);
        }
        chain.start.rate_rad_per_s *= OTHER_SPEED;
    }
    match &mut scene.drive {
        Drive::Torque { constant_nm, pulses } => {
            *constant_nm *= OTHER_SPEED;
            for Pulse { torque_nm, duration_s, .. } in pulses {
                *torque_nm *= OTHER_TORQUE;
                *duration_s *= OTHER_DURATION;
            }
        }
        Drive::Motion(Motion::Speed(rate)) => *rate *= OTHER_SPEED,
        Drive::Motion(Motion::Ramp { to_rad_per_s, .. }) => *to_rad_per_s *= OTHER_SPEED,
        Drive::Motion(Motion::Table(rows)) => rows.iter_mut().for_each(|row| row[0] /= OTHER_SPEED),
    }
    scene
}
