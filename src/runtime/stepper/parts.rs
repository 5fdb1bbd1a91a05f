//! The parts of a stepper's state.

use std::collections::VecDeque;
use std::time::Duration;

use super::Ending;
use super::advance::Advance;
use super::spare::Spare;
use crate::runtime::command::Command;
use crate::runtime::duration_histogram::DurationHistogram;
use crate::runtime::governor::Governor;
use crate::runtime::ladder::Ladder;
use crate::runtime::missed_deadlines::{MissedDeadlines, StepTimings};
use crate::runtime::output::MissedSamples;
use crate::runtime::pacer::{Pace, Pacer};
use crate::runtime::status::OverrunCounts;
use crate::runtime::step_error_histogram::StepErrorHistogram;
use crate::simulation::{PerTelemetry, Stamp};

/// Whether the run is paused, and how it ends.
#[derive(Default)]
pub(super) struct RunState {
    pub paused: bool,
    pub pending_single_steps: u64,
    /// The advance under way.
    pub advance: Option<Advance>,
    /// Commands that wait for its end, in order.
    pub waiting: VecDeque<Command>,
    pub stopping: bool,
    pub ending: Option<Ending>,
}

/// Deadlines and their misses.
pub(super) struct Deadlines {
    pub pacer: Pacer,
    pub timings: StepTimings,
    pub misses: MissedDeadlines,
    pub overruns: OverrunCounts,
    /// Deadline of the last step, if it had one, until its sample is sent.
    pub of_sample: Option<Duration>,
}

impl Deadlines {
    pub(super) fn new(pace: Pace) -> Self {
        Deadlines {
            pacer: Pacer::new(pace, Duration::ZERO, 0.0),
            timings: StepTimings::default(),
            misses: MissedDeadlines::default(),
            overruns: OverrunCounts::default(),
            of_sample: None,
        }
    }

    /// Moves all later deadlines by `late`.
    pub(super) fn give_up(&mut self, late: Duration) {
        self.pacer.give_up(late);
        self.misses.given_up(late);
        self.overruns.given_up += late;
        self.overruns.pacing_epoch += 1;
    }
}

/// Statistics over the whole run.
pub(super) struct Statistics {
    pub lateness: DurationHistogram,
    pub step_cost: DurationHistogram,
    pub step_errors: StepErrorHistogram,
    /// Largest published slope of a link from its chord that exceeded the model's range, rad; 0 if none did.
    pub worst_out_of_range: f64,
}

impl Statistics {
    pub(super) fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(Statistics {
            lateness: DurationHistogram::new()?,
            step_cost: DurationHistogram::new()?,
            step_errors: StepErrorHistogram::new()?,
            worst_out_of_range: 0.0,
        })
    }
}

/// Samples dropped because the pool was empty.
#[derive(Default)]
pub(super) struct Drops {
    pub count: u64,
    /// Dropped samples that are not reported yet, by topic.
    pub unreported: PerTelemetry<Option<MissedSamples>>,
}

impl Drops {
    /// Counts a sample that was due on these topics.
    pub(super) fn add(&mut self, due: PerTelemetry<bool>, stamp: Stamp) {
        self.count += 1;
        let add = |(missed, due)| if due { Some(MissedSamples::and(missed, stamp)) } else { missed };
        self.unreported = self.unreported.zip(due).map(add);
    }
}

/// When the next periodic messages are due.
#[derive(Default)]
pub(super) struct Schedule {
    /// On the clock of the deadlines.
    pub next_status: Duration,
    /// In session time, s.
    pub next_checkpoint_s: f64,
}

/// The levels of the scene, and changes that wait.
#[derive(Default)]
pub(super) struct Levels {
    /// `None` until the scene is known.
    pub ladder: Option<Ladder>,
    /// Chooses the level, under [`Overrun::Degrade`](crate::runtime::Overrun::Degrade).
    pub governor: Option<Governor>,
    /// The level that the governor asks for, and the cost of the step that made it ask.
    pub wanted: Option<(usize, Duration)>,
    /// The next cheaper level, if it takes each step beside the level in force.
    pub spare: Option<Spare>,
    /// Changes of the scene or its level that wait for a common instant of their steps and the present ones, in their order.
    pub waiting: VecDeque<Command>,
}
