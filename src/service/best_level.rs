//! The shadow at the best level: a thread of its own computes it, as late as the machine makes it.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use prost::Message as _;

use super::applied::applied;
use super::output_worker::OutputWorker;
use crate::mechanics::Observation;
use crate::resimulation::{BestLevelRun, LostTrack};
use crate::runtime::{Answer, ModelDifference, Output, yield_to_others};
use crate::simulation::Stamp;
use crate::wire::{self, AppliedCommand, Topic};

/// Events that wait for the thread; while there are so many, no further state is compared.
const MOST_STATES: usize = 4096;
/// The same for commands: with more of them, the thread has lost track.
const MOST_COMMANDS: usize = 65_536;
/// Time to wait for the last differences at the end of a run.
pub(super) const LAST_DIFFERENCES: Duration = Duration::from_secs(2);

/// An event that the thread follows. They come in the order of the run.
enum Event {
    /// A command, and the step of the run that applied it, s.
    Command(Box<AppliedCommand>, f64),
    State(Box<Observation>, Stamp),
}

/// The thread, as the output thread sees it.
pub(super) struct BestLevelThread {
    /// `None` once the run has ended.
    events: Option<Sender<Event>>,
    differences: Receiver<Result<(ModelDifference, Stamp), LostTrack>>,
    /// Number of events that wait for it.
    waiting: Arc<AtomicUsize>,
    /// Why there are no more differences.
    pub lost: Option<String>,
}

impl BestLevelThread {
    /// Starts the thread.
    ///
    /// # Errors
    /// An I/O error if the system refuses a thread.
    pub(super) fn start(run: BestLevelRun) -> std::io::Result<Self> {
        let (events, to_follow) = channel();
        let (found, differences) = channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let left = Arc::clone(&waiting);
        Builder::new().name("best-level".to_owned()).spawn(move || {
            yield_to_others();
            follow(run, &to_follow, &found, &left);
        })?;
        Ok(BestLevelThread { events: Some(events), differences, waiting, lost: None })
    }

    /// Passes on what the run has done. Never waits.
    fn take(&mut self, output: &Output, step_s: f64) {
        let waiting = self.waiting.load(Ordering::Relaxed);
        let event = match output {
            Output::Answer(answer) => of_answer(answer).map(|command| Event::Command(Box::new(command), step_s)),
            Output::Sample { sample, topics, .. } if topics.angles && waiting < MOST_STATES => {
                Some(Event::State(Box::new(sample.observation.clone()), sample.stamp))
            }
            _ => None,
        };
        let Some((events, event)) = self.events.as_ref().zip(event) else { return };
        if waiting < MOST_COMMANDS {
            self.waiting.fetch_add(1, Ordering::Relaxed);
            // A thread that has lost track has ended.
            let _ = events.send(event);
        } else {
            self.events = None;
            self.lose(format!("the shadow at the best level cannot follow: {MOST_COMMANDS} commands wait for it"));
        }
    }

    fn lose(&mut self, why: String) {
        tracing::warn!("{why}");
        self.lost = Some(why);
    }

    /// The next difference, waiting for at most `patience`; `None` if there is none yet, or none any more.
    fn next(&mut self, patience: Duration) -> Option<(ModelDifference, Stamp)> {
        match self.differences.recv_timeout(patience) {
            Ok(Ok(difference)) => Some(difference),
            Ok(Err(lost)) => {
                self.lose(lost.to_string());
                None
            }
            Err(RecvTimeoutError::Disconnected) if self.events.is_some() && self.lost.is_none() => {
                self.lose("the shadow at the best level has ended by a fault of the program".to_owned());
                None
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => None,
        }
    }
}

/// The record of a command, if it took effect on the mechanism.
fn of_answer(answer: &Answer) -> Option<AppliedCommand> {
    let request = answer.request.as_ref().filter(|request| answer.reply.accepted && !request.is_of_recording())?;
    Some(applied(request.clone(), answer.reply.clone(), &answer.stamp))
}

fn follow(
    mut run: BestLevelRun,
    events: &Receiver<Event>,
    differences: &Sender<Result<(ModelDifference, Stamp), LostTrack>>,
    waiting: &AtomicUsize,
) {
    for event in events {
        waiting.fetch_sub(1, Ordering::Relaxed);
        let found = match event {
            Event::Command(command, step_s) => run.apply(&command, step_s).map(|()| None),
            Event::State(seen, stamp) => run.difference(&seen, &stamp).map(|found| found.map(|difference| (difference, stamp))),
        };
        let lost = found.is_err();
        let told = found.transpose().is_none_or(|found| differences.send(found).is_ok());
        if lost || !told {
            return;
        }
    }
}

impl OutputWorker {
    /// Lets the shadow at the best level follow, if there is one, and publishes the differences that it has found.
    pub(super) fn follow_at_best_level(&mut self, output: &Output) {
        let step_s = self.in_force.scene.source.scene.solver.step_s;
        let Some(thread) = &mut self.beside.best_level else { return };
        thread.take(output, step_s);
        while let Some((difference, stamp)) = self.beside.best_level.as_mut().and_then(|thread| thread.next(Duration::ZERO)) {
            self.send_difference(&difference, &stamp);
        }
    }

    /// Publishes the last differences, at the end of the run: those that are found within `patience`.
    pub(super) fn finish_best_level(&mut self, patience: Duration) {
        let until = Instant::now() + patience;
        let Some(thread) = &mut self.beside.best_level else { return };
        thread.events = None;
        let mut next = || {
            let thread = self.beside.best_level.as_mut()?;
            thread.next(until.saturating_duration_since(Instant::now()))
        };
        let rest: Vec<(ModelDifference, Stamp)> = std::iter::from_fn(&mut next).collect();
        rest.iter().for_each(|(difference, stamp)| self.send_difference(difference, stamp));
    }

    /// Publishes a difference: after the messages that are there already, with the stamp of the state that it is of.
    fn send_difference(&mut self, difference: &ModelDifference, stamp: &Stamp) {
        let now = self.last_stamp.unwrap_or(*stamp);
        self.send(Topic::Shadow, &now, || wire::shadow(difference, stamp).encode_to_vec());
    }
}
