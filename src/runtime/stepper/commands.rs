//! Commands: checked, deduplicated, applied between steps, and answered.

use std::time::Duration;

use super::Stepper;
use crate::runtime::command::{Command, Request};
use crate::runtime::output::{Output, RecordingRequest};
use crate::runtime::rates::DueTopics;
use crate::simulation::{Effective, Stamp};
use crate::wire::{self, AppliedCommand, CommandReply, applied_command, control::Action};

/// Largest count of one `step` command.
const STEPS_LIMIT: u64 = 1_000_000_000;

impl Stepper {
    /// Checks and applies a command, and sends its reply.
    pub(super) fn handle_command(&mut self, command: Command) {
        let Command { id, request, reply } = command;
        let stamp = self.stamp();
        if let Some(reply_again) = self.ports.shared.reply_to_retry(&id) {
            return self.send(Output::Answer(reply_again, reply, None, stamp));
        }
        let verdict = match &request {
            Request::Torque(pulse) => {
                self.simulation.add_pulse(pulse).map(|when| (when, "")).map_err(|refused| refused.to_string())
            }
            Request::Control(action) => self.control(action),
        };
        // The output thread decides, counts and remembers commands that start or stop a recording.
        let decides_here = !matches!(&request, Request::Control(Action::StartRecording(_) | Action::StopRecording(_)));
        let (answer, recorded) = match verdict {
            Ok((Effective { step, sim_time_s }, reason)) => {
                if let (Request::Torque(pulse), Some(shadow)) = (&request, &mut self.shadow) {
                    shadow.add_pulse(pulse);
                }
                let answer = CommandReply {
                    id,
                    accepted: true,
                    reason: reason.to_owned(),
                    effective_step: step,
                    effective_sim_time_s: sim_time_s,
                };
                if decides_here {
                    self.ports.shared.count_accepted(&answer);
                }
                let recorded = applied(&answer, &request, &stamp);
                (answer, Some(Box::new(recorded)))
            }
            Err(reason) => {
                self.ports.shared.count_rejected();
                (CommandReply { id, accepted: false, reason, ..CommandReply::default() }, None)
            }
        };
        let begins_anew = answer.accepted && matches!(&request, Request::Control(Action::Reset(_)));
        match request {
            Request::Control(action @ (Action::StartRecording(_) | Action::StopRecording(_))) => {
                let begins = matches!(action, Action::StartRecording(_));
                self.send(Output::Recording(RecordingRequest { action, answer, reply, stamp }));
                if begins {
                    // With a checkpoint, the recording can be re-simulated from its first message on.
                    self.checkpoint();
                }
            }
            _ => self.send(Output::Answer(answer, reply, recorded, stamp)),
        }
        if begins_anew {
            // The checkpoint follows the command that caused it, so that a recording can be re-simulated in its own order.
            self.checkpoint();
            // The start was observed when the simulation was built, so it can be observed again.
            let _ = self.publish(DueTopics::ALL);
        }
    }

    fn control(&mut self, action: &Action) -> Result<(Effective, &'static str), String> {
        let reason = match action {
            Action::Pause(_) if self.run.paused => "was paused already",
            Action::Pause(_) => self.pause(),
            Action::Resume(_) if !self.run.paused => "was running already",
            Action::Resume(_) => self.resume(),
            Action::Step(_) if !self.run.paused => return Err("steps are counted only when paused: pause first".to_owned()),
            Action::Step(wire::Steps { count }) if !(1..=STEPS_LIMIT).contains(count) => {
                return Err(format!("count = {count} is not allowed: 1 to {STEPS_LIMIT}"));
            }
            Action::Step(wire::Steps { count }) => {
                self.run.pending_single_steps += count;
                ""
            }
            Action::Reset(_) => self.reset()?,
            Action::Stop(_) => {
                self.run.stopping = true;
                ""
            }
            Action::StartRecording(_) | Action::StopRecording(_) => "",
        };
        Ok((self.simulation.now(), reason))
    }

    fn pause(&mut self) -> &'static str {
        self.run.paused = true;
        self.schedule.next_status = Duration::ZERO;
        ""
    }

    fn resume(&mut self) -> &'static str {
        (self.run.paused, self.run.pending_single_steps) = (false, 0);
        self.deadlines.pacer.anchor(self.clock.elapsed(), self.session_s());
        self.schedule.next_status = Duration::ZERO;
        ""
    }

    fn reset(&mut self) -> Result<&'static str, String> {
        // Steps are counted anew after a reset, so dropped samples are reported before it.
        self.report_missed_samples();
        self.report_overruns();
        let session_s = self.session_s();
        self.simulation.reset().map_err(|diverged| diverged.to_string())?;
        if let Some(shadow) = &mut self.shadow {
            shadow.reset();
        }
        self.epoch_start_s = session_s;
        self.run.pending_single_steps = 0;
        self.deadlines.pacer.anchor(self.clock.elapsed(), session_s);
        self.schedule.next_status = Duration::ZERO;
        Ok("")
    }
}

/// The message that records a command.
fn applied(answer: &CommandReply, request: &Request, stamp: &Stamp) -> AppliedCommand {
    let command = match request {
        Request::Torque(pulse) => applied_command::Command::Torque(wire::pulse_message(&answer.id, pulse)),
        Request::Control(action) => {
            applied_command::Command::Control(wire::Control { id: answer.id.clone(), action: Some(action.clone()) })
        }
    };
    AppliedCommand { stamp: Some(wire::stamp(stamp)), reply: Some(answer.clone()), command: Some(command) }
}
