//! Missing steps: samples that were due by the publishing rate and are not in the recording, and why.

use super::event::resets;
use super::finding::{Finding, LossReason};
use super::recorded_session::RecordedSession;
use super::resimulator::EpochStep;
use super::timeline::Timeline;
use crate::scene::System;
use crate::simulation::{PerTelemetry, PublishRate};
use crate::wire::{Gap, Message, Topic, status::State};

/// Largest number of missing ranges kept for the report.
const LIMIT: usize = 1000;

/// Follows every topic through the steps of a recording.
pub(super) struct MissingSteps {
    /// Whether the first state of the run is in the recording.
    begins_with_run: bool,
    /// Whether a message came.
    begun: bool,
    tracks: Vec<TopicTrack>,
    /// Expected sequence number of the next command.
    next_command: u32,
    /// Numbers of the messages before which commands are missing.
    numbers_after_missing_commands: Vec<u64>,
    holes: Vec<MissingRange>,
}

struct TopicTrack {
    topic: Topic,
    rate: Option<PublishRate>,
    /// Last recorded step.
    last: Option<EpochStep>,
    /// Step of the last message.
    seen: Option<EpochStep>,
    /// Expected sequence number of the next message: a jump means that messages were lost from the file.
    next: u32,
    /// Whether the first state of the epoch is due: it is published at any rate.
    start_is_due: bool,
    /// Whether part of the file was lost since the last message.
    lost: bool,
    /// Index of a missing range that another topic revealed: the next message of this topic may explain it.
    open: Option<usize>,
}

struct MissingRange {
    topic: Topic,
    epoch: u64,
    after: u64,
    before: u64,
    count: u64,
    damaged: bool,
    /// Number of the message that revealed it.
    number: u64,
}

impl MissingSteps {
    pub(super) fn new(source: &RecordedSession) -> Self {
        let turns = matches!(source.scene.scene.system, System::Chain(_));
        let is_published = |topic| match topic {
            Topic::Angles | Topic::Loads => turns,
            Topic::Energies => source.energies,
            _ => true,
        };
        let rates = source.publish.map_or(PerTelemetry::default(), |rates| rates.map(Some)).by_topic().into_iter();
        let tracks = rates.filter(|(topic, _)| is_published(*topic));
        let tracks = tracks
            .map(|(topic, rate)| TopicTrack {
                topic,
                rate,
                last: None,
                seen: None,
                next: 0,
                start_is_due: false,
                lost: false,
                open: None,
            })
            .collect();
        MissingSteps {
            begins_with_run: source.begins_with_run() && source.metadata.fact("resumes").is_empty(),
            begun: false,
            tracks,
            next_command: 0,
            numbers_after_missing_commands: Vec::new(),
            holes: Vec::new(),
        }
    }

    /// Notes that part of the file is lost.
    pub(super) fn damaged(&mut self) {
        self.tracks.iter_mut().for_each(|track| track.lost = true);
    }

    /// Adds message number `number` of the file, with sequence number `sequence` on its channel. Returns whether its topic holds a message
    /// of that step already: no step is sampled twice.
    pub(super) fn take(&mut self, event: &Message, sequence: u32, number: u64, timeline: &Timeline) -> bool {
        let Some(stamp) = event.stamp() else { return false };
        let at = (stamp.epoch, stamp.step);
        let is_double = self.is_double(event.topic(), at);
        self.take_at(event, at, (sequence, number), timeline);
        self.begun = true;
        is_double
    }

    fn is_double(&mut self, topic: Topic, at: EpochStep) -> bool {
        let track = self.tracks.iter_mut().find(|track| track.topic == topic);
        track.is_some_and(|track| track.seen.replace(at) == Some(at))
    }

    fn take_at(&mut self, event: &Message, at: EpochStep, (sequence, number): (u32, u64), timeline: &Timeline) {
        match event {
            // Samples are expected from here on, in a new epoch.
            Message::Checkpoint(_) => {
                let begins_run = self.begins_with_run && !self.begun;
                let fresh = |track: &&mut TopicTrack| track.last.is_none_or(|(epoch, _)| epoch != at.0);
                self.tracks.iter_mut().filter(fresh).for_each(|track| {
                    // A recording that a command started after a reset begins after the first state of that epoch.
                    let begins_epoch = at.0 > 0 && track.last.is_some();
                    track.start_is_due = at.1 == 0 && (begins_epoch || begins_run);
                    track.last = Some(at);
                });
            }
            // Everything due before the status was published before it.
            Message::Status(status) if status.state() != State::Diverged => {
                self.all_up_to(at, number, timeline);
                if status.state() == State::Finished {
                    self.end_at(at, number);
                }
            }
            Message::Commands(command) => {
                if sequence != self.next_command {
                    self.numbers_after_missing_commands.push(number);
                }
                self.next_command = sequence.wrapping_add(1);
                if resets(command) {
                    self.all_up_to(at, number, timeline);
                }
            }
            event => self.arrived(event.topic(), at, (sequence, number), timeline),
        }
    }

    fn arrived(&mut self, topic: Topic, at: EpochStep, (sequence, number): (u32, u64), timeline: &Timeline) {
        let Some(i) = self.tracks.iter().position(|track| track.topic == topic) else { return };
        let track = &mut self.tracks[i];
        track.lost |= sequence != track.next;
        track.next = sequence.wrapping_add(1);
        if let Some(hole) = track.open.take().and_then(|open| self.holes.get_mut(open)) {
            hole.damaged |= track.lost;
        }
        track.start_is_due &= track.last != Some(at);
        self.check(i, at, number, timeline);
        let track = &mut self.tracks[i];
        (track.last, track.start_is_due, track.lost) = (Some(at), false, false);
    }

    fn all_up_to(&mut self, (epoch, step): EpochStep, number: u64, timeline: &Timeline) {
        for i in 0..self.tracks.len() {
            let open = self.holes.len();
            if self.check(i, (epoch, step.saturating_add(1)), number, timeline) {
                self.tracks[i].start_is_due = false;
                (self.tracks[i].last, self.tracks[i].open) = (Some((epoch, step)), Some(open));
            }
        }
    }

    /// Notes the topics without the last state of the run, which is published at any rate.
    fn end_at(&mut self, (epoch, step): EpochStep, number: u64) {
        for TopicTrack { topic, rate, last, lost, .. } in &self.tracks {
            let Some((_, (of, after))) = rate.zip(*last).filter(|(_, last)| *last != (epoch, step)) else { continue };
            let after = if of == epoch { after } else { 0 };
            let range = MissingRange { topic: *topic, epoch, after, before: step + 1, count: 1, damaged: *lost, number };
            self.holes.push(range);
        }
    }

    /// Notes the missing range of a topic before an instant; returns whether there is one.
    fn check(&mut self, i: usize, (epoch, before): EpochStep, number: u64, timeline: &Timeline) -> bool {
        let TopicTrack { topic, rate: Some(rate), last: Some((of, after)), start_is_due, lost, .. } = &self.tracks[i] else {
            return false;
        };
        let later = || timeline.due_between(*rate, epoch, *after, before) + u64::from(*start_is_due);
        let count = if *of == epoch { later() } else { 0 };
        if count > 0 && self.holes.len() < LIMIT {
            self.holes.push(MissingRange { topic: *topic, epoch, after: *after, before, count, damaged: *lost, number });
        }
        count > 0
    }

    /// Returns the missing ranges with reasons, and the numbers of messages before which commands may be missing too.
    /// `recovered`: the recording was recovered from a damaged one; `computed`: it was computed from another one by what-if.
    pub(super) fn into_findings(self, gaps: &[Gap], recovered: bool, computed: bool) -> (Vec<Finding>, Vec<u64>) {
        let why = |hole: &MissingRange| {
            let reported = |gap: &Gap| {
                let last = gap.stamp.unwrap_or_default();
                gap.topic == hole.topic.chunk()
                    && last.epoch == hole.epoch
                    && gap.first_step < hole.before
                    && last.step > hole.after
            };
            match hole.damaged {
                true if recovered => LossReason::Recovered,
                true => LossReason::Damage,
                false if gaps.iter().any(reported) => {
                    if computed {
                        LossReason::Source
                    } else {
                        LossReason::Queue
                    }
                }
                false => LossReason::Unexplained,
            }
        };
        let mut breaks = self.numbers_after_missing_commands;
        let mut findings = Vec::new();
        for hole in &self.holes {
            let why = why(hole);
            if !matches!(why, LossReason::Queue | LossReason::Source) {
                breaks.push(hole.number);
            }
            let MissingRange { topic, epoch, after, before, count, .. } = *hole;
            findings.push(Finding::Missing { topic: topic.chunk(), epoch, after, before, count, why });
        }
        (findings, breaks)
    }
}
