//! Re-simulation of a recorded scene, from one recorded instant to the next.

use std::sync::Arc;
use std::time::SystemTime;

use prost::Message as _;

use super::event::{changes, new_level, resets};
use crate::runtime::{CHECKPOINT_PERIOD_S, SceneInForce, Successor};
use crate::scene::{ModelKind, SceneAtLevel, SceneError, SceneSource};
use crate::simulation::{
    BuildError, Diverged, Effective, NotChanged, PulseRefused, PulseRequest, Sample, SampleContext, Simulation, Stamp, StepGrid,
};
use crate::wire::{self, AppliedCommand, BadCommand, Message, Topic, applied_command};

/// Longest simulated time without a message, s: one checkpoint may be lost to a full queue.
pub(super) const PROVED_S: f64 = 2.0 * CHECKPOINT_PERIOD_S;

/// A simulation that follows a recording.
pub(super) struct Resimulator {
    /// The recording's scene.
    first: SceneSource,
    scene: SceneAtLevel,
    simulation: Simulation,
    context: Arc<SampleContext>,
    epoch_start_s: f64,
    sample: Sample,
    /// The instant of the sample's observation.
    observed: Option<EpochStep>,
    /// Largest bending beyond the model's range in any observation, relative to the link's length; 0 if there was none.
    worst_out_of_range: f64,
}

/// An epoch, and the step within it.
pub(super) type EpochStep = (u64, u64);

/// Why re-simulation cannot follow the recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum ResimulationFault {
    /// The re-simulation diverged where the recording continues.
    #[error("the re-simulation {0}")]
    Diverged(#[from] Diverged),
    /// The recorded instant lies before the present one.
    #[error("it is out of order, after step {} of epoch {}", .0.1, .0.0)]
    Over(EpochStep),
    /// A recorded torque is refused.
    #[error("a recorded torque would be refused: {0}")]
    Refused(#[from] PulseRefused),
    /// A recorded pulse is invalid.
    #[error("a recorded pulse is invalid: {0}")]
    NoPulse(#[from] BadCommand),
    /// A recorded change of the scene is refused.
    #[error("a recorded change of the scene is refused: {0}")]
    Unchanged(String),
    /// Epochs must increase by one.
    #[error("epoch {0} does not follow")]
    Epoch(u64),
    /// No recording proves a stretch that long.
    #[error("no message or checkpoint comes between steps {} and {step} of epoch {}, and one is due every {CHECKPOINT_PERIOD_S} s", .from.1, .from.0)]
    Unproved {
        /// The present instant.
        from: EpochStep,
        /// The step stated.
        step: u64,
    },
}

impl Resimulator {
    /// Starts at the beginning of a scene.
    pub(super) fn new(source: &SceneSource) -> Result<Self, BuildError> {
        let scene = SceneAtLevel::first(source.clone());
        Self::at(source.clone(), scene)
    }

    /// Starts at the beginning of a scene at a level.
    fn at(first: SceneSource, scene: SceneAtLevel) -> Result<Self, BuildError> {
        let simulation = Simulation::new(&scene.source.scene)?;
        let sample = simulation.blank_sample();
        let context = SceneInForce::new(scene.clone(), &simulation).context;
        Ok(Resimulator { first, scene, simulation, context, epoch_start_s: 0.0, sample, observed: None, worst_out_of_range: 0.0 })
    }

    /// The text of the scene, without the changes of its level.
    pub(super) fn scene_text(&self) -> &str {
        &self.scene.base.text
    }

    /// Changes the scene or its level at the present instant, if the command does. Returns the energy that this brought in, J.
    pub(super) fn change(&mut self, command: &AppliedCommand) -> Result<Option<f64>, ResimulationFault> {
        if let Some(changes) = changes(command) {
            let refused = |refused: SceneError| ResimulationFault::Unchanged(refused.to_string());
            let after = self.scene.changed(changes).map_err(refused)?;
            return self.go_on_as(after).map(Some);
        }
        new_level(command).map(|level| self.go_to_level(level)).transpose()
    }

    fn go_to_level(&mut self, name: &str) -> Result<f64, ResimulationFault> {
        let after = SceneAtLevel::named(&self.scene.base, name).map_err(ResimulationFault::Unchanged)?;
        if after.level == self.scene.level { Ok(0.0) } else { self.go_on_as(after) }
    }

    fn go_on_as(&mut self, after: SceneAtLevel) -> Result<f64, ResimulationFault> {
        self.observed = None;
        let mut successor = Successor::new(&self.scene.source, &after.source).map_err(ResimulationFault::Unchanged)?;
        let refused = |refused: NotChanged| ResimulationFault::Unchanged(refused.to_string());
        let changed_j = successor.replace(&mut self.simulation).map_err(refused)?;
        self.context = SceneInForce::new(after.clone(), &self.simulation).context;
        self.scene = after;
        Ok(changed_j)
    }

    /// Goes to the start of another scene or level, unless it is in force.
    fn put_in_force(&mut self, text: &str, level: &str) -> Option<()> {
        let text = if text.is_empty() { &self.first.text } else { text };
        if *text != self.scene.base.text || level != self.scene.name_beside_first() {
            let base = SceneSource::parse(&self.first.origin, text, &[]).ok()?;
            let scene = SceneAtLevel::named(&base, level).ok()?;
            let mut other = Self::at(self.first.clone(), scene).ok()?;
            other.simulation.keep_distrust_of(&self.simulation);
            other.worst_out_of_range = self.worst_out_of_range;
            *self = other;
        }
        Some(())
    }

    pub(super) fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The simulation, the session time at which its epoch began (s), and the scene in force.
    pub(super) fn into_parts(self) -> (Simulation, f64, SceneAtLevel) {
        (self.simulation, self.epoch_start_s, self.scene)
    }

    pub(super) fn instant(&self) -> EpochStep {
        (self.simulation.epoch(), self.simulation.step_count())
    }

    pub(super) fn stamp(&self) -> Stamp {
        self.simulation.stamp(self.epoch_start_s, SystemTime::UNIX_EPOCH)
    }

    /// The model that computes it.
    pub(super) fn model(&self) -> ModelKind {
        self.scene.source.scene.solver.model
    }

    /// The times of steps in an epoch, the present one or the next.
    pub(super) fn grid_in(&self, epoch: u64) -> StepGrid {
        let grid = self.simulation.grid();
        if epoch == self.simulation.epoch() { grid } else { StepGrid::new(grid.step_s) }
    }

    /// Number of steps up to a time of an epoch, the present one or the next; a fraction between two steps.
    pub(super) fn steps_at(&self, epoch: u64, sim_time_s: f64) -> f64 {
        let grid = self.grid_in(epoch);
        grid.origin_step as f64 + (sim_time_s - grid.origin_s) / grid.step_s
    }

    /// Restores a recorded state and the scene in force there; returns `false` if they do not fit.
    pub(super) fn restore(&mut self, checkpoint: &wire::Checkpoint) -> bool {
        self.observed = None;
        let Ok(state) = wire::recorded_checkpoint(checkpoint) else { return false };
        let fits = self.put_in_force(&checkpoint.scene, &checkpoint.level).is_some() && self.simulation.restore(&state);
        if fits {
            self.epoch_start_s = checkpoint.epoch_start_s;
        }
        fits
    }

    /// Steps to an instant, with a reset before the next epoch, but no further than a recording proves. `after_step` is called after
    /// every step.
    pub(super) fn go_to(
        &mut self,
        (epoch, step): EpochStep,
        mut after_step: impl FnMut(&mut Simulation),
    ) -> Result<(), ResimulationFault> {
        if epoch == self.simulation.epoch() + 1 {
            self.epoch_start_s += self.simulation.time_s();
            self.simulation.reset()?;
        }
        if epoch != self.simulation.epoch() {
            return Err(ResimulationFault::Epoch(epoch));
        }
        if step < self.simulation.step_count() {
            return Err(ResimulationFault::Over(self.instant()));
        }
        let proved = (PROVED_S / self.simulation.step_s()).ceil() as u64 + 2;
        if step - self.simulation.step_count() > proved {
            return Err(ResimulationFault::Unproved { from: self.instant(), step });
        }
        while self.simulation.step_count() < step {
            self.simulation.step()?;
            after_step(&mut self.simulation);
        }
        Ok(())
    }

    /// Returns how the simulation diverges at the present instant: it cannot be observed, or its next step fails. If it does not
    /// diverge, the step was taken, so the re-simulation ends here.
    pub(super) fn diverges(&mut self) -> Option<Diverged> {
        self.observe().err().or_else(|| self.simulation.step().err())
    }

    /// Largest bending beyond the model's range in the last sample, relative to the link's length.
    pub(super) fn out_of_range(&self) -> Option<f64> {
        self.sample.observation.out_of_range
    }

    /// Largest bending beyond the model's range in any observation, relative to the link's length; 0 if there was none.
    pub(super) fn worst_out_of_range(&self) -> f64 {
        self.worst_out_of_range
    }

    /// Draws the present state for viewers; `time_ns` is their playback time.
    pub(super) fn draw(&mut self, time_ns: u64) -> Result<Vec<u8>, Diverged> {
        self.observe()?;
        let has_slider = self.sample.observation.resistance_n.is_some();
        Ok(wire::scene_update(&self.context.displacements(&self.sample), has_slider, time_ns).encode_to_vec())
    }

    /// Gives access to the simulation at the present instant.
    pub(super) fn with_simulation(&mut self, see: impl FnOnce(&mut Simulation)) {
        see(&mut self.simulation);
    }

    /// Applies a recorded command at the present instant.
    pub(super) fn command(&mut self, command: &AppliedCommand) -> Result<(), ResimulationFault> {
        if resets(command) {
            return self.go_to((self.simulation.epoch() + 1, 0), |_| {});
        }
        if self.change(command)?.is_some() {
            return Ok(());
        }
        self.torque(command)?;
        Ok(())
    }

    /// Applies the torque of a recorded command at the present instant; `None` if it has none.
    pub(super) fn torque(&mut self, command: &AppliedCommand) -> Result<Option<Effective>, ResimulationFault> {
        match &command.command {
            Some(applied_command::Command::Torque(pulse)) => Ok(Some(self.apply(&wire::pulse_request(pulse)?)?)),
            Some(applied_command::Command::Setpoint(setpoint)) => {
                Ok(Some(self.simulation.set_torque(&wire::setpoint_request(setpoint))?))
            }
            Some(applied_command::Command::Advance(advance)) => match advance.torque_nm {
                Some(torque_nm) => Ok(Some(self.simulation.set_torque_for(torque_nm, advance.steps)?)),
                None => Ok(Some(self.simulation.now())),
            },
            Some(applied_command::Command::Control(_)) | None => Ok(None),
        }
    }

    /// Adds a pulse at the present instant.
    pub(super) fn apply(&mut self, pulse: &PulseRequest) -> Result<Effective, PulseRefused> {
        self.simulation.add_pulse(pulse)
    }

    /// Observes the present instant.
    pub(super) fn observe(&mut self) -> Result<&Sample, Diverged> {
        if self.observed != Some(self.instant()) {
            let stamp = self.stamp();
            self.simulation.sample(&mut self.sample, stamp)?;
            self.observed = Some(self.instant());
            self.worst_out_of_range = self.worst_out_of_range.max(self.out_of_range().unwrap_or(0.0));
        }
        Ok(&self.sample)
    }

    /// Re-simulates a recorded message of the present instant, except for fields that only the wall clock and the service
    /// determine. `None` if the message is not computed.
    pub(super) fn recompute(&mut self, recorded: &Message) -> Result<Option<Message>, Diverged> {
        if recorded.topic().is_telemetry() {
            self.observe()?;
        }
        match recorded {
            Message::Loads(_) => self.sample.driving_torque_nm = self.simulation.take_driving_torque_nm(),
            // Without loads, the mean torque follows the displacements.
            Message::Displacements(_) if !self.context.has(Topic::Loads) => _ = self.simulation.take_driving_torque_nm(),
            _ => {}
        }
        let computed = match recorded {
            Message::Checkpoint(_) => {
                let text = self.scene_text();
                let scene = if text == self.first.text { String::new() } else { text.to_owned() };
                let level = self.scene.name_beside_first().to_owned();
                let state = wire::checkpoint(&self.simulation.checkpoint(), &self.stamp());
                Some(Message::Checkpoint(Box::new(wire::Checkpoint { scene, level, ..state })))
            }
            Message::Status(status) => Some(Message::Status(Box::new(
                (**status).clone().with_account(self.simulation.account()).at_level(self.context.level.as_ref()),
            ))),
            _ => self.context.message(recorded.topic(), &self.sample),
        };
        let wall_time = recorded.stamp().and_then(|stamp| stamp.wall_time);
        let stamp = wire::Stamp { wall_time, ..wire::stamp(&self.stamp()) };
        Ok(computed.map(|computed| computed.with_stamp(stamp)))
    }
}
