//! One simulator on a stepping thread: it takes commands between steps, steps at deadlines and sends samples. It does no I/O.

mod advance;
mod changes;
mod commands;
mod deadlines;
mod ending;
mod parts;
mod reporting;
mod spare;
mod step_cost;

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant, SystemTime};

use super::command::{Command, SharedState};
use super::missed_deadlines::WakeUp;
use super::output::{Outbox, Output};
use super::pacer::{Overrun, Pace};
use super::reply::Reply;
use super::shadow::ShadowSimulation;
use super::slowdown::Slowdown;
use super::status::RunPhase;
use crate::simulation::{Diverged, PerTelemetry, PublishRate, PublishRates, Sample, Simulation, Stamp};
pub(crate) use changes::GOVERNED;
pub use ending::{Ending, RunSummary};
use parts::{Deadlines, Drops, Levels, RunState, Schedule, Statistics};
pub use reporting::STATUS_PERIOD;
pub(crate) use reporting::{beyond_range, is_distrust, is_expiry, setpoint_warning, unbalanced, warning};

/// Simulated time between two checkpoints, s.
pub(crate) const CHECKPOINT_PERIOD_S: f64 = 10.0;
/// Largest rounding error of the time of a step, over a step.
const ROUNDING: f64 = 1e-3;
/// Largest number of steps between two looks at the command queue.
const BURST: u64 = 64;
/// Largest number of commands taken before the next step. Commands that come faster wait, and are refused when the queue is full.
const COMMANDS_AT_ONCE: usize = 16;

/// Pace, end, publishing rates and deadline policy of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteppingOptions {
    /// Speed of simulated time.
    pub pace: Pace,
    /// The run finishes with the first step at or after this simulated time, s.
    pub until_s: Option<f64>,
    /// Publishing rates.
    pub publish: PublishRates,
    /// Policy for missed deadlines.
    pub overrun: Overrun,
    /// A load for trials of deadlines.
    pub slowdown: Option<Slowdown>,
    /// Whether the next cheaper level takes each step beside the level in force, under [`Overrun::Degrade`].
    pub spare: bool,
}

impl Default for SteppingOptions {
    /// Real time without end, at the default publishing rate.
    fn default() -> Self {
        let publish = PublishRate::DEFAULT.into();
        SteppingOptions {
            pace: Pace::Factor(1.0),
            until_s: None,
            publish,
            overrun: Overrun::default(),
            slowdown: None,
            spare: false,
        }
    }
}

/// The next thing that a simulator needs from its thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NextAction {
    /// A step at this time of the clock.
    Step(Duration),
    /// Housekeeping at this time, or when a command comes.
    Idle(Duration),
    /// Nothing: the run has ended.
    Over,
}

impl NextAction {
    /// The time of the next action.
    pub(super) fn at(self) -> Duration {
        match self {
            NextAction::Step(at) | NextAction::Idle(at) => at,
            NextAction::Over => Duration::ZERO,
        }
    }
}

/// The ends of the queues that the stepping thread holds.
pub struct Ports {
    /// Receives commands.
    pub commands: Receiver<Command>,
    /// Sends everything to the output thread.
    pub output: Outbox,
    /// Receives empty samples. Their number bounds the samples in flight.
    pub pool: Receiver<Arc<Sample>>,
    /// The state shared with the bus and the output thread.
    pub shared: Arc<SharedState>,
}

/// One simulator with its deadlines, statistics and queues.
pub struct Stepper {
    simulation: Simulation,
    shadow: Option<ShadowSimulation>,
    stepping: SteppingOptions,
    ports: Ports,
    clock: Instant,
    next: NextAction,
    /// Current busy-waiting time of the thread.
    spin: Duration,
    run: RunState,
    deadlines: Deadlines,
    statistics: Statistics,
    drops: Drops,
    schedule: Schedule,
    levels: Levels,
    /// The topics that the first state is published on.
    first: PerTelemetry<bool>,
    epoch_start_s: f64,
}

impl Stepper {
    /// Creates a stepper for a simulation and an optional shadow.
    ///
    /// # Errors
    /// Fails if a histogram cannot be allocated.
    pub fn new(
        simulation: Simulation,
        shadow: Option<ShadowSimulation>,
        stepping: SteppingOptions,
        ports: Ports,
    ) -> Result<Self, hdrhistogram::CreationError> {
        Ok(Stepper {
            simulation,
            shadow,
            stepping,
            ports,
            clock: Instant::now(),
            next: NextAction::Step(Duration::ZERO),
            spin: Duration::ZERO,
            run: RunState { paused: stepping.pace == Pace::Lockstep, ..RunState::default() },
            deadlines: Deadlines::new(stepping.pace),
            statistics: Statistics::new()?,
            drops: Drops::default(),
            schedule: Schedule::default(),
            levels: Levels::default(),
            first: true.into(),
            epoch_start_s: 0.0,
        })
    }

    /// Resumes a session whose epoch began at `epoch_start_s`. A retry of an earlier command is answered from `answers`. The state at
    /// which it resumes was published before, but on the `missing` topics.
    pub fn resumed(mut self, epoch_start_s: f64, answers: &[Reply], missing: PerTelemetry<bool>) -> Self {
        self.epoch_start_s = epoch_start_s;
        answers.iter().for_each(|answer| self.ports.shared.remember(answer, None));
        self.first = missing;
        self
    }

    /// Whether steps have deadlines.
    pub(super) fn has_deadlines(&self) -> bool {
        matches!(self.stepping.pace, Pace::Factor(_))
    }

    /// The next thing that the simulator needs.
    pub(super) fn next(&self) -> NextAction {
        self.next
    }

    /// Publishes the first state; deadlines are on `clock`. This is simulator `index` of the `count` on the thread.
    pub(super) fn begin(&mut self, clock: Instant, (index, count): (usize, usize)) {
        self.clock = clock;
        self.start_spare();
        self.ports.shared.wake_with(std::thread::current());
        self.checkpoint();
        if self.first != false.into() {
            let published = self.publish(self.first);
            self.note_result(published);
        }
        self.status(self.phase(), None);
        // Spreads the status messages of all simulators on the thread over the status period.
        self.schedule.next_status += STATUS_PERIOD * u32::try_from(index).unwrap_or(0) / u32::try_from(count).unwrap_or(1).max(1);
    }

    /// Starts the clock of the deadlines.
    pub(super) fn start(&mut self, now: Duration) {
        self.deadlines.pacer.anchor(now, self.session_s());
    }

    fn note_result(&mut self, taken: Result<(), Diverged>) {
        self.run.ending = taken.err().map(Ending::Diverged).or(self.run.ending.take());
    }

    /// Does everything but steps: status, reports, commands. `spin` is the thread's current busy-waiting time.
    pub(super) fn housekeep(&mut self, spin: Duration) {
        let begun = self.clock.elapsed();
        self.spin = spin;
        if self.run.ending.is_some() {
            // A status or a command now would be one of a step that was not taken.
            return self.decide(false);
        }
        self.status_if_due();
        self.report_overruns_if_due(begun);
        let more = self.take_commands(Duration::MAX);
        self.take_waiting_changes();
        if self.run.paused && self.ports.shared.take_checkpoint_wanted() {
            // No step comes after which it would be made.
            self.checkpoint();
        }
        self.decide(more);
        self.deadlines.timings.sending += self.clock.elapsed().saturating_sub(begun);
    }

    /// Handles the commands that come before `until`.
    pub(super) fn take_commands_until(&mut self, until: Duration) {
        let more = self.take_commands(until);
        self.decide(more);
    }

    /// Decides what comes next. `more`: further commands may be waiting.
    fn decide(&mut self, more: bool) {
        self.next = if self.run.stopping || self.run.ending.is_some() {
            NextAction::Over
        } else if self.finished() {
            // Also if steps are left that were asked for one by one.
            self.run.ending = Some(Ending::Finished);
            NextAction::Over
        } else if self.run.pending_single_steps > 0 {
            NextAction::Step(Duration::ZERO)
        } else if self.run.paused {
            NextAction::Idle(if more || !self.run.waiting.is_empty() { Duration::ZERO } else { self.schedule.next_status })
        } else {
            NextAction::Step(self.due().unwrap_or_default())
        };
        if let NextAction::Step(due) = self.next {
            self.deadlines.timings.ready |= self.clock.elapsed() <= due;
        }
    }

    /// Ends the run. Publishes the last good state at any publishing rate.
    pub(super) fn end(&mut self) -> RunSummary {
        let ending = self.run.ending.take().unwrap_or(Ending::Stopped);
        self.end_advances(&ending);
        self.refuse_waiting();
        let (phase, message) = match &ending {
            Ending::Finished | Ending::Stopped => (RunPhase::Finished, None),
            Ending::Diverged(diverged) => (RunPhase::Diverged, Some(diverged.to_string())),
            Ending::Late { step, late } => (RunPhase::Finished, Some(format!("step {step} would have begun {late:.1?} late"))),
        };
        let rest = self.due_topics().map(|due| !due);
        if rest != false.into() {
            // If this state cannot be observed, the last good one was published already.
            let _ = self.publish(rest);
        }
        self.report_overruns();
        // The last state in full: it proves the commands whose effect is still to come.
        self.checkpoint();
        self.status(phase, message);
        self.send(Output::Over);
        RunSummary {
            ending,
            dropped: self.drops.count,
            verdict: self.simulation.session_verdict(),
            unconverged: self.simulation.unconverged(),
            worst_out_of_range: self.statistics.worst_out_of_range,
            passed_load: self.simulation.passed_load(),
        }
    }

    fn finished(&self) -> bool {
        let rounding_s = ROUNDING * self.simulation.step_s();
        self.stepping.until_s.is_some_and(|until_s| self.simulation.time_s() > until_s - rounding_s)
    }

    /// Takes the steps of one wake-up.
    pub(super) fn step(&mut self, wake_up: WakeUp) {
        let count = if self.run.paused { self.run.pending_single_steps.min(BURST) } else { self.batch() };
        let mut deadlines = self.deadlines_at(wake_up);
        for _ in 0..count {
            let taken = self.step_on_time(&mut deadlines);
            if self.run.paused {
                self.run.pending_single_steps -= 1;
            }
            match taken {
                Ok(()) => self.count_advance(),
                Err(ending) => self.run.ending = Some(ending),
            }
            if self.run.ending.is_some() || self.finished() {
                return;
            }
        }
        self.give_up_if_late(&deadlines);
        self.prepare_spare_ahead();
    }

    /// Does everything that follows a step of this cost: estimates its error, publishes, saves checkpoints.
    fn after_step(&mut self, cost: Duration) -> Result<(), Diverged> {
        if let Some(error) = self.simulation.error_estimate() {
            self.statistics.step_errors.record(error.last_step_rad);
        }
        if let Some(shadow) = &mut self.shadow {
            shadow.follow(cost);
        }
        self.checkpoint_if_due();
        let due = self.due_topics();
        if due != false.into() {
            self.publish(due)?;
        }
        self.status_by_simulated_time();
        self.take_waiting_changes();
        self.govern(cost);
        Ok(())
    }

    /// The topics that the present step is published on.
    fn due_topics(&self) -> PerTelemetry<bool> {
        let (step, grid) = (self.simulation.step_count(), self.simulation.grid());
        self.stepping.publish.map(|rate| rate.is_due(step, &grid))
    }

    /// Simulated time since the session began, resets included, s.
    fn session_s(&self) -> f64 {
        self.epoch_start_s + self.simulation.time_s()
    }

    fn stamp(&self) -> Stamp {
        self.simulation.stamp(self.epoch_start_s, SystemTime::now())
    }

    /// Sends to the output thread; a lost receiver ends the run.
    fn send(&mut self, output: Output) {
        self.run.stopping |= !self.ports.output.send(output);
    }

    /// Publishes the present state. With an empty pool, a paced run drops the sample and counts it; an unpaced run waits.
    fn publish(&mut self, due: PerTelemetry<bool>) -> Result<(), Diverged> {
        let begun = self.clock.elapsed();
        let published = self.send_sample(due);
        self.deadlines.timings.sending += self.clock.elapsed().saturating_sub(begun);
        published
    }

    fn send_sample(&mut self, due: PerTelemetry<bool>) -> Result<(), Diverged> {
        let hurried = self.stepping.pace != Pace::Max && !self.run.paused;
        let free = if hurried { self.ports.pool.try_recv().ok() } else { self.ports.pool.recv().ok() };
        let stamp = self.stamp();
        let Some(mut free) = free else {
            self.drops.add(due, stamp);
            return Ok(());
        };
        // The pool holds the only reference, so nothing is cloned.
        let sample = Arc::make_mut(&mut free);
        self.simulation.sample(sample, stamp)?;
        self.statistics.worst_out_of_range =
            self.statistics.worst_out_of_range.max(sample.observation.out_of_range.unwrap_or(0.0));
        if due.loads {
            sample.driving_torque_nm = self.simulation.take_driving_torque_nm();
        }
        let deadline = self.deadlines.of_sample.take().map(|due| self.clock + due);
        self.send(Output::Sample { sample: free, topics: due, deadline });
        let difference = self.shadow.as_mut().and_then(|shadow| shadow.difference(self.simulation.observation()));
        if let Some(difference) = difference {
            self.send(Output::Shadow(Box::new(difference), stamp));
        }
        Ok(())
    }

    /// Handles commands that come before `until`; returns whether more may be waiting.
    fn take_commands(&mut self, until: Duration) -> bool {
        for _ in 0..COMMANDS_AT_ONCE {
            if until < Duration::MAX && self.clock.elapsed() >= until {
                return true;
            }
            if let Some(command) = self.next_waiting() {
                self.handle_command(command);
                continue;
            }
            match self.ports.commands.try_recv() {
                Ok(command) => self.handle_in_turn(command),
                Err(TryRecvError::Empty) => return false,
                Err(TryRecvError::Disconnected) => {
                    self.run.stopping = true;
                    return false;
                }
            }
        }
        true
    }
}
