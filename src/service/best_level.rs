//! The shadow at the best level: a thread of its own computes it, as late as the machine makes it.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::Builder;
use std::time::Duration;

use super::applied::applied;
use crate::mechanics::Observation;
use crate::resimulation::{BestLevelRun, LostTrack};
use crate::runtime::{Answer, ModelDifference, Output, yield_to_others};
use crate::simulation::Stamp;
use crate::wire::AppliedCommand;

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
    pub(super) fn take(&mut self, output: &Output, step_s: f64) {
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

    /// The run has ended: no further event comes.
    pub(super) fn end(&mut self) {
        self.events = None;
    }

    fn lose(&mut self, why: String) {
        tracing::warn!("{why}");
        self.lost = Some(why);
    }

    /// The next difference, waiting for at most `patience`; `None` if there is none yet, or none any more.
    pub(super) fn next(&mut self, patience: Duration) -> Option<(ModelDifference, Stamp)> {
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
