//! The first reading of a recording: order, completeness, and checks that need no re-simulation.

use std::collections::BTreeMap;

use super::channels::{ChannelCheck, chunk};
use super::event::{decode, is_report, topic};
use super::finding::{Finding, LossReason};
use super::missing_steps::MissingSteps;
use super::physics::PhysicsCheck;
use super::recorded_session::RecordedSession;
use super::run_track::RunTrack;
use super::timeline::Timeline;
use crate::recording::{
    EndReason, METADATA, RecordedMessage, RecordingEnd, RecordingError, SCENE, Structure, WalkFlow, WalkItem, nanoseconds, walk,
};
use crate::wire::{Gap, Message, Stamp, Topic};

/// Name of the metadata record of a recovered recording.
const RECOVERED: &str = "flexcrank-recovered";

/// The fault of a log time that is not that of its stamp.
const DIFFERS: &str = "the log time differs from the stamp";

/// Largest number of findings kept of single messages, so that a small file full of empty messages does not fill the memory.
const KEPT: usize = 10_000;

/// Result of the first reading.
#[derive(Default)]
pub(super) struct Survey {
    pub structure: Structure,
    pub physics: PhysicsCheck,
    pub findings: Vec<Finding>,
    /// Number of further findings, which are not kept.
    pub unlisted: u64,
    /// Numbers of the messages before which commands may be missing.
    pub breaks: Vec<u64>,
    pub gaps: Vec<Gap>,
    /// First and last log time, ns.
    pub span_ns: Option<[u64; 2]>,
}

/// Reads a recording once; `progress` is called with the position in bytes.
pub(super) fn survey(source: &RecordedSession, progress: &dyn Fn(u64)) -> Result<Survey, RecordingError> {
    let mut reading = Reading::new(source);
    let structure = walk(&source.path, |found, position| {
        match found {
            WalkItem::Message(message) => reading.message(message),
            WalkItem::Damage(damage) if damage.lost_ns.is_some() => reading.damaged(),
            WalkItem::Metadata(RECOVERED, _) => reading.recovered = true,
            WalkItem::Metadata(METADATA, _) => reading.metadata += 1,
            WalkItem::Attachment(SCENE, _) => reading.scenes += 1,
            WalkItem::Metadata(name, entries) => reading.ends.extend(RecordingEnd::of(name, entries)),
            _ => {}
        }
        progress(position);
        WalkFlow::Continue(())
    })?;
    Ok(reading.conclude(structure))
}

struct Reading<'a> {
    source: &'a RecordedSession,
    survey: Survey,
    holes: MissingSteps,
    channels: ChannelCheck,
    run: RunTrack,
    timeline: Timeline,
    /// Contradictions of the run. A gap of commands that is reported later may explain them.
    of_run: Vec<Finding>,
    /// Epoch of the last checkpoint, and its start, s of the session.
    epoch_start: Option<(u64, f64)>,
    /// Topic, log time and stamp of the first message, until the first checkpoint tells what its log time must be.
    undated: Option<(String, u64, Stamp)>,
    messages: u64,
    /// The ends that the file states: one, if it is whole.
    ends: Vec<RecordingEnd>,
    recovered: bool,
    is_damaged: bool,
    /// Numbers of metadata records of a session, and of scenes: one each.
    metadata: u64,
    scenes: u64,
}

impl<'a> Reading<'a> {
    fn new(source: &'a RecordedSession) -> Self {
        let physics = PhysicsCheck::new(&source.scene.scene);
        Reading {
            source,
            survey: Survey { physics, ..Survey::default() },
            holes: MissingSteps::new(source),
            channels: ChannelCheck::new(&source.name, source.metadata.other_build().is_empty()),
            run: RunTrack::new(source.begins_with_run() && !source.is_what_if(), source.is_lockstep()),
            timeline: Timeline::new(source),
            of_run: Vec::new(),
            epoch_start: None,
            undated: None,
            messages: 0,
            ends: Vec::new(),
            recovered: false,
            is_damaged: false,
            metadata: 0,
            scenes: 0,
        }
    }

    fn damaged(&mut self) {
        self.is_damaged = true;
        self.holes.damaged();
        self.channels.damaged();
        self.run.lost();
        self.survey.breaks.push(self.messages);
    }

    fn message(&mut self, message: &RecordedMessage) {
        let number = self.messages;
        self.messages += 1;
        self.channels.take(message, self.is_damaged);
        if !self.ends.is_empty() {
            self.found(Finding::End(format!("{} has a message after it", topic(message))));
        }
        let event = match decode(message) {
            Ok(event) => event,
            Err(error) => {
                let cause = error.to_string();
                return self.found(Finding::Undecodable { topic: topic(message).to_owned(), cause });
            }
        };
        // The command that started the recording may come before the first checkpoint.
        let stateless = |event: &Message| matches!(event, Message::Commands(_) | Message::Checkpoint(_) | Message::Gaps(_));
        let needs_state = event.as_ref().is_some_and(|event| !stateless(event));
        if needs_state && self.epoch_start.is_none() && !self.survey.findings.contains(&Finding::NoCheckpoint) {
            self.found(Finding::NoCheckpoint);
        }
        if let Some(Message::Checkpoint(checkpoint)) = &event {
            self.epoch_start = Some((checkpoint.stamp.unwrap_or_default().epoch, checkpoint.epoch_start_s));
        }
        event.iter().for_each(|event| self.timeline.take(event));
        self.time_of_first(message, event.as_ref());
        self.time(message, event.as_ref());
        let Some(event) = event else { return };
        if event.encode_to_vec() != message.data.as_ref() {
            self.found(contradiction(message, &event, "the message has bytes beside its fields"));
        }
        if let Message::Gaps(gap) = &event {
            if gap.topic == Topic::Commands.chunk() {
                self.run.lost();
            }
            self.survey.gaps.push(gap.as_ref().clone());
        }
        if let Some(what) = self.run.take(&event) {
            let found = contradiction(message, &event, &what);
            if self.has_room() { self.of_run.push(found) } else { self.survey.unlisted += 1 }
        }
        if self.holes.take(&event, message.sequence, number, &self.timeline) {
            self.found(contradiction(message, &event, "the step is there twice"));
        }
        let unphysical = self.survey.physics.judge(&event);
        unphysical.into_iter().for_each(|finding| self.found(finding));
    }

    fn has_room(&self) -> bool {
        self.survey.findings.len() + self.of_run.len() < KEPT
    }

    fn found(&mut self, finding: Finding) {
        if self.has_room() { self.survey.findings.push(finding) } else { self.survey.unlisted += 1 }
    }

    /// Checks that log times never fall and equal the session's start plus the simulated time since then, and that a message was
    /// published at its own wall time. A report comes later than its stamp, so its log time is that of any step.
    fn time(&mut self, message: &RecordedMessage, event: Option<&Message>) {
        let log_time = message.log_time;
        let [first, last] = self.survey.span_ns.unwrap_or([log_time; 2]);
        self.survey.span_ns = Some([first, last.max(log_time)]);
        let stamp = event.filter(|event| !is_report(event)).and_then(Message::stamp);
        let fits = match (stamp, self.epoch_start) {
            (Some(stamp), _) => self.fits(&stamp, log_time),
            (None, epoch) => epoch.is_none_or(|epoch| self.timeline.step_at(self.source, log_time, epoch).is_some()),
        };
        let what = match stamp {
            _ if log_time < last => "the log time falls",
            _ if !fits => DIFFERS,
            Some(stamp) if stamp.wall_time.and_then(wall_ns) != Some(message.publish_time) => {
                "the publish time differs from the stamp"
            }
            _ => return,
        };
        let (epoch, step) = stamp.map_or((0, 0), |stamp| (stamp.epoch, stamp.step));
        self.found(Finding::Time { topic: topic(message).to_owned(), what, epoch, step });
    }

    /// Whether a log time is that of a stamp, as far as the start of its epoch and the grid of its step are known.
    fn fits(&self, stamp: &Stamp, log_time: u64) -> bool {
        let start_s = self.epoch_start.filter(|(of, _)| *of == stamp.epoch).map(|(_, start_s)| start_s);
        start_s.is_none_or(|start_s| log_time == self.source.log_time_ns(start_s + stamp.sim_time_s))
            && self.timeline.is_timely(self.source, stamp, log_time)
    }

    /// Checks the log time of the first message against the first checkpoint: a command that started the recording precedes it.
    fn time_of_first(&mut self, message: &RecordedMessage, event: Option<&Message>) {
        if self.epoch_start.is_none() && self.messages == 1 {
            let stamp = event.filter(|event| !is_report(event)).and_then(Message::stamp);
            let fitting = stamp.filter(|stamp| self.fits(stamp, message.log_time));
            self.undated = fitting.map(|stamp| (topic(message).to_owned(), message.log_time, stamp));
        }
        let Some((topic, log_time, stamp)) = self.undated.take_if(|_| self.epoch_start.is_some()) else { return };
        if !self.fits(&stamp, log_time) {
            self.found(Finding::Time { topic, what: DIFFERS, epoch: stamp.epoch, step: stamp.step });
        }
    }

    fn conclude(self, structure: Structure) -> Survey {
        let (end, recovered) = (self.end(&structure), self.lossy_recovery());
        let repeated = [("the metadata of a session", self.metadata), ("scene.toml", self.scenes)];
        let Reading { source, mut survey, holes, channels, of_run, .. } = self;
        let Survey { findings, breaks, gaps, .. } = &mut survey;
        let (missing, lost) = holes.into_findings(gaps, recovered.is_some(), source.is_what_if());
        breaks.extend(lost);
        breaks.sort_unstable();
        findings.extend(of_run.into_iter().filter(|finding| !may_follow_from(gaps, finding)));
        findings.extend(dropped(gaps, &missing, source.is_what_if()));
        findings.extend(missing);
        findings.extend(channels.into_findings(recovered.is_some()));
        findings.extend(repeated.into_iter().filter(|(_, count)| *count > 1).map(|(what, _)| Finding::Repeated(what)));
        let is_whole = structure.damage.is_empty() && structure.cut_off.is_none();
        let silent = structure.silent_topics.iter().filter(|_| is_whole);
        findings.extend(silent.map(|topic| Finding::Channel { topic: topic.clone(), what: "it has no message".to_owned() }));
        findings.extend(structure.damage.iter().cloned().map(Finding::Damaged));
        findings.extend(structure.cut_off.map(|at| Finding::CutOff { at, bytes: structure.bytes }));
        findings.extend(end);
        findings.extend(recovered);
        let is_closed = structure.cut_off.is_none();
        findings.extend((structure.messages == 0).then_some(Finding::Empty { is_closed }));
        let has_no_rate = source.publish.is_none() && !source.is_sampled_as_original();
        findings.extend(has_no_rate.then_some(Finding::NoFact("publish_hz", "missing steps cannot be found")));
        match source.metadata.scene_is_original() {
            Some(true) => {}
            Some(false) => findings.push(Finding::SceneChanged),
            None => findings.push(Finding::NoFact("scene_crc32", "a change of the scene cannot be found")),
        }
        survey.structure = structure;
        survey
    }

    /// The loss of a recovered recording; `None` if its end is there, and as many messages as that counts.
    fn lossy_recovery(&self) -> Option<Finding> {
        let counts = self.channels.counts();
        let lost = |(topic, stated): (&String, &u64)| stated.saturating_sub(counts.get(topic).copied().unwrap_or(0));
        let missing = self.ends.first().map(|end| end.counts.iter().map(lost).fold(0, u64::saturating_add));
        (self.recovered && missing != Some(0)).then_some(Finding::Recovered { missing })
    }

    /// Returns the fault of the recording's end, if there is one.
    fn end(&self, structure: &Structure) -> Option<Finding> {
        let (end, others) = match &self.ends[..] {
            [] => return (structure.cut_off.is_none() && !self.recovered).then_some(Finding::NoEnd),
            [end, others @ ..] => (end, others),
        };
        let counts = self.channels.counts();
        let is_recovered = self.lossy_recovery().is_some();
        let number = |counts: &BTreeMap<String, u64>, topic: &str| counts.get(topic).copied().unwrap_or(0);
        let differs = |topic: &&String| match is_recovered {
            // Messages may be lost, and none is there beside those that were.
            true => number(&counts, topic) > number(&end.counts, topic),
            false => end.counts.get(*topic) != counts.get(*topic),
        };
        let differing = end.counts.keys().chain(counts.keys()).find(differs);
        let is_lossy = self.is_damaged || is_recovered;
        let dropped = |topic: Topic| self.survey.gaps.iter().any(|gap| gap.topic == topic.chunk());
        let run_ended = end.reason == EndReason::RunEnded.to_string();
        let what = if !others.is_empty() {
            "it is stated more than once".to_owned()
        } else if let Some(topic) = differing.filter(|_| !self.is_damaged) {
            format!("it counts {} messages of {topic}, but {} are there", number(&end.counts, topic), number(&counts, topic))
        } else if run_ended != self.run.has_ended() && !is_lossy && !dropped(Topic::Status) {
            format!(
                "`{}`, but the last status {}",
                end.reason,
                if run_ended { "does not say so" } else { "says that the run ended" }
            )
        } else if self.run.ends_without_checkpoint() && !is_lossy && !dropped(Topic::Checkpoint) {
            "no checkpoint holds the last state of the run".to_owned()
        } else {
            return None;
        };
        Some(Finding::End(what))
    }
}

fn contradiction(message: &RecordedMessage, event: &Message, what: &str) -> Finding {
    let Stamp { step, epoch, .. } = event.stamp().unwrap_or_default();
    Finding::Contradiction { topic: chunk(message), epoch, step, what: what.to_owned() }
}

/// Whether commands that a full queue dropped may explain a contradiction.
fn may_follow_from(gaps: &[Gap], finding: &Finding) -> bool {
    let Finding::Contradiction { epoch, step, .. } = finding else { return false };
    let of_commands = gaps.iter().filter(|gap| gap.topic == Topic::Commands.chunk());
    let first = of_commands.map(|gap| (gap.stamp.unwrap_or_default().epoch, gap.first_step)).min();
    first.is_some_and(|first| first <= (*epoch, *step))
}

/// Messages that full queues dropped, or that the original of a what-if lacks, of topics in which no step is missing for that reason.
fn dropped(gaps: &[Gap], missing: &[Finding], computed: bool) -> Vec<Finding> {
    let why = if computed { LossReason::Source } else { LossReason::Queue };
    let is_missing = |gap: &Gap| {
        let is_told = |finding: &Finding| matches!(finding, Finding::Missing { topic, why: LossReason::Queue | LossReason::Source, .. } if *topic == gap.topic);
        missing.iter().any(is_told)
    };
    let mut counts = BTreeMap::<&str, u64>::new();
    for gap in gaps.iter().filter(|gap| !is_missing(gap)) {
        *counts.entry(&gap.topic).or_default() += gap.count;
    }
    counts.into_iter().map(|(topic, count)| Finding::Dropped { topic: topic.to_owned(), count, why }).collect()
}

/// A wall time in nanoseconds since 1970.
fn wall_ns(time: prost_types::Timestamp) -> Option<u64> {
    std::time::SystemTime::try_from(time).ok().map(nanoseconds)
}
