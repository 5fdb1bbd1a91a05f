//! What-if: a recorded session re-simulated with other commands or another scene, and its deviation from the recording.

mod later;
mod sample_times;

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, SystemTime};

use prost::Message as _;

use super::ResimulationError;
use super::change::{AddedPulse, Change};
use super::command_instant::{begins_within, keep_instant, step_of};
use super::deviation::Deviation;
use super::event::{decode, resets};
use super::own_refusal::error_of_what_if;
use super::recorded_session::{ORIGINAL_TIMES, RecordedSession};
use super::recorded_torque::RecordedTorque;
use super::resimulator::{ResimulationFault, Resimulator};
use super::source_losses::SourceLosses;
use super::timeline::{Timeline, steps_s};
use crate::recording::{
    self, EndReason, RecordedMessage, Recorder, RecordingError, SessionInfo, Settings, Structure, WalkFlow, WalkItem, WhenFull,
    Written, walk,
};
use crate::scene::SceneSource;
use crate::simulation::{Diverged, Effective, EnergyVerdict, Stamp};
use crate::whole_file::{Unfinished, part_in_nearest_folder};
use crate::wire::{self, AppliedCommand, Checkpoint, CommandReply, Gap, Message, Topic, applied_command};
use later::WaitingCommand;
pub use sample_times::SampleTimes;

/// Settings of the new recording.
const SETTINGS: Settings =
    Settings { flush_period: Duration::from_secs(1), fsync: false, split: None, limit_bytes: None, when_full: WhenFull::Wait };

/// Result of a what-if.
#[derive(Debug)]
pub struct WhatIfOutcome {
    /// Session time at which the re-simulation began, s.
    pub from_s: f64,
    /// The changed scene.
    pub scene: SceneSource,
    /// Deviation from the recording.
    pub deviation: Deviation,
    /// Why the re-simulation ended early, if it diverged.
    pub diverged: Option<Diverged>,
    /// Verdict on the energy balance of the last epoch.
    pub verdict: EnergyVerdict,
    /// Largest deflection beyond the model's range in the samples, over the link's length; 0 if none was.
    pub worst_out_of_range: f64,
    /// Samples of the recording that the changed session's steps do not reach.
    pub samples: SampleTimes,
    /// The new recording.
    pub written: Vec<Written>,
    /// Structure of the old recording, as far as it was read: whether it is damaged, or ends early.
    pub source: Structure,
}

/// Re-simulates a session from the last checkpoint before the change, or with another scene from its start, and records the
/// result to `path`, which is there only when it is whole. `progress` is called with the position in the old recording, in bytes.
///
/// # Errors
/// [`ResimulationError`] if the recording cannot be read, the change is refused or lies outside the recording, or the result
/// cannot be written.
pub fn what_if(
    source: &RecordedSession,
    change: &Change,
    path: &Path,
    progress: &dyn Fn(u64),
) -> Result<WhatIfOutcome, ResimulationError> {
    if path.exists() {
        return Err(RecordingError::Exists(path.to_owned()).into());
    }
    let mut pulses = change.pulses.clone();
    pulses.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    // Before any file is made.
    let first = change.beginning(source, pulses.first())?;
    let part = part_in_nearest_folder(path);
    let unfinished = Unfinished::at(part.clone()).map_err(RecordingError::new_file(path))?;
    let computed = compute(source, (change, pulses, first), &part, progress);
    let mut outcome = computed.map_err(|failed| failed.of_file(&part, path))?;
    path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(RecordingError::new_file(path))?;
    unfinished.finish(path, true).map_err(RecordingError::new_file(path))?;
    outcome.written.iter_mut().for_each(|written| written.path = path.to_owned());
    Ok(outcome)
}

/// `pulses`: those added, in order; `first`: the number of messages before the checkpoint to start from.
fn compute(
    source: &RecordedSession,
    (change, pulses, first): (&Change, Vec<AddedPulse>, u64),
    path: &Path,
    progress: &dyn Fn(u64),
) -> Result<WhatIfOutcome, ResimulationError> {
    let scene = change.scene(source)?;
    let same_steps = steps_s(&scene) == steps_s(&source.scene);
    let publish_hz = if same_steps { source.metadata.fact("publish_hz") } else { ORIGINAL_TIMES };
    let of = format!("{} {}", source.path.display(), change.command_line);
    let session = SessionInfo {
        name: source.name.clone(),
        scene: scene.text.clone(),
        started: source.started,
        command_line: change.command_line.clone(),
        facts: vec![("publish_hz", publish_hz.to_owned()), ("what_if", of)],
    };
    let resimulator = Resimulator::new(&scene).map_err(|refused| match change.overrides.is_empty() {
        true => ResimulationError::Build(refused),
        false => ResimulationError::Change(scene.refusal(refused.key, refused.to_string())),
    })?;
    let recorder = Recorder::start(path, &session, SETTINGS)?;
    let mut attempt = Attempt {
        source,
        other_scene: !change.overrides.is_empty(),
        losses: SourceLosses::default(),
        same_steps,
        timeline: Timeline::new(source),
        torque: RecordedTorque::new(source),
        resimulator,
        recorder,
        pulses,
        added: 0,
        waiting: VecDeque::new(),
        from_s: None,
        deviation: Deviation::default(),
        samples: SampleTimes::default(),
    };
    let (mut number, mut end) = (0, Ok(()));
    let structure = walk(&source.path, |found, position| {
        progress(position);
        let WalkItem::Message(message) = found else { return WalkFlow::Continue(()) };
        number += 1;
        match number > first {
            true => end = attempt.message(message),
            false => attempt.losses.skip(message),
        }
        if end.is_ok() { WalkFlow::Continue(()) } else { WalkFlow::Break(()) }
    })?;
    let end = end.and_then(|()| attempt.apply_all_waiting()).and_then(|()| attempt.all_added());
    let verdict = attempt.resimulator.simulation().session_verdict();
    let worst_out_of_range = attempt.resimulator.worst_out_of_range();
    let Attempt { recorder, mut deviation, torque, from_s, samples, .. } = attempt;
    if torque.was_left_out() {
        deviation.leave_out_torque();
    }
    let written = recorder.finish(EndReason::Resimulated).into_iter().collect::<Result<_, _>>()?;
    let diverged = match end {
        Ok(()) => None,
        Err(Stopped::ResimulationFault(ResimulationFault::Diverged(diverged))) => Some(diverged),
        Err(Stopped::ResimulationFault(fault)) => {
            let at_s = attempt.resimulator.stamp().session_s();
            return Err(error_of_what_if(source, (&fault, at_s), first + 1..=number));
        }
        Err(Stopped::Other(error)) => return Err(error),
    };
    let from_s = from_s.unwrap_or(0.0);
    Ok(WhatIfOutcome { from_s, scene, deviation, diverged, verdict, worst_out_of_range, samples, written, source: structure })
}

/// Why a re-simulation stopped.
enum Stopped {
    ResimulationFault(ResimulationFault),
    Other(ResimulationError),
}

impl<E: Into<ResimulationFault>> From<E> for Stopped {
    fn from(cause: E) -> Self {
        Stopped::ResimulationFault(cause.into())
    }
}

struct Attempt<'a> {
    source: &'a RecordedSession,
    other_scene: bool,
    losses: SourceLosses,
    /// Whether steps are as long as in the old recording, at each level: then the same steps have samples.
    same_steps: bool,
    timeline: Timeline,
    torque: RecordedTorque,
    resimulator: Resimulator,
    recorder: Recorder,
    pulses: Vec<AddedPulse>,
    /// Number of pulses added so far.
    added: usize,
    /// Commands that wait for the end of the step they fall into, in order.
    waiting: VecDeque<WaitingCommand>,
    /// Session time at which it began, once it has.
    from_s: Option<f64>,
    deviation: Deviation,
    samples: SampleTimes,
}

impl Attempt<'_> {
    fn message(&mut self, message: &RecordedMessage) -> Result<(), Stopped> {
        let Ok(Some(event)) = decode(message) else { return Ok(()) };
        self.timeline.take(&event);
        let timely = |stamp: &wire::Stamp| self.timeline.is_timely(self.source, stamp, message.log_time);
        let Some(stamp) = event.stamp().filter(timely) else { return Ok(()) };
        if self.from_s.is_none() {
            let Message::Checkpoint(checkpoint) = &event else { return Ok(()) };
            return self.begin(checkpoint, &event, message);
        }
        let mut gap = self.losses.take(message, &event);
        // Steps of another size may not reach the samples beside the gap: it is reported at the present step.
        if let Some(gap) = gap.take_if(|_| !self.same_steps) {
            let stamp = self.stamp(message);
            let gap = Gap { first_step: stamp.step, stamp: Some(stamp), ..gap };
            self.record(Topic::Gaps, gap.encode_to_vec(), message);
        }
        if matches!(event, Message::Gaps(_)) {
            gap.iter().for_each(|gap| self.record(Topic::Gaps, gap.encode_to_vec(), message));
            return Ok(());
        }
        let ours = event.topic().is_telemetry() || matches!(event, Message::Checkpoint(_));
        if !ours && !matches!(event, Message::Commands(_)) {
            return Ok(());
        }
        self.apply_waiting(stamp)?;
        if stamp.epoch == self.resimulator.instant().0 {
            self.add_pulses_before(self.resimulator.stamp().epoch_start_s + stamp.sim_time_s, message)?;
        }
        if let Message::Loads(loads) = &event {
            self.torque.add(loads, &self.timeline);
        }
        // Steps of another size are matched by time.
        let steps = self.resimulator.steps_at(stamp.epoch, stamp.sim_time_s);
        let step = match &event {
            Message::Commands(command) => step_of(command, steps),
            _ => steps.round(),
        };
        let is_reached = (steps - step).abs() <= 1e-6 * steps.max(1.0);
        // An oscillator has no angles.
        let sampled = self.source.scene.scene.chain().map_or(Topic::Displacements, |_| Topic::Angles);
        if event.topic() == sampled {
            self.samples.count(stamp, is_reached);
        }
        if ours && !is_reached {
            return Ok(());
        }
        let instant = (stamp.epoch, step as u64);
        if let Message::Commands(command) = &event
            && begins_within(steps, step)
        {
            self.waiting.push_back(WaitingCommand { instant, command: command.clone(), message: message.clone() });
            return Ok(());
        }
        self.resimulator.go_to(instant, |_| {})?;
        gap.iter().for_each(|gap| self.record(Topic::Gaps, gap.encode_to_vec(), message));
        if let Message::Commands(command) = &event {
            return self.command(command, message);
        }
        self.compare(event, message)
    }

    fn begin(&mut self, checkpoint: &Checkpoint, event: &Message, message: &RecordedMessage) -> Result<(), Stopped> {
        let unlike = |what: &str| {
            let (path, what) = (self.source.path.clone(), what.to_owned());
            Stopped::Other(ResimulationError::Unlike { path, what })
        };
        let state = wire::recorded_checkpoint(checkpoint)?;
        if self.other_scene {
            if (state.epoch, state.step) != (0, 0) {
                return Err(unlike(
                    "another scene needs the session's start, and the recording begins later; take the recording that this one \
                     resumed, or the first part",
                ));
            }
        } else if !self.resimulator.restore(checkpoint) {
            return Err(unlike("its checkpoint is not one of its scene"));
        }
        self.from_s = Some(self.resimulator.stamp().session_s());
        self.torque.begin(checkpoint.stamp.unwrap_or_default());
        self.write_in_place_of(event, message)?;
        Ok(())
    }

    fn command(&mut self, command: &AppliedCommand, message: &RecordedMessage) -> Result<(), Stopped> {
        if resets(command) {
            let applied = AppliedCommand { stamp: Some(self.stamp(message)), ..command.clone() };
            self.record(Topic::Commands, applied.encode_to_vec(), message);
            return Ok(self.resimulator.command(command)?);
        }
        let effective = self.resimulator.simulation().now();
        if let Some(changed_j) = self.resimulator.change(command)? {
            return self.record_change(command, (effective, changed_j), message);
        }
        let mut command = command.clone();
        keep_instant(&mut command, self.resimulator.simulation());
        if let Some(applied_command::Command::Advance(advance)) = &mut command.command {
            advance.steps = self.steps_as_long(advance.steps);
            if advance.steps == 0 {
                return Ok(());
            }
        }
        let Some(effective) = self.resimulator.torque(&command)? else { return Ok(()) };
        let id = command.reply.as_ref().map_or("", |reply| &reply.id);
        self.record_torque(id, command.command, effective, message);
        Ok(())
    }

    /// Records a change of the scene or its level, repeated upon the scene in force here.
    fn record_change(
        &mut self,
        command: &AppliedCommand,
        (effective, changed_j): (Effective, f64),
        message: &RecordedMessage,
    ) -> Result<(), Stopped> {
        let reply = CommandReply {
            effective_step: effective.step,
            effective_sim_time_s: effective.sim_time_s,
            changed_j: Some(changed_j),
            ..command.reply.clone().unwrap_or_default()
        };
        let stamp = Some(self.stamp(message));
        let scene = if command.scene.is_empty() { String::new() } else { self.resimulator.scene_text().to_owned() };
        let applied = AppliedCommand { stamp, reply: Some(reply), scene, command: command.command.clone() };
        self.record(Topic::Commands, applied.encode_to_vec(), message);
        Ok(())
    }

    /// Number of own steps from now to the end of `steps` of the recording.
    fn steps_as_long(&self, steps: u64) -> u64 {
        let now = self.resimulator.instant().1;
        let grid = self.resimulator.simulation().grid();
        let end_s = grid.time_s(now) + steps as f64 * self.timeline.step_s();
        let step = grid.origin_step as f64 + ((end_s - grid.origin_s) / grid.step_s - 1e-6).ceil();
        (step.max(0.0) as u64).saturating_sub(now)
    }

    /// The stamp of the present step in what is recorded at a message.
    fn stamp(&self, message: &RecordedMessage) -> wire::Stamp {
        let wall = SystemTime::UNIX_EPOCH + Duration::from_nanos(message.publish_time);
        wire::stamp(&Stamp { wall, ..self.resimulator.stamp() })
    }

    /// Records a command whose torque was applied.
    fn record_torque(
        &self,
        id: &str,
        command: Option<applied_command::Command>,
        effective: Effective,
        message: &RecordedMessage,
    ) {
        let reply = CommandReply {
            id: id.to_owned(),
            accepted: true,
            effective_step: effective.step,
            effective_sim_time_s: effective.sim_time_s,
            ..CommandReply::default()
        };
        let stamp = Some(self.stamp(message));
        let applied = AppliedCommand { stamp, reply: Some(reply), command, scene: String::new() };
        self.record(Topic::Commands, applied.encode_to_vec(), message);
    }

    fn compare(&mut self, mut recorded: Message, message: &RecordedMessage) -> Result<(), Stopped> {
        let computed = self.write_in_place_of(&recorded, message)?;
        let (Some(computed), Some(stamp)) = (computed, recorded.stamp()) else { return Ok(()) };
        if matches!(recorded, Message::Checkpoint(_)) {
            return Ok(());
        }
        // Steps of another size have other numbers at the same time.
        let computed = computed.with_stamp(stamp);
        self.torque.match_period(&mut recorded, &computed);
        self.deviation.compare(recorded, computed, self.resimulator.stamp().session_s());
        Ok(())
    }

    fn write_in_place_of(&mut self, event: &Message, message: &RecordedMessage) -> Result<Option<Message>, Stopped> {
        let computed = self.resimulator.recompute(event)?;
        if let Some(computed) = &computed {
            self.record(event.topic(), computed.encode_to_vec(), message);
        }
        Ok(computed)
    }

    fn record(&self, topic: Topic, payload: Vec<u8>, message: &RecordedMessage) {
        let prefix = message.channel.topic.rsplit_once('/').map_or("", |(prefix, _)| prefix);
        // A failure is reported when the recording is finished.
        let _ = self.recorder.record(recording::Message {
            topic: format!("{prefix}/{}", topic.chunk()),
            schema: topic.schema(),
            payload,
            log_time_ns: self.source.log_time_ns(self.resimulator.stamp().session_s()),
            publish_time_ns: message.publish_time,
            begins_part: false,
        });
    }
}
