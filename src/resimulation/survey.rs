//! The first reading of a recording: order, completeness, and checks that need no re-simulation.

use super::event::{decode, topic};
use super::finding::Finding;
use super::missing_steps::MissingSteps;
use super::physics::PhysicsCheck;
use super::recorded_session::RecordedSession;
use crate::recording::{RecordedMessage, RecordingError, Structure, WalkFlow, WalkItem, walk};
use crate::wire::{Gap, Message, Stamp, Topic};

/// Name of the metadata record of a recovered recording.
const RECOVERED: &str = "flexcrank-recovered";

/// Result of the first reading.
#[derive(Default)]
pub(super) struct Survey {
    pub structure: Structure,
    pub physics: PhysicsCheck,
    pub findings: Vec<Finding>,
    /// Numbers of the messages before which commands may be missing.
    pub breaks: Vec<u64>,
    pub gaps: Vec<Gap>,
    /// First and last log time, ns.
    pub span_ns: Option<[u64; 2]>,
}

/// Reads a recording once; `progress` is called with the position in bytes.
pub(super) fn survey(source: &RecordedSession, progress: &dyn Fn(u64)) -> Result<Survey, RecordingError> {
    let physics = PhysicsCheck::new(&source.scene.scene);
    let mut reading = Reading {
        source,
        survey: Survey { physics, ..Survey::default() },
        holes: MissingSteps::new(source),
        epoch_start: None,
        messages: 0,
    };
    let mut recovered = false;
    reading.survey.structure = walk(&source.path, |found, position| {
        match found {
            WalkItem::Message(message) => reading.message(message),
            WalkItem::Damage(damage) if damage.lost_ns.is_some() => {
                reading.holes.damaged();
                reading.survey.breaks.push(reading.messages);
            }
            WalkItem::Metadata(RECOVERED, _) => recovered = true,
            _ => {}
        }
        progress(position);
        WalkFlow::Continue(())
    })?;
    let Reading { mut survey, holes, .. } = reading;
    let Survey { structure, findings, breaks, gaps, .. } = &mut survey;
    let (missing, lost) = holes.into_findings(gaps, recovered);
    breaks.extend(lost);
    breaks.sort_unstable();
    findings.extend(missing);
    findings.extend(structure.damage.iter().cloned().map(Finding::Damaged));
    findings.extend(structure.cut_off.map(|at| Finding::CutOff { at, bytes: structure.bytes }));
    findings.extend(recovered.then_some(Finding::Recovered));
    if !source.metadata.scene_is_original() {
        findings.push(Finding::SceneChanged);
    }
    Ok(survey)
}

struct Reading<'a> {
    source: &'a RecordedSession,
    survey: Survey,
    holes: MissingSteps,
    /// Epoch of the last checkpoint, and its start, s of the session.
    epoch_start: Option<(u64, f64)>,
    messages: u64,
}

impl Reading<'_> {
    fn message(&mut self, message: &RecordedMessage) {
        let number = self.messages;
        self.messages += 1;
        let event = match decode(message) {
            Ok(event) => event,
            Err(error) => {
                let cause = error.to_string();
                return self.survey.findings.push(Finding::Undecodable { topic: topic(message).to_owned(), cause });
            }
        };
        // The command that started the recording may come before the first checkpoint.
        let stateless = |event: &Message| matches!(event, Message::Commands(_) | Message::Checkpoint(_) | Message::Gaps(_));
        let needs_state = event.as_ref().is_some_and(|event| !stateless(event));
        if needs_state && self.epoch_start.is_none() && !self.survey.findings.contains(&Finding::NoCheckpoint) {
            self.survey.findings.push(Finding::NoCheckpoint);
        }
        if let Some(Message::Checkpoint(checkpoint)) = &event {
            self.epoch_start = Some((checkpoint.stamp.unwrap_or_default().epoch, checkpoint.epoch_start_s));
        }
        // A gap is reported later than it occurred, so its time is not checked.
        self.time(message, event.as_ref().filter(|event| event.topic() != Topic::Gaps).and_then(Message::stamp));
        let Some(event) = event else { return };
        self.holes.take(&event, message.sequence, number);
        self.survey.findings.extend(self.survey.physics.judge(&event));
        if let Message::Gaps(gap) = event {
            self.survey.gaps.push(*gap);
        }
    }

    /// Checks that log times never fall, and equal the session's start plus the simulated time since then.
    fn time(&mut self, message: &RecordedMessage, stamp: Option<Stamp>) {
        let log_time = message.log_time;
        let [first, last] = self.survey.span_ns.unwrap_or([log_time; 2]);
        self.survey.span_ns = Some([first, last.max(log_time)]);
        let Some(stamp) = stamp else { return };
        let Stamp { step, epoch, sim_time_s, .. } = stamp;
        let fits = match self.epoch_start {
            Some((of, start_s)) if of == epoch => log_time == self.source.log_time_ns(start_s + sim_time_s),
            _ => true,
        };
        let fits = fits && self.source.is_timely(&stamp, log_time);
        let what = match (log_time < last, fits) {
            (true, _) => "the log time falls",
            (false, false) => "the log time differs from the stamp",
            (false, true) => return,
        };
        self.survey.findings.push(Finding::Time { topic: topic(message).to_owned(), what, epoch, step });
    }
}
