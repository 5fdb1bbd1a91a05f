//! A scene in motion: commands between steps, a step, an observation. No clock but its own, no I/O; the same scene and the
//! same commands at the same steps give the same bits.
//!
//! ```
//! use flexcrank::{scene::SceneSource, simulation::Simulation};
//! let source = SceneSource::open("crank-slider", &[])?;
//! let mut simulation = Simulation::new(&source.scene)?;
//! for _ in 0..100 {
//!     simulation.step()?;
//! }
//! assert!((simulation.time_s() - 0.1).abs() < 1e-15);
//! assert!(simulation.observe()?.links[0].rate_rad_per_s > 5.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod build;
mod drive;
mod engine;
mod error;
mod incremental;
mod integrated;
mod pulses;
mod sample;

pub use error::{BuildError, Cause, Diverged, PulseRefused};
pub use pulses::Pulses;
pub use sample::{Sample, Stamp};

use crate::integrate::{Effort, StepError};
use crate::mechanics::{Energy, Observation};
use crate::scene::{Commands, Drive, Pulse, PulseShape, Scene};
use drive::{DriveLaw, Torque};
use engine::{Engine, Ledger};

/// How often a step that fails is halved before the simulation gives up.
const HALVINGS: u32 = 4;
/// Energy over this many times what is accounted for is divergence.
const ENERGY_FACTOR: f64 = 2.0;
/// Energies below this are rounding, J.
const ENERGY_FLOOR_J: f64 = 1e-9;

/// Longest duration and longest delay of a commanded pulse, s.
const HOUR_S: f64 = 3600.0;

/// A pulse asked for from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulseRequest {
    /// Mean torque, N·m.
    pub torque_nm: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Simulated time from now to its start, s.
    pub delay_s: f64,
    /// Shape.
    pub shape: PulseShape,
}

/// When a command takes effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effective {
    /// The first step that feels it.
    pub step: u64,
    /// Simulated time at which it begins, s.
    pub sim_time_s: f64,
}

/// Energy and work since the epoch began.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EnergyLedger {
    /// Energies now, J.
    pub energy: Energy,
    /// Work put in by torque, motion and resistance, J.
    pub work_in_j: f64,
    /// Work dissipated, J.
    pub dissipated_j: f64,
    /// Energy now − energy at the start − work put in + work dissipated, J.
    pub balance_error_j: f64,
}

/// Everything needed to go on from where the simulation is, alike to the bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// Steps since the epoch began.
    pub step: u64,
    /// The epoch.
    pub epoch: u64,
    /// Coordinates, velocities and what else the integrator carries, in the model's own order.
    pub state: Vec<f64>,
    /// Pulses that wait or act.
    pub pulses: Vec<Pulse>,
    /// Work put in and dissipated so far, J.
    pub work_j: [f64; 2],
    /// Sum of the magnitudes of the work put in by every step, by travel or by rates, whichever is larger, J.
    pub work_put_in_j: f64,
    /// Torque at the pivot at this instant, N·m.
    pub torque_nm: f64,
    /// Angular impulse (N·m·s) delivered since the mean torque was last taken, and the time since then (s).
    pub impulse: [f64; 2],
}

/// A scene in motion.
pub struct Simulation {
    engine: Box<dyn Engine>,
    law: DriveLaw,
    constant_nm: f64,
    own_pulses: Vec<Pulse>,
    commands: Commands,
    step_s: f64,
    step: u64,
    epoch: u64,
    pulses: Pulses,
    effort: Effort,
    iterates: bool,
    /// Whether the integrator weighs its stages evenly about the step's middle, so that the torque may rise over the step.
    rises: bool,
    /// Why torque has no effect on this scene, if so.
    deaf: Option<PulseRefused>,
    work_j: [f64; 2],
    /// Sum of the magnitudes of the work put in by every step, by travel or by rates, whichever is larger, J.
    work_put_in_j: f64,
    start: Observation,
    impulse_nm_s: f64,
    impulse_over_s: f64,
    observation: Observation,
    /// Filled first, and kept only if it is good.
    next: Observation,
    /// The state before the step, to go back to.
    saved: Vec<f64>,
    retried: u64,
}

impl Simulation {
    /// Builds the scene's model at t = 0.
    ///
    /// # Errors
    /// [`BuildError`] when the model cannot compute the scene.
    pub fn new(scene: &Scene) -> Result<Self, BuildError> {
        let law = DriveLaw::new(&scene.drive, &scene.chain().map(|chain| chain.start).unwrap_or_default());
        let (constant_nm, own_pulses) = match &scene.drive {
            Drive::Torque { constant_nm, pulses } => (*constant_nm, pulses.clone()),
            Drive::Motion(_) => (0.0, Vec::new()),
        };
        let mut simulation = Simulation {
            engine: build::engine(scene, &law)?,
            law,
            constant_nm,
            pulses: Pulses::with_capacity(scene.commands.pending_limit + own_pulses.len()),
            own_pulses,
            commands: scene.commands,
            step_s: scene.solver.step_s,
            step: 0,
            epoch: 0,
            effort: Effort::default(),
            iterates: scene.solver.iterates(),
            rises: scene.solver.integrator.order() == 4,
            deaf: build::deaf(scene),
            work_j: [0.0; 2],
            work_put_in_j: 0.0,
            start: Observation::default(),
            impulse_nm_s: 0.0,
            impulse_over_s: 0.0,
            observation: build::observation(scene),
            next: build::observation(scene),
            saved: Vec::new(),
            retried: 0,
        };
        simulation.engine.save(&mut simulation.saved);
        simulation
            .begin()
            .map_err(|_| BuildError { model: scene.solver.model.as_str(), why: "its start has no finite accelerations" })?;
        Ok(simulation)
    }

    fn begin(&mut self) -> Result<(), Diverged> {
        self.engine.reset();
        self.step = 0;
        self.work_j = [0.0; 2];
        self.work_put_in_j = 0.0;
        self.pulses.clear();
        for pulse in &self.own_pulses {
            self.pulses.push(*pulse);
        }
        self.law.torque = Torque::default();
        self.take_mean_torque_nm();
        self.observe()?;
        self.start.clone_from(&self.observation);
        Ok(())
    }

    /// Back to t = 0 with the scene's own pulses; raises the epoch.
    ///
    /// # Errors
    /// None in practice: the same start was observed when the simulation was built.
    pub fn reset(&mut self) -> Result<(), Diverged> {
        self.epoch += 1;
        self.begin()
    }

    /// Steps since the epoch began.
    pub fn step_count(&self) -> u64 {
        self.step
    }

    /// Resets so far.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Size of a step, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Simulated time, s: steps times step size, never accumulated.
    pub fn time_s(&self) -> f64 {
        self.step as f64 * self.step_s
    }

    /// Newton iterations of the last step; `None` with a scheme that does not iterate.
    pub fn newton_iterations(&self) -> Option<u32> {
        self.iterates.then_some(self.effort.newton_iterations)
    }

    /// What the last step cost.
    pub fn effort(&self) -> Effort {
        self.effort
    }

    /// Steps that failed at first and were taken in parts, parts of parts counted too.
    pub fn retried(&self) -> u64 {
        self.retried
    }

    /// Pulses that wait or act.
    pub fn pulses_pending(&self) -> usize {
        self.pulses.len()
    }

    /// Takes a pulse in before the next step.
    ///
    /// # Errors
    /// [`PulseRefused`] when a number is out of range or too many pulses are pending; nothing is changed then.
    pub fn add_pulse(&mut self, request: &PulseRequest) -> Result<Effective, PulseRefused> {
        let PulseRequest { torque_nm, duration_s, delay_s, shape } = *request;
        if ![torque_nm, duration_s, delay_s].iter().all(|number| number.is_finite()) {
            return Err(PulseRefused::NotFinite);
        }
        if let Some(refused) = &self.deaf {
            return Err(refused.clone());
        }
        if !(duration_s > 0.0 && duration_s <= HOUR_S) {
            return Err(PulseRefused::Duration(duration_s));
        }
        if !(0.0..=HOUR_S).contains(&delay_s) {
            return Err(PulseRefused::Delay(delay_s));
        }
        let limit_nm = self.commands.torque_limit_nm;
        if torque_nm.abs() > limit_nm {
            return Err(PulseRefused::Torque { torque_nm, limit_nm });
        }
        if self.pulses.len() >= self.commands.pending_limit {
            return Err(PulseRefused::Pending(self.pulses.len()));
        }
        let start_s = self.time_s() + delay_s;
        self.pulses.push(Pulse { start_s, torque_nm, duration_s, shape });
        let waits = (delay_s / self.step_s).floor() as u64;
        Ok(Effective { step: self.step + waits + 1, sim_time_s: start_s })
    }

    /// When a command that is applied now takes effect.
    pub fn now(&self) -> Effective {
        Effective { step: self.step + 1, sim_time_s: self.time_s() }
    }

    /// Advances by one step.
    ///
    /// # Errors
    /// [`Diverged`] when the step could not be taken; the last good state stays.
    pub fn step(&mut self) -> Result<(), Diverged> {
        let (from_s, to_s) = (self.time_s(), (self.step + 1) as f64 * self.step_s);
        self.saved.clear();
        self.engine.save(&mut self.saved);
        let finite = |(effort, work_j): (Effort, Ledger)| {
            if work_j.iter().all(|work| work.is_finite()) { Ok((effort, work_j)) } else { Err(StepError::NotFinite) }
        };
        let taken = self.advance(from_s, self.step_s, self.energy_due_j(), 0).and_then(finite);
        let (effort, work_j) = taken.map_err(|cause| {
            self.engine.restore(&self.saved);
            self.diverged(cause.into())
        })?;
        self.step += 1;
        self.effort = effort;
        self.work_j[0] += work_j[0];
        self.work_j[1] += work_j[1];
        self.work_put_in_j += work_j[2];
        self.impulse_nm_s += self.mean_torque_nm(from_s, to_s) * self.step_s;
        self.law.torque = Torque::constant(self.constant_nm + self.pulses.value_nm(to_s));
        self.impulse_over_s += self.step_s;
        self.pulses.retire(to_s);
        Ok(())
    }

    /// Mean torque over `[from_s, to_s]`, N·m.
    fn mean_torque_nm(&self, from_s: f64, to_s: f64) -> f64 {
        self.constant_nm + self.pulses.mean_nm(from_s, to_s)
    }

    /// Goes on by `h_s` from where the ledger says `energy_j`; a step that fails is tried in halves, those in halves again, and so on,
    /// [`HALVINGS`] deep.
    fn advance(&mut self, from_s: f64, h_s: f64, energy_j: f64, depth: u32) -> Result<(Effort, Ledger), StepError> {
        let to_s = from_s + h_s;
        let rise_nm_per_s = if self.rises { self.pulses.rise_nm_per_s(from_s, to_s) } else { 0.0 };
        self.law.torque = Torque { mean_nm: self.mean_torque_nm(from_s, to_s), rise_nm_per_s, middle_s: from_s + 0.5 * h_s };
        let failed = match self.engine.step(&self.law, from_s, h_s, energy_j) {
            Err(failed) if depth < HALVINGS => failed,
            taken => return taken,
        };
        self.retried += 1;
        let half_s = 0.5 * h_s;
        let first = self.advance(from_s, half_s, energy_j, depth + 1).map_err(|_| failed)?;
        let [put_in, dissipated, _] = first.1;
        let second = self.advance(from_s + half_s, half_s, energy_j + put_in - dissipated, depth + 1).map_err(|_| failed)?;
        let effort = Effort {
            newton_iterations: first.0.newton_iterations + second.0.newton_iterations,
            factorizations: first.0.factorizations + second.0.factorizations,
        };
        Ok((effort, [0, 1, 2].map(|k| first.1[k] + second.1[k])))
    }

    fn diverged(&self, cause: Cause) -> Diverged {
        Diverged { step: self.step + 1, sim_time_s: self.time_s(), energy_j: self.observation.energy.total_j(), cause }
    }

    /// Mean torque since this was last asked (or the epoch began), N·m.
    pub fn take_mean_torque_nm(&mut self) -> f64 {
        let mean = if self.impulse_over_s > 0.0 { self.impulse_nm_s / self.impulse_over_s } else { 0.0 };
        (self.impulse_nm_s, self.impulse_over_s) = (0.0, 0.0);
        mean
    }

    /// What a sample taken now says of the drive, N·m: the mean torque since the sample before, or of a prescribed motion the
    /// torque that it needed when it was observed last.
    pub fn take_driving_torque_nm(&mut self) -> f64 {
        let mean_nm = self.take_mean_torque_nm();
        self.observation.motion_torque_nm.unwrap_or(mean_nm)
    }

    /// Looks at the present state.
    ///
    /// # Errors
    /// [`Diverged`] when accelerations cannot be solved for, or a number is not finite.
    pub fn observe(&mut self) -> Result<&Observation, Diverged> {
        let time_s = self.time_s();
        self.engine.observe(&self.law, time_s, &mut self.next).map_err(|cause| self.diverged(cause.into()))?;
        self.judge(&self.next)?;
        std::mem::swap(&mut self.observation, &mut self.next);
        Ok(&self.observation)
    }

    /// Whether an observation can be: all of it finite, and its energy not over [`ENERGY_FACTOR`] times what is accounted for.
    fn judge(&self, seen: &Observation) -> Result<(), Diverged> {
        let energy = &seen.energy;
        let energy_j = energy.kinetic_j + energy.strain_j.unwrap_or(0.0);
        if !energy_j.is_finite() || !seen.is_finite() {
            return Err(self.diverged(StepError::NotFinite.into()));
        }
        let accounted_j = self.accounted_j(energy);
        if self.step > 0 && energy_j > ENERGY_FACTOR * accounted_j + ENERGY_FLOOR_J {
            return Err(self.diverged(Cause::EnergyGrew { energy_j, accounted_j, factor: ENERGY_FACTOR }));
        }
        Ok(())
    }

    /// What was there at the start, was put in, or fell in gravity, J.
    fn accounted_j(&self, energy: &Energy) -> f64 {
        let fallen_j = (self.start.energy.potential_j.unwrap_or(0.0) - energy.potential_j.unwrap_or(0.0)).max(0.0);
        let start_j = self.start.energy.kinetic_j + self.start.energy.strain_j.unwrap_or(0.0);
        start_j + fallen_j + self.work_put_in_j
    }

    /// Kinetic and strain energy that was there at the start, was put in, or fell in gravity by what was observed last, J.
    pub fn energy_accounted_j(&self) -> f64 {
        self.accounted_j(&self.observation.energy)
    }

    /// What was observed at t = 0.
    pub fn start(&self) -> &Observation {
        &self.start
    }

    /// What was observed last.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// Energies as last observed, and works.
    pub fn ledger(&self) -> EnergyLedger {
        let energy = self.observation.energy;
        let [work_in_j, dissipated_j] = self.work_j;
        EnergyLedger { energy, work_in_j, dissipated_j, balance_error_j: energy.total_j() - self.energy_due_j() }
    }

    /// The energy that there should be: what was there at the start, and what was put in and dissipated since, J.
    fn energy_due_j(&self) -> f64 {
        self.start.energy.total_j() + self.work_j[0] - self.work_j[1]
    }

    /// Everything needed to go on from here.
    pub fn checkpoint(&self) -> Checkpoint {
        let mut state = Vec::new();
        self.engine.save(&mut state);
        let pulses = self.pulses.iter().copied().collect();
        Checkpoint {
            step: self.step,
            epoch: self.epoch,
            state,
            pulses,
            work_j: self.work_j,
            work_put_in_j: self.work_put_in_j,
            torque_nm: self.law.torque.mean_nm,
            impulse: [self.impulse_nm_s, self.impulse_over_s],
        }
    }

    /// Goes back (or on) to a checkpoint of the same scene; `false`, and nothing changed, when it does not fit.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> bool {
        if !self.engine.restore(&checkpoint.state) {
            return false;
        }
        (self.step, self.epoch, self.work_j) = (checkpoint.step, checkpoint.epoch, checkpoint.work_j);
        self.work_put_in_j = checkpoint.work_put_in_j;
        self.pulses.clear();
        checkpoint.pulses.iter().for_each(|pulse| self.pulses.push(*pulse));
        self.law.torque = Torque::constant(checkpoint.torque_nm);
        [self.impulse_nm_s, self.impulse_over_s] = checkpoint.impulse;
        true
    }
}
