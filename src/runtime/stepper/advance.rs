//! Lock-step: an advance applies a torque, takes its steps, and is answered with the state after them.

use std::sync::Arc;

use super::{Ending, Stepper};
use crate::runtime::command::{Action, Command, Request};
use crate::runtime::output::{Advanced, Output};
use crate::runtime::reply::{Reply, ReplyTo};
use crate::simulation::{AdvanceRequest, Effective};

/// Largest number of steps of one `step` command or advance.
pub(super) const STEPS_LIMIT: u64 = 1_000_000_000;

/// An advance under way.
pub(super) struct Advance {
    request: AdvanceRequest,
    /// Steps still to be taken.
    remaining: u64,
    reply: Reply,
    reply_to: ReplyTo,
}

impl Stepper {
    /// Handles a command, or lets it wait until the advance under way is over, so that a lock-step run does not depend on when
    /// commands arrive. Only a pause and a stop are handled at once.
    pub(super) fn handle_in_turn(&mut self, command: Command) {
        let interrupts = matches!(command.request, Request::Control(Action::Pause | Action::Stop));
        let steps = matches!(command.request, Request::Advance(_)) && self.run.pending_single_steps > 0;
        let waits = self.run.advance.is_some() || !self.run.waiting.is_empty() || steps;
        if waits && !interrupts {
            self.run.waiting.push_back(command);
        } else {
            self.handle_command(command);
        }
    }

    /// The first command that waited for steps that are now taken.
    pub(super) fn next_waiting(&mut self) -> Option<Command> {
        if self.run.pending_single_steps > 0 { None } else { self.run.waiting.pop_front() }
    }

    /// Checks an advance and applies its torque.
    pub(super) fn apply_advance(&mut self, request: &AdvanceRequest) -> Result<Effective, String> {
        let AdvanceRequest { torque_nm, steps } = *request;
        if !self.run.paused {
            return Err("an advance is taken only when paused, or with --pace lockstep: pause first".to_owned());
        }
        if !(1..=STEPS_LIMIT).contains(&steps) {
            return Err(format!("steps = {steps} is not allowed: 1 to {STEPS_LIMIT}"));
        }
        match torque_nm {
            Some(torque_nm) => self.simulation.set_torque_for(torque_nm, steps).map_err(|refused| refused.to_string()),
            None => Ok(self.simulation.now()),
        }
    }

    /// Begins to take the steps of an accepted advance.
    pub(super) fn begin_advance(&mut self, request: AdvanceRequest, reply: Reply, reply_to: ReplyTo) {
        self.simulation.mark_torque();
        self.run.pending_single_steps += request.steps;
        self.run.advance = Some(Advance { request, remaining: request.steps, reply, reply_to });
    }

    /// Counts a step that was taken; after the last one of an advance, sends its answer.
    pub(super) fn count_advance(&mut self) {
        let Some(advance) = &mut self.run.advance else { return };
        advance.remaining -= 1;
        if advance.remaining == 0 {
            self.finish_advance("");
        }
    }

    /// Answers the advance under way, if there is one, with the present state. `cause` is why it ends early, if it does.
    pub(super) fn finish_advance(&mut self, cause: &str) {
        let Some(Advance { request, remaining, mut reply, reply_to }) = self.run.advance.take() else { return };
        if !cause.is_empty() {
            reply.reason = format!("{cause} after {} of {} steps", request.steps - remaining, request.steps);
        }
        let sample = self.ports.pool.recv().ok().and_then(|mut free| {
            let stamp = self.stamp();
            // The pool holds the only reference, so nothing is cloned.
            let sample = Arc::make_mut(&mut free);
            self.simulation.sample(sample, stamp).ok()?;
            sample.driving_torque_nm = self.simulation.mean_torque_since_mark_nm();
            Some(free)
        });
        self.send(Output::Advanced(Box::new(Advanced { sample, reply, reply_to })));
    }

    /// Answers the advance under way when the run ends, and refuses the commands that wait.
    pub(super) fn end_advances(&mut self, ending: &Ending) {
        match ending {
            Ending::Diverged(diverged) => self.finish_advance(&diverged.to_string()),
            Ending::Finished => self.finish_advance("the run reached its end"),
            _ => self.finish_advance("stopped"),
        }
        while let Some(Command { id, reply: reply_to, .. }) = self.run.waiting.pop_front() {
            self.refuse(id, "the run is over".to_owned(), reply_to);
        }
    }
}
