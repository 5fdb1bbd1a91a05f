//! A run at the best level of a scene, which follows another run of it on the same commands: the error that cheaper levels leave.

use std::time::{Duration, Instant};

use super::event::new_level;
use super::resimulator::{ResimulationFault, Resimulator};
use crate::mechanics::Observation;
use crate::runtime::{ModelDifference, difference};
use crate::scene::SceneSource;
use crate::simulation::{BuildError, PulseRequest, Stamp};
use crate::wire::{self, AppliedCommand, applied_command};

/// Times that differ by less than this part of a step are equal.
const ROUNDING: f64 = 1e-6;

/// Follows a run that changes levels, and stays at the best one.
pub struct BestLevelRun {
    resimulator: Resimulator,
    /// Time for its steps, and their number.
    cost: Duration,
    steps: u32,
}

/// Why it cannot follow any further.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the shadow at the best level cannot follow: {0}")]
pub struct LostTrack(#[from] ResimulationFault);

impl BestLevelRun {
    /// Starts at the beginning of a scene.
    ///
    /// # Errors
    /// [`BuildError`] if the scene cannot be simulated.
    pub fn new(scene: &SceneSource) -> Result<Self, BuildError> {
        Ok(BestLevelRun { resimulator: Resimulator::new(scene)?, cost: Duration::ZERO, steps: 0 })
    }

    /// Applies a command that the other run, with steps of `step_s`, applied. A change of level is left out.
    ///
    /// # Errors
    /// [`LostTrack`] if the command is refused here, or if the run diverges.
    pub fn apply(&mut self, command: &AppliedCommand, step_s: f64) -> Result<(), LostTrack> {
        let Some(stamp) = command.stamp.as_ref().filter(|_| new_level(command).is_none()) else { return Ok(()) };
        let steps = self.resimulator.steps_at(stamp.epoch, stamp.sim_time_s);
        match &command.command {
            // A pulse keeps its start between two steps.
            Some(applied_command::Command::Torque(pulse)) => {
                self.go_to(stamp.epoch, (steps + ROUNDING).floor())?;
                let later = steps - self.resimulator.instant().1 as f64;
                let later_s = Some(later).filter(|part| *part > ROUNDING).unwrap_or(0.0) * self.resimulator.simulation().step_s();
                let pulse = wire::pulse_request(pulse).map_err(ResimulationFault::from)?;
                let request = PulseRequest { delay_s: pulse.delay_s + later_s, ..pulse };
                self.resimulator.apply(&request).map_err(ResimulationFault::from)?;
            }
            Some(applied_command::Command::Advance(advance)) => {
                self.go_to(stamp.epoch, (steps - ROUNDING).ceil())?;
                let as_long = advance.steps as f64 * step_s / self.resimulator.simulation().step_s();
                let mut command = command.clone();
                let steps = (as_long - ROUNDING).ceil() as u64;
                command.command = Some(applied_command::Command::Advance(wire::Advance { steps, ..advance.clone() }));
                self.resimulator.command(&command)?;
            }
            _ => {
                self.go_to(stamp.epoch, (steps - ROUNDING).ceil())?;
                self.resimulator.command(command)?;
            }
        }
        Ok(())
    }

    /// Goes to an instant of the other run and returns this one's state minus `seen`; `None` if no step of this run ends there.
    ///
    /// # Errors
    /// [`LostTrack`] if the run diverges.
    pub fn difference(&mut self, seen: &Observation, stamp: &Stamp) -> Result<Option<ModelDifference>, LostTrack> {
        let steps = self.resimulator.steps_at(stamp.epoch, stamp.sim_time_s);
        self.go_to(stamp.epoch, (steps + ROUNDING).floor())?;
        let present = self.resimulator.instant().1 as f64;
        if (steps - present).abs() > ROUNDING {
            return Ok(None);
        }
        let model = self.resimulator.model();
        let shadow_step_s = self.cost.as_secs_f64() / f64::from(self.steps.max(1));
        let own = &self.resimulator.observe().map_err(ResimulationFault::from)?.observation;
        Ok(difference(own, seen).map(|state| ModelDifference { model, state, main_step_s: 0.0, shadow_step_s }))
    }

    /// Goes to a step, or stays where it is: a command that came within a step here has taken it to that step's end.
    fn go_to(&mut self, epoch: u64, step: f64) -> Result<(), LostTrack> {
        let (begun, mut taken) = (Instant::now(), 0);
        let (own, present) = self.resimulator.instant();
        let least = if epoch == own { present } else { 0 };
        let went = self.resimulator.go_to((epoch, (step.max(0.0) as u64).max(least)), |_| taken += 1);
        self.cost += begun.elapsed();
        self.steps = self.steps.saturating_add(taken);
        Ok(went?)
    }
}
