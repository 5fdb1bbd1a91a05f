//! The stepping thread: commands between steps, steps on their deadlines, samples out. It does no I/O.

mod commanding;
mod reporting;

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::time::{Duration, Instant, SystemTime};

use super::command::{Command, Counts};
use super::lateness::Lateness;
use super::memory::Memory;
use super::output::{Missed, Output};
use super::pacer::{Pace, Pacer};
use super::rate::PublishRate;
use super::shadow::Shadow;
use crate::simulation::{Diverged, Sample, Simulation, Stamp};
use crate::wire::{CommandReply, status::State};
use reporting::STATUS_PERIOD;

/// Simulated time between two checkpoints, s.
const CHECKPOINT_PERIOD_S: f64 = 10.0;
/// Steps between two looks at the command queue when nothing is waited for.
const BURST: u32 = 64;
/// Most queued commands that are taken before the next step.
const COMMANDS_AT_ONCE: usize = 256;

/// How a run is stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepping {
    /// How fast.
    pub pace: Pace,
    /// Simulated time at which the run is finished, s.
    pub until_s: Option<f64>,
    /// Which steps are published.
    pub publish: PublishRate,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// `until_s` was reached.
    Finished,
    /// A command, a signal or a lost receiver ended it.
    Stopped,
    /// The simulation could not go on.
    Diverged(Diverged),
}

/// The ends of the queues that the stepping thread holds.
pub struct Ports {
    /// Commands in.
    pub commands: Receiver<Command>,
    /// Everything out.
    pub output: Sender<Output>,
    /// Samples to be filled again: their number bounds what is on its way.
    pub pool: Receiver<Box<Sample>>,
    /// What is counted across threads.
    pub counts: Arc<Counts>,
}

/// The stepping thread's state.
pub struct Stepper {
    simulation: Simulation,
    shadow: Option<Shadow>,
    stepping: Stepping,
    ports: Ports,
    pacer: Pacer,
    clock: Instant,
    lateness: Lateness,
    memory: Memory,
    paused: bool,
    singles: u64,
    stopping: bool,
    resumed: bool,
    epoch_start_s: f64,
    next_status: Duration,
    next_checkpoint_s: f64,
    overruns: u64,
    dropped: u64,
    /// Samples left out that were not told of yet.
    missed: Option<Missed>,
    accepted: u64,
    rejected: u64,
    /// Largest deflection over length, of those published, that was out of the model's range; 0 when none was.
    bent: f64,
}

impl Stepper {
    /// Takes a simulation, and a second one to run beside it.
    ///
    /// # Errors
    /// When the lateness histogram cannot be made.
    pub fn new(
        simulation: Simulation,
        shadow: Option<Shadow>,
        stepping: Stepping,
        ports: Ports,
    ) -> Result<Self, hdrhistogram::CreationError> {
        Ok(Stepper {
            simulation,
            shadow,
            stepping,
            ports,
            pacer: Pacer::new(stepping.pace, Duration::ZERO, 0.0),
            clock: Instant::now(),
            lateness: Lateness::new()?,
            memory: Memory::default(),
            paused: false,
            singles: 0,
            stopping: false,
            resumed: false,
            epoch_start_s: 0.0,
            next_status: Duration::ZERO,
            next_checkpoint_s: 0.0,
            overruns: 0,
            dropped: 0,
            missed: None,
            accepted: 0,
            rejected: 0,
            bent: 0.0,
        })
    }

    /// Takes up a session: its epoch began at `epoch_start_s` of it, and `answers` were given to the commands before.
    pub fn resumed(mut self, epoch_start_s: f64, answers: &[CommandReply]) -> Self {
        self.epoch_start_s = epoch_start_s;
        answers.iter().for_each(|answer| self.memory.keep(answer));
        self.resumed = true;
        self
    }

    /// Steps until the end; the last good state is published whatever the rate.
    ///
    /// Returns how it ended, and how many samples were left out.
    pub fn run(mut self) -> (Ending, u64) {
        self.pacer.anchor(self.clock.elapsed(), self.session_s());
        self.checkpoint();
        // What was true where a session is taken up was published before.
        let first = if self.resumed { Ok(()) } else { self.publish() };
        let ending = first.and_then(|()| self.step_on()).unwrap_or_else(Ending::Diverged);
        let (state, message) = match &ending {
            Ending::Finished | Ending::Stopped => (State::Finished, String::new()),
            Ending::Diverged(diverged) => (State::Diverged, diverged.to_string()),
        };
        if !self.stepping.publish.takes(self.simulation.step_count(), self.simulation.step_s()) {
            // Of a state that cannot be looked at, the last that could was published before.
            let _ = self.publish();
        }
        self.status(state, message);
        (ending, self.dropped)
    }

    fn step_on(&mut self) -> Result<Ending, Diverged> {
        loop {
            self.status_if_due();
            self.take_commands();
            if self.stopping {
                return Ok(Ending::Stopped);
            }
            if self.singles > 0 {
                self.singles -= 1;
            } else if self.finished() {
                return Ok(Ending::Finished);
            } else if self.paused {
                self.wait(STATUS_PERIOD);
                continue;
            } else if let Some(wait) = self.time_to_deadline() {
                self.wait(wait);
                continue;
            }
            self.step()?;
        }
    }

    fn finished(&self) -> bool {
        let half_step = 0.5 * self.simulation.step_s();
        self.stepping.until_s.is_some_and(|until_s| self.simulation.time_s() > until_s - half_step)
    }

    /// How long until the next step is due; `None` when it is due now, or there are no deadlines.
    fn time_to_deadline(&mut self) -> Option<Duration> {
        let due = self.pacer.deadline(self.session_s())?;
        due.checked_sub(self.clock.elapsed()).filter(|wait| !wait.is_zero())
    }

    fn step(&mut self) -> Result<(), Diverged> {
        let burst = if self.stepping.pace == Pace::Max && !self.paused { BURST } else { 1 };
        for _ in 0..burst {
            self.account_lateness();
            self.step_once()?;
            self.checkpoint_if_due();
            if self.stepping.publish.takes(self.simulation.step_count(), self.simulation.step_s()) {
                self.publish()?;
            }
            if self.finished() {
                break;
            }
        }
        Ok(())
    }

    fn step_once(&mut self) -> Result<(), Diverged> {
        let Some(shadow) = &mut self.shadow else { return self.simulation.step() };
        let begun = Instant::now();
        self.simulation.step()?;
        shadow.follow(begun.elapsed());
        Ok(())
    }

    fn account_lateness(&mut self) {
        if self.paused {
            return;
        }
        let Some(due) = self.pacer.deadline(self.session_s()) else { return };
        let now = self.clock.elapsed();
        let late = now.saturating_sub(due);
        self.lateness.record(late);
        if let Pace::Factor(factor) = self.stepping.pace
            && late.as_secs_f64() > self.simulation.step_s() / factor
        {
            self.overruns += 1;
        }
        if Pacer::hopeless(late) {
            self.pacer.anchor(now, self.session_s());
        }
    }

    /// Simulated time since the session began, through all resets, s.
    fn session_s(&self) -> f64 {
        self.epoch_start_s + self.simulation.time_s()
    }

    fn stamp(&self) -> Stamp {
        Stamp {
            step: self.simulation.step_count(),
            epoch: self.simulation.epoch(),
            sim_time_s: self.simulation.time_s(),
            epoch_start_s: self.epoch_start_s,
            wall: SystemTime::now(),
        }
    }

    /// A lost receiver ends the run.
    fn send(&mut self, output: Output) {
        self.stopping |= self.ports.output.send(output).is_err();
    }

    /// Sends the present state. Without a free sample in the pool: in real time drops and counts, otherwise waits.
    fn publish(&mut self) -> Result<(), Diverged> {
        let hurried = self.stepping.pace != Pace::Max && !self.paused;
        let free = if hurried { self.ports.pool.try_recv().ok() } else { self.ports.pool.recv().ok() };
        let stamp = self.stamp();
        let Some(mut sample) = free else {
            self.dropped += 1;
            self.missed = Some(Missed::and(self.missed, stamp));
            return Ok(());
        };
        sample.observation.clone_from(self.simulation.observe()?);
        self.bent = self.bent.max(sample.observation.out_of_range.unwrap_or(0.0));
        sample.stamp = stamp;
        sample.driving_torque_nm = self.simulation.take_driving_torque_nm();
        self.send(Output::Sample(sample));
        let difference = self.shadow.as_mut().and_then(|shadow| shadow.difference(self.simulation.observation(), &stamp));
        if let Some(difference) = difference {
            self.send(Output::Shadow(Box::new(difference), stamp));
        }
        Ok(())
    }

    fn checkpoint_if_due(&mut self) {
        if self.session_s() >= self.next_checkpoint_s || self.ports.counts.take_checkpoint_wanted() {
            self.checkpoint();
        }
    }

    fn checkpoint(&mut self) {
        self.next_checkpoint_s = self.session_s() + CHECKPOINT_PERIOD_S;
        let stamp = self.stamp();
        self.send(Output::Checkpoint(Box::new(self.simulation.checkpoint()), stamp));
    }

    /// Waits for a command, at most for `time`.
    fn wait(&mut self, time: Duration) {
        match self.ports.commands.recv_timeout(time) {
            Ok(command) => self.consider(command),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => self.stopping = true,
        }
    }

    fn take_commands(&mut self) {
        for _ in 0..COMMANDS_AT_ONCE {
            match self.ports.commands.try_recv() {
                Ok(command) => self.consider(command),
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => return self.stopping = true,
            }
        }
    }
}
