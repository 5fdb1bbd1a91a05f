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

mod advance;
mod build;
mod change;
mod checkpoint;
mod drive;
mod engine;
mod error;
mod error_estimate;
mod fading;
mod incremental;
mod integrated;
mod ledger;
mod load;
mod loads;
mod passed_loads;
mod pulses;
mod rate;
mod sample;
mod sample_context;
mod setpoint;
mod start_refusal;
mod state;
mod step_grid;
mod step_limit;
mod telemetry;
mod verdict;

pub use change::{NoRoute, NotChanged, Route};
pub use checkpoint::{Checkpoint, EpochChanges};
pub use drive::{MotionOrigin, drive_at_start};
pub use engine::Motion;
pub use error::{BuildError, Cause, Diverged, PulseRefused};
pub use error_estimate::ErrorEstimate;
pub use ledger::{ChangedEnergy, EnergyLedger, EnergyVerdict, LedgerEntries};
pub use load::{DeliveredImpulse, PulseRequest};
pub use loads::Loads;
pub use passed_loads::PassedLoad;
pub use pulses::Pulses;
pub use rate::{BadRate, PublishRate};
pub use sample::{Account, Sample, Stamp};
pub use sample_context::SampleContext;
pub use setpoint::{AdvanceRequest, HeldTorque, LONGEST_HOLD_S, SHORTEST_HOLD_S, SetpointRequest, SetpointState};
pub use step_grid::StepGrid;
pub use telemetry::{PerTelemetry, PublishRates};

pub use crate::integrate::Work;
use crate::integrate::{Effort, StepError, Taken};
use crate::mechanics::{Energy, Observation};
use crate::scene::{Scene, Solver};
use drive::{DriveLaw, Torque};
use engine::Engine;
use ledger::Ledger;
use load::{Load, margin_s};
use passed_loads::PassedLoads;

/// When a command takes effect.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Effective {
    /// The first step that feels it.
    pub step: u64,
    /// Simulated time at which it begins, s.
    pub sim_time_s: f64,
}

/// Observations of a simulation.
struct Observed {
    /// At t = 0.
    start: Observation,
    last: Observation,
    /// Receives an observation, which replaces the last one if all its numbers are finite.
    next: Observation,
}

/// A scene in motion.
pub struct Simulation {
    engine: Box<dyn Engine>,
    law: DriveLaw,
    load: Load,
    grid: StepGrid,
    step: u64,
    epoch: u64,
    /// Cost and work of the last step.
    last: Taken,
    solver: Solver,
    ledger: Ledger,
    /// `None` where the method cannot tell.
    error: Option<ErrorEstimate>,
    observed: Observed,
    /// The state before the step, restored if the step fails.
    saved: Vec<f64>,
    retried: u64,
    /// Steps of fixed cost that left more than the scene's tolerance.
    unconverged: u64,
    passed: PassedLoads,
    /// Whether the scene was changed in this epoch.
    changed: bool,
    /// Energies below this are no divergence, J.
    least_j: f64,
    /// Verdict on the first epoch before this one whose balance was off.
    distrusted: Option<EnergyVerdict>,
}

impl Simulation {
    /// Builds the scene's model at t = 0.
    ///
    /// # Errors
    /// [`BuildError`] when the model cannot compute the scene.
    pub fn new(scene: &Scene) -> Result<Self, BuildError> {
        let mut law = DriveLaw::new(&scene.drive, &scene.chain().map(|chain| chain.start).unwrap_or_default());
        let load = Load::new(scene);
        law.begin(load.before(0.0, scene.solver.step_s));
        let mut simulation = Simulation {
            engine: build::engine(scene, &law)?,
            least_j: build::least_energy_j(scene, &law),
            law,
            load,
            grid: StepGrid::new(scene.solver.step_s),
            step: 0,
            epoch: 0,
            last: Taken::default(),
            solver: scene.solver,
            ledger: Ledger::default(),
            error: None,
            observed: Observed {
                start: Observation::default(),
                last: build::observation(scene),
                next: build::observation(scene),
            },
            saved: Vec::new(),
            retried: 0,
            unconverged: 0,
            passed: PassedLoads::new(scene),
            changed: false,
            distrusted: None,
        };
        simulation.engine.save(&mut simulation.saved);
        simulation.begin().map_err(|_| BuildError {
            key: "start",
            model: scene.solver.model.as_str(),
            why: start_refusal::no_accelerations(scene).into(),
        })?;
        Ok(simulation)
    }

    fn begin(&mut self) -> Result<(), Diverged> {
        self.engine.reset();
        self.step = 0;
        self.grid = StepGrid::new(self.grid.step_s);
        self.changed = false;
        self.passed.restart();
        self.law.set_origin(None);
        self.load.reset();
        self.law.begin(self.load.before(0.0, self.grid.step_s));
        self.observe()?;
        self.observed.start.clone_from(&self.observed.last);
        self.ledger = Ledger::new(self.observed.last.energy).with_least(self.least_j);
        self.error = self.engine.local_error(&self.law, 0.0, self.grid.step_s).map(|_| ErrorEstimate::default());
        Ok(())
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
        self.grid.step_s
    }

    /// Times of steps.
    pub fn grid(&self) -> StepGrid {
        self.grid
    }

    /// Simulated time, s.
    pub fn time_s(&self) -> f64 {
        self.grid.time_s(self.step)
    }

    /// Newton iterations of the last step; `None` with a scheme that does not iterate.
    pub fn newton_iterations(&self) -> Option<u32> {
        self.solver.iterates().then_some(self.last.effort.newton_iterations)
    }

    /// Cost of the last step.
    pub fn effort(&self) -> Effort {
        self.last.effort
    }

    /// Steps that failed at first and were taken in parts, parts of parts counted too.
    pub fn retried(&self) -> u64 {
        self.retried
    }

    /// Steps of fixed cost whose last correction left a residual above `solver.tolerance`.
    pub fn unconverged(&self) -> u64 {
        self.unconverged
    }

    /// Residual that the last step of fixed cost left, relative to the forces at work; 0 if it is solved to the tolerance.
    pub fn left_over(&self) -> f64 {
        self.last.left_over
    }

    /// Pulses that wait or act.
    pub fn pulses_pending(&self) -> usize {
        self.load.pulses.len()
    }

    /// Adds a pulse before the next step.
    ///
    /// # Errors
    /// [`PulseRefused`] when a number is out of range or too many pulses are pending; nothing is changed then.
    pub fn add_pulse(&mut self, request: &PulseRequest) -> Result<Effective, PulseRefused> {
        let start_s = self.load.add(request, self.time_s())?;
        let waits = (request.delay_s / self.grid.step_s).floor() as u64;
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
        let (from_s, to_s) = (self.time_s(), self.grid.time_s(self.step + 1));
        // Between two steps it does not change.
        let (torque_nm, side_s, error) = (self.law.torque.mean_nm, self.law.step_s, self.error);
        self.saved.clear();
        self.engine.save(&mut self.saved);
        self.follow_crank();
        self.error.iter_mut().for_each(ErrorEstimate::begin_step);
        let taken = self.advance_from_edge_to_edge(from_s, to_s).map_err(Cause::from).and_then(|taken| {
            let energy = self.engine.energy(&self.law, to_s);
            let ledger = finite(&taken.work, &energy).and(self.ledger.after(taken.work, energy, self.engine.keeps_energy()))?;
            Ok((taken, ledger))
        });
        let (taken, ledger) = taken.map_err(|cause| {
            self.engine.restore(&self.saved);
            (self.law.torque, self.law.step_s) = (Torque::constant(torque_nm), side_s);
            self.error = error;
            self.diverged(cause)
        })?;
        self.step += 1;
        self.last = taken;
        self.unconverged += u64::from(taken.left_over > self.solver.tolerance);
        self.ledger = ledger;
        self.follow_crank();
        let at_end = self.load.before(to_s, self.grid.step_s);
        self.load.deliver(&self.law.torque, from_s, to_s, self.grid.step_s);
        self.law.during(at_end, [to_s - margin_s(to_s, self.grid.step_s), to_s]);
        Ok(())
    }

    fn diverged(&self, cause: Cause) -> Diverged {
        Diverged { step: self.step + 1, sim_time_s: self.time_s(), energy_j: self.ledger.energies().energy.moving_j(), cause }
    }

    /// Mean torque since this was last asked (or the epoch began), N·m; the torque at this instant if no time has passed.
    pub fn take_mean_torque_nm(&mut self) -> f64 {
        self.load.take_mean_nm().unwrap_or(self.law.torque.mean_nm)
    }

    /// Driving torque of a sample taken now, N·m: the mean torque since the sample before; of a prescribed motion, the
    /// torque that it needed when it was observed last.
    pub fn take_driving_torque_nm(&mut self) -> f64 {
        let mean_nm = self.take_mean_torque_nm();
        self.observed.last.motion_torque_nm.unwrap_or(mean_nm)
    }

    /// Looks at the present state.
    ///
    /// # Errors
    /// [`Diverged`] when accelerations cannot be solved for, or a number is not finite.
    pub fn observe(&mut self) -> Result<&Observation, Diverged> {
        let time_s = self.time_s();
        self.engine.observe(&self.law, time_s, &mut self.observed.next).map_err(|cause| self.diverged(cause.into()))?;
        if !self.observed.next.is_finite() {
            return Err(self.diverged(StepError::NotFinite.into()));
        }
        if self.changed {
            // The exact solution is that of a scene which began as it is now.
            self.observed.next.links.iter_mut().for_each(|link| link.exact_x_m.fill(f64::NAN));
        }
        std::mem::swap(&mut self.observed.last, &mut self.observed.next);
        Ok(&self.observed.last)
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
        &self.observed.start
    }

    /// The last observation.
    pub fn observation(&self) -> &Observation {
        &self.observed.last
    }

    /// Energies and works of the present state.
    pub fn ledger(&self) -> EnergyLedger {
        self.ledger.energies()
    }

    /// Energies, works and estimated error of the present state.
    pub fn account(&self) -> Account {
        Account { ledger: self.ledger(), verdict: self.energy_verdict(), error: self.error }
    }
}

fn finite(work: &Work, energy: &Energy) -> Result<(), Cause> {
    let energies = [energy.kinetic_j, energy.strain_j.unwrap_or(0.0), energy.potential_j.unwrap_or(0.0)];
    let all = work.is_finite() && energies.iter().all(|energy| energy.is_finite());
    if all { Ok(()) } else { Err(StepError::NotFinite.into()) }
}
