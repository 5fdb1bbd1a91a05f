//! Steps that were due and are not there, and why.

use super::event::{Event, resets};
use super::finding::{Finding, LossReason};
use super::recorded_session::RecordedSession;
use super::resimulator::EpochStep;
use crate::runtime::{PublishRate, PublishRates};
use crate::scene::System;
use crate::wire::{Gap, status::State};

/// MissingSteps that are kept for the report; more are only counted in the ones before.
const LIMIT: usize = 1000;

/// Follows the topics of a recording through its steps.
pub(super) struct MissingSteps {
    step_s: f64,
    tracks: Vec<TopicTrack>,
    /// The number that the writer gives to the next command.
    next_command: u32,
    /// Numbers of the messages before which commands are missing.
    numbers_after_missing_commands: Vec<u64>,
    holes: Vec<MissingRange>,
}

struct TopicTrack {
    topic: &'static str,
    rate: Option<PublishRate>,
    /// What was there last.
    last: Option<EpochStep>,
    /// The number that the writer gives to the next message: it counts what it wrote, so a jump means that the file has lost some.
    next: u32,
    /// A part of the file was lost since the last message.
    lost: bool,
    /// A hole that something else has shown: the topic's next message may say why.
    open: Option<usize>,
}

struct MissingRange {
    topic: &'static str,
    epoch: u64,
    after: u64,
    before: u64,
    count: u64,
    damaged: bool,
    /// Number of the message that showed it.
    number: u64,
}

impl MissingSteps {
    pub(super) fn new(source: &RecordedSession) -> Self {
        let track = |topic, rate: fn(PublishRates) -> PublishRate| TopicTrack {
            topic,
            rate: source.publish.map(rate),
            last: None,
            next: 0,
            lost: false,
            open: None,
        };
        let mut tracks = vec![track("displacements", |rates| rates.displacements)];
        if source.energies {
            tracks.push(track("energies", |rates| rates.energies));
        }
        if let System::Chain(_) = source.scene.scene.system {
            tracks.extend([track("angles", |rates| rates.angles), track("loads", |rates| rates.loads)]);
        }
        MissingSteps {
            step_s: source.scene.scene.solver.step_s,
            tracks,
            next_command: 0,
            numbers_after_missing_commands: Vec::new(),
            holes: Vec::new(),
        }
    }

    /// A part of the file is lost.
    pub(super) fn damaged(&mut self) {
        self.tracks.iter_mut().for_each(|track| track.lost = true);
    }

    /// Takes the next message, the `number`th of the file and the `sequence`th that was written on its channel.
    pub(super) fn take(&mut self, event: &Event, sequence: u32, number: u64) {
        let Some(stamp) = event.stamp() else { return };
        let at = (stamp.epoch, stamp.step);
        match event {
            Event::Displacements(_) => self.arrived("displacements", at, sequence, number),
            Event::Angles(_) => self.arrived("angles", at, sequence, number),
            Event::Loads(_) => self.arrived("loads", at, sequence, number),
            Event::Energies(_) => self.arrived("energies", at, sequence, number),
            // From here on, whatever was published.
            Event::Checkpoint(_) => {
                let fresh = |track: &&mut TopicTrack| track.last.is_none_or(|(epoch, _)| epoch != at.0);
                self.tracks.iter_mut().filter(fresh).for_each(|track| track.last = Some(at));
            }
            // What it says was all published before it.
            Event::Status(status) if status.state() != State::Diverged => self.all_up_to(at, number),
            Event::Command(command) => {
                if sequence != self.next_command {
                    self.numbers_after_missing_commands.push(number);
                }
                self.next_command = sequence.wrapping_add(1);
                if resets(command) {
                    self.all_up_to(at, number);
                }
            }
            _ => {}
        }
    }

    fn arrived(&mut self, topic: &str, at: EpochStep, sequence: u32, number: u64) {
        let Some(i) = self.tracks.iter().position(|track| track.topic == topic) else { return };
        let track = &mut self.tracks[i];
        track.lost |= sequence != track.next;
        track.next = sequence.wrapping_add(1);
        if let Some(hole) = track.open.take().and_then(|open| self.holes.get_mut(open)) {
            hole.damaged |= track.lost;
        }
        self.check(i, at, number);
        let track = &mut self.tracks[i];
        (track.last, track.lost) = (Some(at), false);
    }

    fn all_up_to(&mut self, (epoch, step): EpochStep, number: u64) {
        for i in 0..self.tracks.len() {
            let open = self.holes.len();
            if self.check(i, (epoch, step.saturating_add(1)), number) {
                (self.tracks[i].last, self.tracks[i].open) = (Some((epoch, step)), Some(open));
            }
        }
    }

    /// Keeps what is missing of a topic before an instant; whether anything is.
    fn check(&mut self, i: usize, (epoch, before): EpochStep, number: u64) -> bool {
        let TopicTrack { topic, rate: Some(rate), last: Some((of, after)), lost, .. } = &self.tracks[i] else { return false };
        let count = if *of == epoch { rate.due_between(*after, before, self.step_s) } else { 0 };
        if count > 0 && self.holes.len() < LIMIT {
            self.holes.push(MissingRange { topic, epoch, after: *after, before, count, damaged: *lost, number });
        }
        count > 0
    }

    /// Says why each is missing; and the numbers of the messages before which the file has lost something, or nothing says why
    /// something is missing: commands may be among it. `recovered`: the recording says that it was saved from a broken one.
    pub(super) fn into_findings(self, gaps: &[Gap], recovered: bool) -> (Vec<Finding>, Vec<u64>) {
        let why = |hole: &MissingRange| {
            let told = |gap: &Gap| {
                let last = gap.stamp.unwrap_or_default();
                gap.topic == hole.topic && last.epoch == hole.epoch && gap.first_step < hole.before && last.step > hole.after
            };
            match hole.damaged {
                true if recovered => LossReason::Recovered,
                true => LossReason::Damage,
                false if gaps.iter().any(told) => LossReason::Queue,
                false => LossReason::Unexplained,
            }
        };
        let mut breaks = self.numbers_after_missing_commands;
        let mut findings = Vec::new();
        for hole in &self.holes {
            let why = why(hole);
            if why != LossReason::Queue {
                breaks.push(hole.number);
            }
            let MissingRange { topic, epoch, after, before, count, .. } = *hole;
            findings.push(Finding::Missing { topic, epoch, after, before, count, why });
        }
        (findings, breaks)
    }
}
