//! The second reading of a recording: every message is re-simulated and compared, from one checkpoint to the next.

use super::ResimulationError;
use super::difference::{Difference, Field};
use super::event::{decode, is_report, schema, topic};
use super::finding::Finding;
use super::recorded_session::RecordedSession;
use super::resimulator::{EpochStep, ResimulationFault, Resimulator};
use super::run_counts::RunCounts;
use super::survey::Survey;
use super::timeline::Timeline;
use crate::recording::{RecordedMessage, WalkFlow, WalkItem, walk};
use crate::simulation::{EnergyVerdict, PulseRefused};
use crate::wire::{self, AppliedCommand, Checkpoint, CommandReply, Gap, Message, Topic, applied_command, status::State};

/// Counts and energies of a re-simulation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recomputed {
    /// Steps computed.
    pub steps: u64,
    /// Telemetry and status messages compared.
    pub messages: u64,
    /// Checkpoints restored.
    pub checkpoints: u64,
    /// Pulses applied.
    pub pulses: u64,
    /// Setpoints applied.
    pub setpoints: u64,
    /// Advances in lock-step applied.
    pub advances: u64,
    /// Changes of the scene applied.
    pub changes: u64,
    /// Messages that could not be re-simulated because data before them is lost.
    pub skipped: u64,
    /// Largest |error of the energy balance| at any status or energies, J.
    pub balance_error_j: f64,
    /// Largest energy in play at any of them, J.
    pub energy_j: f64,
    /// Verdict on the energy balance of all epochs: see [`Simulation::session_verdict`](crate::simulation::Simulation::session_verdict).
    pub verdict: Option<EnergyVerdict>,
}

/// Reads a recording a second time; `progress` is called with the position in bytes.
pub(super) fn recheck(
    source: &RecordedSession,
    survey: &Survey,
    progress: &dyn Fn(u64),
) -> Result<(Recomputed, Vec<Finding>), ResimulationError> {
    let mut recheck = Recheck {
        source,
        resimulator: Resimulator::new(&source.scene)?,
        timeline: Timeline::new(source),
        counts: RunCounts::of_old_run(),
        anchored: false,
        breaks: survey.breaks.iter().copied().peekable(),
        gaps: &survey.gaps,
        last_loads: None,
        last_command: None,
        done: Recomputed::default(),
        findings: Vec::new(),
        first: None,
        differing: 0,
        number: 0,
    };
    walk(&source.path, |found, position| {
        if let WalkItem::Message(message) = found {
            recheck.message(message);
        }
        progress(position);
        WalkFlow::Continue(())
    })?;
    let Recheck { done, mut findings, first, differing, .. } = recheck;
    findings.extend(first.map(|first| Finding::Differs { first: Box::new(first), messages: differing }));
    findings.extend((done.skipped > 0).then_some(Finding::NotRecomputed { messages: done.skipped }));
    Ok((done, findings))
}

struct Recheck<'a, B: Iterator<Item = u64>> {
    source: &'a RecordedSession,
    resimulator: Resimulator,
    timeline: Timeline,
    counts: RunCounts,
    /// Whether the re-simulation is in the state of the recording.
    anchored: bool,
    breaks: std::iter::Peekable<B>,
    gaps: &'a [Gap],
    last_loads: Option<EpochStep>,
    last_command: Option<String>,
    done: Recomputed,
    findings: Vec<Finding>,
    first: Option<Difference>,
    differing: u64,
    number: u64,
}

impl<B: Iterator<Item = u64>> Recheck<'_, B> {
    fn message(&mut self, message: &RecordedMessage) {
        while self.breaks.next_if(|number| *number <= self.number).is_some() {
            self.anchored = false;
        }
        self.number += 1;
        if schema(message) == Topic::SceneUpdates.schema() {
            return self.drawing(message);
        }
        // The first reading reports messages that do not fit their schema or time.
        let Ok(Some(event)) = decode(message) else { return };
        self.timeline.take(&event);
        let timely = |stamp: &wire::Stamp| self.timeline.is_timely(self.source, stamp, message.log_time);
        let Some(stamp) = event.stamp().filter(timely) else { return };
        let at = (stamp.epoch, stamp.step);
        self.anchored &= !self.commands_are_missing_before(at);
        match &event {
            Message::Checkpoint(checkpoint) => self.checkpoint(message, &event, checkpoint, at),
            report if is_report(report) => {}
            // The command that started the recording precedes its first state, and does not change it.
            Message::Commands(command) if !self.anchored && is_control(command) => {}
            _ if !self.anchored => self.done.skipped += 1,
            Message::Commands(command) => self.command(command, at),
            _ => self.compare(message, &event, at),
        }
    }

    /// Whether a full queue dropped commands between the present instant and `at`.
    fn commands_are_missing_before(&self, at: EpochStep) -> bool {
        let from = self.resimulator.instant();
        self.gaps.iter().filter(|gap| gap.topic == Topic::Commands.chunk()).any(|gap| {
            let last = gap.stamp.unwrap_or_default();
            (last.epoch, last.step) >= from && (last.epoch, gap.first_step) <= at
        })
    }

    /// Compares the state with a checkpoint, then restores the checkpoint.
    fn checkpoint(&mut self, message: &RecordedMessage, event: &Message, checkpoint: &Checkpoint, at: EpochStep) {
        if self.anchored {
            self.compare(message, event, at);
        } else if at == (0, 0) {
            // The start needs no checkpoint.
            self.anchored = true;
            self.counts = RunCounts::of_new_run();
            if !self.gaps.is_empty() {
                self.counts.samples_are_missing();
            }
            self.compare(message, event, at);
        } else {
            self.counts = RunCounts::of_old_run();
        }
        self.anchored = self.resimulator.restore(checkpoint);
        if self.anchored {
            self.done.checkpoints += 1;
        } else {
            self.fault(at, "the checkpoint is not one of this scene".to_owned());
        }
    }

    fn go_to(&mut self, at: EpochStep) -> bool {
        let mut steps = 0;
        let gone = self.resimulator.go_to(at, |simulation| {
            steps += 1;
            self.counts.stepped(simulation);
        });
        self.done.steps += steps;
        match gone {
            Ok(()) => true,
            // Lost, or never there: the message is counted as one that cannot be re-simulated.
            Err(ResimulationFault::Unproved { .. }) => {
                self.anchored = false;
                self.done.skipped += 1;
                false
            }
            Err(fault) => {
                self.lost(at, &fault);
                false
            }
        }
    }

    fn lost(&mut self, at: EpochStep, fault: &ResimulationFault) {
        self.anchored = false;
        self.fault(at, fault.to_string());
    }

    fn fault(&mut self, (epoch, step): EpochStep, what: String) {
        self.findings.push(Finding::ResimulationFault { epoch, step, what });
    }

    fn compare(&mut self, message: &RecordedMessage, event: &Message, at: EpochStep) {
        if !self.go_to(at) {
            return;
        }
        let diverged = match event {
            Message::Status(status) if status.state() == State::Diverged => match self.resimulator.diverges() {
                Some(diverged) => Some(diverged.to_string()),
                None => return self.continues(at),
            },
            _ => None,
        };
        let computed = match self.resimulator.recompute(event) {
            Ok(Some(computed)) => self.counted(event, computed, diverged.as_deref()),
            Ok(None) => return,
            Err(diverged) => return self.lost(at, &diverged.into()),
        };
        self.done.messages += u64::from(!matches!(event, Message::Checkpoint(_)));
        if let Message::Status(_) | Message::Energies(_) = event {
            self.account();
        }
        let computed = self.tolerate_unknown_torque(event, computed, at).encode_to_vec();
        if computed != message.data.as_ref() {
            self.differs(message, &computed, at);
        }
        // Nothing follows a divergence.
        self.anchored &= diverged.is_none();
    }

    /// Where the recording diverged, the re-simulation must diverge too.
    fn continues(&mut self, at: EpochStep) {
        self.fault(at, "the recording diverged here, but the re-simulation continues".to_owned());
        self.anchored = false;
    }

    /// Completes a computed status with the counts since the run began, and counts a sample.
    fn counted(&mut self, recorded: &Message, computed: Message, diverged: Option<&str>) -> Message {
        if recorded.topic().is_telemetry() {
            self.counts.sampled(self.resimulator.out_of_range());
        }
        match computed {
            Message::Status(status) => {
                Message::Status(Box::new(self.counts.replace(&status, self.resimulator.simulation(), diverged)))
            }
            computed => computed,
        }
    }

    /// Compares a drawing of the mechanism, which has no stamp, at the instant of its log time.
    fn drawing(&mut self, message: &RecordedMessage) {
        if !self.anchored {
            self.done.skipped += 1;
            return;
        }
        let stamp = self.resimulator.stamp();
        // The first reading reports a log time that is not that of a step.
        let epoch = (stamp.epoch, stamp.epoch_start_s);
        let Some(step) = self.timeline.step_at(self.source, message.log_time, epoch) else { return };
        let at = (stamp.epoch, step);
        if !self.go_to(at) {
            return;
        }
        let computed = match self.resimulator.draw(message.log_time) {
            Ok(computed) => computed,
            Err(diverged) => return self.lost(at, &diverged.into()),
        };
        self.done.messages += 1;
        if computed != message.data.as_ref() {
            self.differs(message, &computed, at);
        }
    }

    /// Keeps the largest balance error and the verdict of the re-simulation; each message is compared separately.
    fn account(&mut self) {
        let simulation = self.resimulator.simulation();
        let ledger = simulation.ledger();
        self.done.balance_error_j = self.done.balance_error_j.max(ledger.worst_balance_j);
        self.done.energy_j = self.done.energy_j.max(ledger.in_play_j);
        // As for the run itself, the last verdict on an epoch counts: energy that is put in later is in play, too.
        self.done.verdict = Some(simulation.session_verdict());
    }

    /// Keeps the recorded mean torque after missing loads, and the impulse since then in a checkpoint: whether a dropped sample ended its
    /// period is unknown.
    fn tolerate_unknown_torque(&mut self, event: &Message, mut computed: Message, at: EpochStep) -> Message {
        let since = self.last_loads;
        let missing = self.gaps.iter().filter(|gap| gap.topic == Topic::Loads.chunk()).any(|gap| {
            let last = gap.stamp.unwrap_or_default();
            since.is_none_or(|since| (last.epoch, last.step) > since) && (last.epoch, gap.first_step) < at
        });
        match (event, &mut computed) {
            (Message::Loads(recorded), Message::Loads(loads)) => {
                self.last_loads = Some(at);
                if missing {
                    loads.driving_torque_nm = recorded.driving_torque_nm;
                }
            }
            (Message::Checkpoint(recorded), Message::Checkpoint(state)) if missing => {
                (state.impulse_nm_s, state.impulse_over_s) = (recorded.impulse_nm_s, recorded.impulse_over_s);
            }
            _ => {}
        }
        computed
    }

    fn differs(&mut self, message: &RecordedMessage, computed: &[u8], instant: EpochStep) {
        self.differing += 1;
        if self.first.is_some() {
            return;
        }
        self.first = Some(Difference {
            topic: topic(message).to_owned(),
            instant,
            sim_time_s: self.resimulator.simulation().time_s(),
            field: Field::first(schema(message), &message.data, computed),
            after: self.last_command.clone(),
        });
    }

    fn command(&mut self, command: &AppliedCommand, at: EpochStep) {
        if !self.go_to(at) {
            return;
        }
        let (id, reply) = (command.reply.as_ref().map_or("", |reply| &reply.id), command.reply.clone().unwrap_or_default());
        self.last_command = Some(describe(command, id));
        match self.resimulator.change(command) {
            Ok(Some(changed_j)) => return self.change(command, changed_j, at),
            Err(fault) => return self.lost(at, &fault),
            Ok(None) => {}
        }
        match self.resimulator.torque(command) {
            Ok(Some(effective)) => {
                match command.command {
                    Some(applied_command::Command::Torque(_)) => self.done.pulses += 1,
                    Some(applied_command::Command::Setpoint(_)) => self.done.setpoints += 1,
                    Some(applied_command::Command::Advance(_)) => self.done.advances += 1,
                    Some(applied_command::Command::Control(_)) | None => {}
                }
                self.same_effect(&reply, effective.step, effective.sim_time_s, at);
            }
            Ok(None) => {}
            Err(ResimulationFault::Refused(cause)) => self.refused(id, at.1, cause),
            Err(_) => self.fault(at, format!("the pulse `{id}` has an unknown shape")),
        }
    }

    /// Counts a change of the scene or its level, and compares the scene after it and the energy that it brought in.
    fn change(&mut self, command: &AppliedCommand, changed: f64, at: EpochStep) {
        let stated = command.reply.as_ref().and_then(|reply| reply.changed_j);
        self.done.changes += 1;
        // The first reading reports a scene that is missing, or is none of this command.
        if !command.scene.is_empty() && self.resimulator.scene_text() != command.scene {
            self.fault(at, "the recorded scene is not the one that the changes lead to".to_owned());
        }
        if stated.map(f64::to_bits) != Some(changed.to_bits()) {
            let recorded = stated.map_or("nothing".to_owned(), |stated| stated.to_string());
            self.differing(at, Field { name: "reply.changed_j".to_owned(), recorded, computed: changed.to_string() });
        }
    }

    fn refused(&mut self, id: &str, step: u64, cause: PulseRefused) {
        self.findings.push(Finding::Refused { id: id.to_owned(), step, cause });
    }

    fn same_effect(&mut self, reply: &CommandReply, step: u64, sim_time_s: f64, at: EpochStep) {
        if reply.effective_step == step && reply.effective_sim_time_s.to_bits() == sim_time_s.to_bits() {
            return;
        }
        let field = Field {
            name: "reply.effective_sim_time_s".to_owned(),
            recorded: reply.effective_sim_time_s.to_string(),
            computed: sim_time_s.to_string(),
        };
        self.differing(at, field);
    }

    /// Notes that a field of a command differs.
    fn differing(&mut self, at: EpochStep, field: Field) {
        self.differing += 1;
        self.first.get_or_insert(Difference {
            topic: Topic::Commands.chunk().to_owned(),
            instant: at,
            sim_time_s: self.resimulator.simulation().time_s(),
            field: Some(field),
            after: self.last_command.clone(),
        });
    }
}

fn is_control(command: &AppliedCommand) -> bool {
    matches!(command.command, Some(applied_command::Command::Control(_)))
}

/// Describes a command in words.
fn describe(command: &AppliedCommand, id: &str) -> String {
    let step = command.stamp.unwrap_or_default().step;
    match &command.command {
        Some(applied_command::Command::Torque(pulse)) => {
            let (torque_nm, duration_s, delay_s) = (pulse.torque_nm, pulse.duration_s, pulse.delay_s);
            let delay = if delay_s > 0.0 { format!(" after {delay_s} s") } else { String::new() };
            format!("the pulse `{id}` of {torque_nm} N·m for {duration_s} s{delay}, taken at step {step}")
        }
        Some(applied_command::Command::Setpoint(setpoint)) => {
            let (torque_nm, hold_s) = (setpoint.torque_nm, setpoint.hold_s);
            format!("the setpoint `{id}` of {torque_nm} N·m for at most {hold_s} s, taken at step {step}")
        }
        Some(applied_command::Command::Advance(advance)) => {
            format!("the advance `{id}` of {} steps, taken at step {step}", advance.steps)
        }
        _ => format!("the control `{id}` at step {step}"),
    }
}
