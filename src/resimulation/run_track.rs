//! Follows the run through a recording: what is paused stands still, what has ended goes no further, and what is counted adds up.

use super::event::{changes, is_report, new_level, resets};
use super::resimulator::EpochStep;
use crate::runtime::GOVERNED;
use crate::wire::{Advance, AppliedCommand, CommandReply, Message, Status, applied_command, control::Action, status::State};

/// The state of the run, as the commands so far imply it.
pub(super) struct RunTrack {
    /// Whether it is paused; `None` until a status of a recording that begins later than its run says so.
    paused: Option<bool>,
    /// Last step that may be reached without a further command.
    limit: Option<EpochStep>,
    /// Commands accepted so far; `None` until known.
    accepted: Option<u64>,
    messages: u64,
    ended: bool,
    /// The last checkpoint, if no command or state has come since.
    last_checkpoint: Option<EpochStep>,
    /// Whether the last status says that the run ended, but no checkpoint holds its last state.
    end_without_checkpoint: bool,
}

impl RunTrack {
    /// `whole`: the recording begins with the run. `lockstep`: the run begins paused.
    pub(super) fn new(whole: bool, lockstep: bool) -> Self {
        let (paused, accepted) = (whole.then_some(lockstep), whole.then_some(0));
        RunTrack {
            paused,
            limit: None,
            accepted,
            messages: 0,
            ended: false,
            last_checkpoint: None,
            end_without_checkpoint: false,
        }
    }

    /// Whether a status said that the run ended.
    pub(super) fn has_ended(&self) -> bool {
        self.ended
    }

    /// Whether no checkpoint holds the last state of a run that ended.
    pub(super) fn ends_without_checkpoint(&self) -> bool {
        self.end_without_checkpoint
    }

    /// Forgets what lost commands may have changed.
    pub(super) fn lost(&mut self) {
        (self.paused, self.limit, self.accepted) = (None, None, None);
    }

    /// Adds a message; returns the contradiction, if there is one.
    pub(super) fn take(&mut self, event: &Message) -> Option<String> {
        let Some(stamp) = event.stamp() else { return Some("the message has no stamp".to_owned()) };
        let at = (stamp.epoch, stamp.step);
        self.messages += 1;
        if self.messages == 1 && self.paused == Some(true) {
            self.limit = Some(at);
        }
        if is_report(event) {
            return None;
        }
        if self.ended {
            return Some("the run had ended".to_owned());
        }
        if self.limit.is_some_and(|limit| at > limit) && !matches!(event, Message::Commands(command) if resets(command)) {
            let what = "the mechanism moved on, though it was paused or stopped";
            self.limit = None;
            return Some(what.to_owned());
        }
        match event {
            Message::Checkpoint(_) => {
                self.last_checkpoint = Some(at);
                None
            }
            Message::Status(status) => {
                let what = self.status(status);
                self.end_without_checkpoint = self.ended && self.last_checkpoint != Some(at);
                what
            }
            Message::Commands(command) => {
                self.last_checkpoint = None;
                self.command(command, at)
            }
            Message::Angles(_) | Message::Displacements(_) | Message::Loads(_) | Message::Energies(_) => {
                self.last_checkpoint = None;
                None
            }
            _ => None,
        }
    }

    fn status(&mut self, status: &Status) -> Option<String> {
        let state = status.state();
        self.ended = matches!(state, State::Finished | State::Diverged);
        let accepted = *self.accepted.get_or_insert(status.commands_accepted);
        if status.commands_accepted != accepted {
            let stated = status.commands_accepted;
            return Some(format!("the status counts {stated} accepted commands, where {accepted} are known"));
        }
        let paused = match state {
            State::Running => false,
            State::Paused => true,
            State::Finished | State::Diverged => return None,
            other => return Some(format!("a simulation is never {}", other.as_str_name())),
        };
        let known = *self.paused.get_or_insert(paused);
        (known != paused).then(|| format!("the state is {}, where the commands imply another", state.as_str_name()))
    }

    fn command(&mut self, command: &AppliedCommand, at: EpochStep) -> Option<String> {
        self.accepted = self.accepted.map(|accepted| accepted + 1);
        let reply = command.reply.clone().unwrap_or_default();
        if !reply.accepted {
            return Some("a refused command is recorded as applied".to_owned());
        }
        let (changes, level) = (changes(command).is_some(), new_level(command).is_some());
        if changes == command.scene.is_empty() || (changes || level) != reply.changed_j.is_some() {
            return Some("a change, and no other command, states its energy, and the scene if it changes that".to_owned());
        }
        let (id, action) = match &command.command {
            Some(applied_command::Command::Torque(pulse)) => (&pulse.id, None),
            Some(applied_command::Command::Setpoint(setpoint)) => (&setpoint.id, None),
            Some(applied_command::Command::Advance(advance)) => (&advance.id, None),
            Some(applied_command::Command::Control(control)) => (&control.id, control.action.as_ref()),
            None => return Some("the command is empty".to_owned()),
        };
        if *id != reply.id {
            return Some(format!("the command `{id}` has the reply to `{}`", reply.id));
        }
        if let Some(applied_command::Command::Advance(advance)) = &command.command {
            return self.advance(advance, &reply, at, command.stamp.unwrap_or_default().sim_time_s);
        }
        let Some(action) = action else {
            return (!reply.reason.is_empty()).then(|| format!("the reply to a torque says {}", reply.reason));
        };
        let first = self.messages == 1;
        if let Action::StartRecording(_) = action {
            // This count, too, was known before the recording began.
            (self.paused, self.limit, self.accepted) = (None, None, None);
            return (!first).then(|| "a recording begins within another".to_owned());
        }
        let reason = self.control(action, at);
        let stamp = command.stamp.unwrap_or_default();
        let (step, time_s) = if resets(command) { (1, 0.0) } else { (at.1 + 1, stamp.sim_time_s) };
        if reply.effective_step != step || reply.effective_sim_time_s.to_bits() != time_s.to_bits() {
            return Some(format!("the reply states step {}, not {step}, or another time", reply.effective_step));
        }
        match reason {
            // A switch that nobody commanded has its cause.
            Some(_) if matches!(action, Action::Level(_)) && reply.reason.starts_with(GOVERNED) => None,
            Some(expected) if expected != reply.reason => {
                Some(format!("the reply says `{}`, where `{expected}` was due", reply.reason))
            }
            _ => None,
        }
    }

    /// An advance is taken only while paused; it lets the mechanism go on by its steps.
    fn advance(&mut self, advance: &Advance, reply: &CommandReply, at: EpochStep, time_s: f64) -> Option<String> {
        self.limit = self.limit.map(|(epoch, step)| (epoch, step.saturating_add(advance.steps)));
        if self.paused == Some(false) || advance.steps == 0 {
            return Some("an advance of no steps, or though the run was not paused".to_owned());
        }
        let fits = reply.effective_step == at.1 + 1 && reply.effective_sim_time_s.to_bits() == time_s.to_bits();
        (!fits || !reply.reason.is_empty()).then(|| "the reply to an advance states another step or time".to_owned())
    }

    /// Applies a control; returns the reply's reason, as far as it is known.
    fn control(&mut self, action: &Action, at: EpochStep) -> Option<&'static str> {
        let paused = self.paused;
        match action {
            Action::Pause(_) => {
                let limit = self.limit.replace(at);
                self.paused = Some(true);
                match (paused?, limit) {
                    (false, _) => Some(""),
                    (true, Some(limit)) if limit > at => Some("was paused already; the remaining steps are cancelled"),
                    (true, Some(_)) => Some("was paused already"),
                    (true, None) => None,
                }
            }
            Action::Resume(_) => {
                (self.paused, self.limit) = (Some(false), None);
                Some(if paused? { "" } else { "was running already" })
            }
            Action::Step(steps) => {
                self.limit = self.limit.map(|(epoch, step)| (epoch, step.saturating_add(steps.count)));
                Some("")
            }
            Action::Reset(_) => {
                self.limit = (paused == Some(true)).then_some((at.0 + 1, 0)).filter(|_| self.limit.is_some());
                Some("")
            }
            Action::Set(_) => Some(""),
            Action::Level(_) => Some(""),
            Action::Stop(_) => {
                self.limit = Some(at);
                Some("")
            }
            Action::StartRecording(_) | Action::StopRecording(_) => None,
        }
    }
}
