//! Commands: checked, deduplicated, applied between steps, and answered.

use std::time::Duration;

use super::Stepper;
use super::advance::STEPS_LIMIT;
use crate::runtime::command::{Action, Command, Request};
use crate::runtime::output::{Answer, Output};
use crate::runtime::pacer::Pace;
use crate::runtime::reply::{Reply, ReplyTo};
use crate::simulation::{AdvanceRequest, Stamp};

impl Stepper {
    /// Checks and applies a command, and sends its reply.
    pub(super) fn handle_command(&mut self, command: Command) {
        if command.request.changes_scene() {
            return self.handle_change(command);
        }
        self.discard_prepared();
        let Command { id, request, reply: reply_to, .. } = command;
        let stamp = self.stamp();
        if let Some(reply) = self.ports.shared.reply_to_retry(&id, &request) {
            return self.send(Output::Answer(Box::new(Answer { reply, reply_to: Some(reply_to), request: None, stamp })));
        }
        let verdict = match &request {
            Request::Torque(pulse) => {
                self.simulation.add_pulse(pulse).map(|when| (when, "")).map_err(|refused| refused.to_string())
            }
            Request::Setpoint(setpoint) => {
                self.simulation.set_torque(setpoint).map(|when| (when, "")).map_err(|refused| refused.to_string())
            }
            Request::Advance(advance) => self.apply_advance(advance).map(|when| (when, "")),
            Request::Control(action) => self.control(action).map(|reason| (self.simulation.now(), reason)),
        };
        let reply = match verdict {
            Ok((effective, reason)) => Reply { reason: reason.to_owned(), ..Reply::accepted(id, effective) },
            Err(reason) => Reply::refused(id, reason),
        };
        if !reply.accepted {
            self.ports.shared.count_rejected();
        } else if !request.is_of_recording() {
            // The output thread decides and remembers commands that start or stop a recording.
            self.ports.shared.remember(&reply, Some(&request));
        }
        if let Some(shadow) = self.shadow.as_mut().filter(|_| reply.accepted) {
            shadow.apply(&request);
        }
        if let (true, Request::Advance(advance)) = (reply.accepted, &request) {
            return self.answer_advance(*advance, reply, reply_to, stamp);
        }
        let resets = reply.accepted && matches!(request, Request::Control(Action::Reset));
        let records = matches!(request, Request::Control(Action::StartRecording { .. }));
        let is_of_recording = request.is_of_recording();
        if matches!(request, Request::Control(Action::StopRecording)) {
            // The recording ends with the state in full.
            self.checkpoint();
        }
        self.send(Output::Answer(Box::new(Answer { reply, reply_to: Some(reply_to), request: Some(request), stamp })));
        if resets || records {
            // The checkpoint follows the command that caused it, so that a recording can be re-simulated in its own order, from
            // its first message on.
            self.checkpoint();
        }
        if resets {
            // The start was observed when the simulation was built, so it can be observed again.
            let _ = self.publish(true.into());
        }
        if resets || is_of_recording {
            // After a reset: the balance of the first steps says little, with so little energy in play. After a recording has
            // started or stopped: clients look for its name in the status, and get their reply after it.
            self.status(self.phase(), None);
        }
    }

    /// Records an advance where it begins; its sender is answered where it ends.
    fn answer_advance(&mut self, advance: AdvanceRequest, reply: Reply, reply_to: ReplyTo, stamp: Stamp) {
        let begun =
            Answer { reply: reply.clone(), reply_to: Some(Box::new(|_| {})), request: Some(Request::Advance(advance)), stamp };
        self.send(Output::Answer(Box::new(begun)));
        self.begin_advance(advance, reply, reply_to);
    }

    /// Applies an action. Returns why it changed nothing, if so, or why it is refused.
    fn control(&mut self, action: &Action) -> Result<&'static str, String> {
        match action {
            Action::Pause if self.run.paused => {
                self.finish_advance("cut short by a pause");
                return Ok(match std::mem::take(&mut self.run.pending_single_steps) {
                    0 => "was paused already",
                    _ => "was paused already; the remaining steps are cancelled",
                });
            }
            Action::Resume if self.stepping.pace == Pace::Lockstep => {
                return Err("the pace is lockstep: steps are taken by advance, or by step".to_owned());
            }
            Action::Resume if !self.run.paused => return Ok("was running already"),
            Action::Step { .. } if !self.run.paused => return Err("steps are counted only when paused: pause first".to_owned()),
            Action::Step { count } if !(1..=STEPS_LIMIT).contains(count) => {
                return Err(format!("count = {count} is not allowed: 1 to {STEPS_LIMIT}"));
            }
            Action::Step { count } => self.run.pending_single_steps += count,
            Action::Pause => {
                self.run.paused = true;
                self.schedule.next_status = Duration::ZERO;
            }
            Action::Resume => {
                self.run.paused = false;
                self.restart(self.session_s());
            }
            Action::Reset => self.reset()?,
            Action::Stop => self.run.stopping = true,
            Action::Set { .. } | Action::Level { .. } => return Err("the scene cannot be changed here".to_owned()),
            Action::StartRecording { .. } | Action::StopRecording => {}
        }
        Ok("")
    }

    /// Goes on without steps that were asked for one by one, with the deadlines anchored anew.
    fn restart(&mut self, session_s: f64) {
        self.run.pending_single_steps = 0;
        self.deadlines.pacer.anchor(self.clock.elapsed(), session_s);
        self.schedule.next_status = Duration::ZERO;
    }

    fn reset(&mut self) -> Result<(), String> {
        // Steps are counted anew after a reset, so dropped samples are reported before it.
        self.report_missed_samples();
        self.report_overruns();
        // The state before it proves the commands whose effect is now never to come.
        self.checkpoint();
        let session_s = self.session_s();
        self.simulation.reset().map_err(|diverged| diverged.to_string())?;
        if let Some(shadow) = &mut self.shadow {
            shadow.reset();
        }
        self.epoch_start_s = session_s;
        self.restart(session_s);
        Ok(())
    }
}
