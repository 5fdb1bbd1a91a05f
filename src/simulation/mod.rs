//! A scene in motion: commands between steps, a step, an observation. No clock but its own, no I/O; the same scene and the
//! same commands at the same steps give the same bits.
//!
//! ```
//! use flexcrank::{scene::SceneSource, simulation::Simulation};
//! let source = SceneSource::open("crank-slider", &[])?;
//! let mut simulation = Simulation::new(&source.scene)?;
//! for _ in 0..50 {
//!     simulation.step()?;
//! }
//! assert!((simulation.time_s() - 0.1).abs() < 1e-15);
//! assert!(simulation.observe()?.links[0].rate_rad_per_s > 5.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod build;
mod checkpoint;
mod drive;
mod engine;
mod error;
mod error_estimate;
mod incremental;
mod integrated;
mod ledger;
mod pulses;
mod rate;
mod sample;
mod step_limit;
mod telemetry;

pub use checkpoint::Checkpoint;
pub use error::{BuildError, Cause, Diverged, PulseRefused};
pub use error_estimate::ErrorEstimate;
pub use ledger::{EnergyLedger, EnergyVerdict, LedgerEntries};
pub use pulses::Pulses;
pub use rate::{BadRate, PublishRate};
pub use sample::{Account, Sample, Stamp};
pub use telemetry::{PerTelemetry, PublishRates};

use std::time::SystemTime;

pub use crate::integrate::Work;
use crate::integrate::{Effort, StepError, Taken};
use crate::mechanics::{Energy, Observation};
use crate::scene::{Commands, Drive, Pulse, PulseShape, Scene};
use drive::{DriveLaw, Torque};
use engine::Engine;
use ledger::Ledger;

/// How often a step that fails is halved before the simulation gives up.
const HALVINGS: u32 = 4;
/// A step is cut into at most so many parts at the edges of pulses: a flood of pulses must not make steps late.
const MOST_PARTS: usize = 5;
/// A part of a step is no shorter than this part of it.
const SHORTEST_PART: f64 = 1e-6;

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
    ledger: Ledger,
    balance_tolerance: f64,
    /// `None` where the method cannot tell.
    error: Option<ErrorEstimate>,
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
        let mut law = DriveLaw::new(&scene.drive, &scene.chain().map(|chain| chain.start).unwrap_or_default());
        let (constant_nm, own_pulses) = match &scene.drive {
            Drive::Torque { constant_nm, pulses } => (*constant_nm, pulses.clone()),
            Drive::Motion(_) => (0.0, Vec::new()),
        };
        law.torque = Torque::constant(constant_nm);
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
            ledger: Ledger::default(),
            balance_tolerance: scene.solver.balance_tolerance,
            error: None,
            start: Observation::default(),
            impulse_nm_s: 0.0,
            impulse_over_s: 0.0,
            observation: build::observation(scene),
            next: build::observation(scene),
            saved: Vec::new(),
            retried: 0,
        };
        simulation.engine.save(&mut simulation.saved);
        simulation.begin().map_err(|_| BuildError {
            model: scene.solver.model.as_str(),
            why: "its start has no finite accelerations".into(),
        })?;
        Ok(simulation)
    }

    fn begin(&mut self) -> Result<(), Diverged> {
        self.engine.reset();
        self.step = 0;
        self.pulses.clear();
        for pulse in &self.own_pulses {
            self.pulses.push(*pulse);
        }
        self.law.torque = Torque::constant(self.constant_nm);
        self.take_mean_torque_nm();
        self.observe()?;
        self.start.clone_from(&self.observation);
        self.ledger = Ledger::new(self.observation.energy);
        self.error = self.engine.local_error(self.step_s).map(|_| ErrorEstimate::default());
        Ok(())
    }

    /// Back to t = 0 with the scene's own pulses; raises the epoch.
    ///
    /// # Errors
    /// Never returned in practice: the same start was observed when the simulation was built.
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

    /// Cost of the last step.
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
    /// [`Diverged`] when the step could not be taken, or its energies say that it went wrong; the last good state stays.
    pub fn step(&mut self) -> Result<(), Diverged> {
        let (from_s, to_s) = (self.time_s(), (self.step + 1) as f64 * self.step_s);
        let (torque, error) = (self.law.torque, self.error);
        self.saved.clear();
        self.engine.save(&mut self.saved);
        self.error = self.error.map(ErrorEstimate::next_step);
        let taken = self.advance_from_edge_to_edge(from_s, to_s).map_err(Cause::from).and_then(|taken| {
            let energy = self.engine.energy(&self.law, to_s);
            let ledger = finite(&taken.work, &energy).and(self.ledger.after(taken.work, energy, self.engine.keeps_energy()))?;
            Ok((taken.effort, ledger))
        });
        let (effort, ledger) = taken.map_err(|cause| {
            self.engine.restore(&self.saved);
            self.law.torque = torque;
            self.error = error;
            self.diverged(cause)
        })?;
        self.step += 1;
        self.effort = effort;
        self.ledger = ledger;
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

    /// Takes one step. Where the integrator follows a load within the step, it does so from one edge of a pulse to the next: a load
    /// that begins or ends inside a step would cost it its order.
    fn advance_from_edge_to_edge(&mut self, mut from_s: f64, to_s: f64) -> Result<Taken, StepError> {
        let (mut taken, mut h_s) = (Taken::default(), self.step_s);
        let margin_s = SHORTEST_PART * self.step_s;
        for _ in 1..if self.rises { MOST_PARTS } else { 1 } {
            let Some(edge_s) = self.pulses.edge_within(from_s + margin_s, to_s - margin_s) else { break };
            taken += self.advance([from_s, edge_s], edge_s - from_s, 0)?;
            (from_s, h_s) = (edge_s, to_s - edge_s);
        }
        taken += self.advance([from_s, to_s], h_s, 0)?;
        Ok(taken)
    }

    /// Goes on by `h_s`; a step that fails is tried in halves, those in halves again, and so on, [`HALVINGS`] deep. Both ends are given:
    /// `from_s + h_s` may round beyond the next step's beginning, and so into a pulse that begins there.
    fn advance(&mut self, [from_s, to_s]: [f64; 2], h_s: f64, depth: u32) -> Result<Taken, StepError> {
        let rise_nm_per_s = if self.rises { self.pulses.rise_nm_per_s(from_s, to_s) } else { 0.0 };
        self.law.torque = Torque { mean_nm: self.mean_torque_nm(from_s, to_s), rise_nm_per_s, middle_s: from_s + 0.5 * h_s };
        let failed = match self.engine.step(&self.law, from_s, h_s) {
            Err(failed) if depth < HALVINGS => failed,
            taken => {
                self.error = self.error.zip(self.engine.local_error(h_s)).map(|(error, terms)| error.after(h_s, terms));
                return taken;
            }
        };
        self.retried += 1;
        let half_s = 0.5 * h_s;
        let middle_s = from_s + half_s;
        let mut taken = self.advance([from_s, middle_s], half_s, depth + 1).map_err(|_| failed)?;
        taken += self.advance([middle_s, to_s], half_s, depth + 1).map_err(|_| failed)?;
        Ok(taken)
    }

    fn diverged(&self, cause: Cause) -> Diverged {
        Diverged { step: self.step + 1, sim_time_s: self.time_s(), energy_j: self.ledger.energies().energy.total_j(), cause }
    }

    /// Mean torque since this was last asked (or the epoch began), N·m; the torque at this instant if no time has passed.
    pub fn take_mean_torque_nm(&mut self) -> f64 {
        let mean = if self.impulse_over_s > 0.0 { self.impulse_nm_s / self.impulse_over_s } else { self.law.torque.mean_nm };
        (self.impulse_nm_s, self.impulse_over_s) = (0.0, 0.0);
        mean
    }

    /// Driving torque of a sample taken now, N·m: the mean torque since the sample before; of a prescribed motion, the
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
        if !self.next.is_finite() {
            return Err(self.diverged(StepError::NotFinite.into()));
        }
        std::mem::swap(&mut self.observation, &mut self.next);
        Ok(&self.observation)
    }

    /// Verdict of the energy balance on the epoch so far.
    pub fn energy_verdict(&self) -> EnergyVerdict {
        if self.engine.keeps_energy() { self.ledger.verdict(self.balance_tolerance) } else { EnergyVerdict::NotJudged }
    }

    /// Estimated error of the time discretization; `None` where the method cannot tell.
    pub fn error_estimate(&self) -> Option<ErrorEstimate> {
        self.error
    }

    /// The energy in play: see [`EnergyLedger::in_play_j`].
    pub fn energy_accounted_j(&self) -> f64 {
        self.ledger().in_play_j
    }

    /// The observation at t = 0.
    pub fn start(&self) -> &Observation {
        &self.start
    }

    /// The last observation.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// Energies and works of the present state.
    pub fn ledger(&self) -> EnergyLedger {
        self.ledger.energies()
    }

    /// Energies, works and estimated error of the present state.
    pub fn account(&self) -> Account {
        Account { ledger: self.ledger(), verdict: self.energy_verdict(), error: self.error }
    }

    /// The stamp of the present instant, in an epoch that began at `epoch_start_s`.
    pub fn stamp(&self, epoch_start_s: f64, wall: SystemTime) -> Stamp {
        Stamp { step: self.step, epoch: self.epoch, sim_time_s: self.time_s(), epoch_start_s, wall }
    }

    /// A sample with room for an observation, to be filled by [`Simulation::sample`].
    pub fn blank_sample(&self) -> Sample {
        let stamp = self.stamp(0.0, SystemTime::UNIX_EPOCH);
        Sample { stamp, driving_torque_nm: 0.0, observation: self.observation.clone(), ledger: self.ledger() }
    }

    /// Fills a sample with the present state, except for the driving torque.
    ///
    /// # Errors
    /// As of [`Simulation::observe`].
    pub fn sample(&mut self, sample: &mut Sample, stamp: Stamp) -> Result<(), Diverged> {
        sample.observation.clone_from(self.observe()?);
        (sample.stamp, sample.ledger) = (stamp, self.ledger());
        Ok(())
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
            ledger: self.ledger.entries(),
            error: self.error,
            torque_nm: self.law.torque.mean_nm,
            impulse: [self.impulse_nm_s, self.impulse_over_s],
        }
    }

    /// Goes back (or on) to a checkpoint of the same scene; `false`, and nothing changed, when it does not fit.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> bool {
        if !self.engine.restore(&checkpoint.state) {
            return false;
        }
        (self.step, self.epoch) = (checkpoint.step, checkpoint.epoch);
        self.pulses.clear();
        checkpoint.pulses.iter().for_each(|pulse| self.pulses.push(*pulse));
        self.law.torque = Torque::constant(checkpoint.torque_nm);
        [self.impulse_nm_s, self.impulse_over_s] = checkpoint.impulse;
        self.error = checkpoint.error;
        let energy = self.engine.energy(&self.law, self.time_s());
        self.ledger = self.ledger.at(&checkpoint.ledger, energy);
        true
    }
}

fn finite(work: &Work, energy: &Energy) -> Result<(), Cause> {
    let energies = [energy.kinetic_j, energy.strain_j.unwrap_or(0.0), energy.potential_j.unwrap_or(0.0)];
    let all = work.is_finite() && energies.iter().all(|energy| energy.is_finite());
    if all { Ok(()) } else { Err(StepError::NotFinite.into()) }
}
