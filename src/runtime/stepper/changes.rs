//! Changes of the running scene and of its level: swapped in between two steps.

use std::sync::Arc;
use std::time::Duration;

use super::Stepper;
use crate::runtime::command::{Action, Command, QUEUE, Request};
use crate::runtime::governor::Governor;
use crate::runtime::ladder::Ladder;
use crate::runtime::output::{Answer, Output};
use crate::runtime::pacer::{Overrun, Pace};
use crate::runtime::reply::{Reply, ReplyTo};
use crate::simulation::{Checkpoint, Effective, Stamp};

/// Beginning of the cause of a switch that nobody commanded.
pub(crate) const GOVERNED: &str = "a step took ";

impl Stepper {
    /// Lets commands change the scene or its level; `ladder` is that of the simulation.
    pub fn with_ladder(mut self, ladder: Ladder) -> Self {
        if let (Overrun::Degrade, Pace::Factor(factor)) = (self.stepping.overrun, self.stepping.pace) {
            self.levels.governor = Some(Governor::new(&ladder.costs(factor), ladder.present()));
        }
        self.levels.ladder = Some(ladder);
        self
    }

    /// Applies a change of the scene or its level, or lets it wait for a step at which it can hold.
    pub(super) fn handle_change(&mut self, command: Command) {
        let Some(command) = self.answer_retry(command) else { return };
        match self.steps_to_change(&command) {
            Some(1..) if !self.stands_still() => self.levels.waiting.push_back(command),
            _ if !self.levels.waiting.is_empty() => self.levels.waiting.push_back(command),
            _ => self.apply_change(command),
        }
    }

    /// Answers a command that was carried out before, as then; any other is handed back.
    fn answer_retry(&mut self, command: Command) -> Option<Command> {
        let Some(reply) = self.ports.shared.reply_to_retry(&command.id, &command.request) else { return Some(command) };
        let answer = Answer { reply, reply_to: Some(command.reply), request: None, stamp: self.stamp() };
        self.send(Output::Answer(Box::new(answer)));
        None
    }

    /// Steps before the change can hold; `None` if it never can.
    fn steps_to_change(&self, command: &Command) -> Option<u64> {
        if self.spare_is_busy() && !self.run.paused && self.needs_given_up(command) {
            return Some(1);
        }
        let ladder = self.levels.ladder.as_ref()?;
        match (&command.request, &command.change) {
            (_, Some(change)) => change.steps_ahead(&self.simulation, ladder.present()),
            (Request::Control(Action::Level { name }), None) => ladder.steps_ahead(&self.simulation, ladder.named(name).ok()?),
            _ => None,
        }
    }

    /// Whether a command needs the level whose step was given up: a change of the scene needs all levels.
    fn needs_given_up(&self, command: &Command) -> bool {
        let to = match (&command.request, &command.change, &self.levels.ladder) {
            (Request::Control(Action::Level { name }), None, Some(ladder)) => ladder.named(name).ok(),
            _ => return true,
        };
        to.is_none_or(|to| self.is_given_up(to))
    }

    /// Applies the changes that wait, as far as their step has come. A run that stands still refuses them: it comes to no other step.
    pub(super) fn take_waiting_changes(&mut self) {
        while let Some(command) = self.levels.waiting.pop_front() {
            // One before it may have been the same.
            let Some(command) = self.answer_retry(command) else { continue };
            if !self.stands_still() && matches!(self.steps_to_change(&command), Some(1..)) {
                return self.levels.waiting.push_front(command);
            }
            self.apply_change(command);
        }
    }

    /// Whether the run is paused and has no single step to take.
    fn stands_still(&self) -> bool {
        self.run.paused && self.run.pending_single_steps == 0
    }

    /// Refuses the changes and commands that wait when the run ends.
    pub(super) fn refuse_waiting(&mut self) {
        // A queue that is filled as fast as it is emptied has an end, too.
        for _ in 0..QUEUE + self.levels.waiting.len() {
            let waiting = self.levels.waiting.pop_front().or_else(|| self.ports.commands.try_recv().ok());
            let Some(Command { id, reply: reply_to, .. }) = waiting else { return };
            self.refuse(id, "the run is over".to_owned(), reply_to);
        }
    }

    /// Refuses a command.
    pub(super) fn refuse(&mut self, id: String, reason: String, reply_to: ReplyTo) {
        self.ports.shared.count_rejected();
        let (reply, stamp) = (Reply::refused(id, reason), self.stamp());
        self.send(Output::Answer(Box::new(Answer { reply, reply_to: Some(reply_to), request: None, stamp })));
    }

    fn apply_change(&mut self, command: Command) {
        self.discard_prepared();
        if self.needs_given_up(&command) {
            self.await_given_up();
        }
        let Command { id, request, reply: reply_to, mut change } = command;
        let effective = self.simulation.now();
        let changed = match (&request, &mut change, &mut self.levels.ladder) {
            (_, Some(change), Some(ladder)) => {
                let changed = change.apply(&mut self.simulation, ladder).map_err(|refused| refused.to_string());
                if let (Ok(_), Some(shadow)) = (&changed, &mut self.shadow) {
                    shadow.change(change);
                }
                changed
            }
            (Request::Control(Action::Level { name }), None, Some(ladder)) => {
                ladder.named(name).and_then(|to| ladder.switch(&mut self.simulation, to).map_err(|refused| refused.to_string()))
            }
            _ => Err("the scene cannot be changed here".to_owned()),
        };
        let rest = change.map(Output::ChangeLeftOver);
        match changed {
            Ok(changed_j) => {
                self.levels.wanted = None;
                self.tell_governor(&request);
                let reply = changed_reply(id, String::new(), effective, changed_j);
                self.ports.shared.remember(&reply, Some(&request));
                self.tell_change(reply, Some(reply_to), request);
            }
            Err(reason) => self.refuse(id, reason, reply_to),
        }
        rest.into_iter().for_each(|rest| self.send(rest));
    }

    /// Lets the governor follow a command.
    fn tell_governor(&mut self, request: &Request) {
        let (Some(governor), Some(ladder)) = (&mut self.levels.governor, &self.levels.ladder) else { return };
        match (request, self.stepping.pace) {
            (Request::Control(Action::Level { .. }), _) => governor.commanded(ladder.present()),
            (_, Pace::Factor(factor)) => *governor = governor.with_costs(&ladder.costs(factor)),
            _ => {}
        }
    }

    /// Goes to the level that the governor asks for after a step of this cost; not across the edge of a pulse, nor before the steps of
    /// both levels meet.
    pub(super) fn govern(&mut self, cost: Duration) {
        self.fetch_given_up();
        let (Some(governor), Some(ladder)) = (&mut self.levels.governor, &mut self.levels.ladder) else { return };
        if self.run.paused {
            return;
        }
        if let Some(to) = governor.after_step(self.clock.elapsed(), cost) {
            self.levels.wanted = Some((to, cost));
        }
        let Some((to, cost)) = self.levels.wanted else { return };
        let given_up = self.levels.spare.as_ref().is_some_and(|spare| spare.has_given_up(to));
        if given_up || ladder.steps_ahead(&self.simulation, to) != Some(0) || self.simulation.has_edge_in_next_step() {
            return;
        }
        self.levels.wanted = None;
        let effective = self.simulation.now();
        match ladder.switch(&mut self.simulation, to) {
            Ok(changed_j) => {
                governor.went_to(to);
                let name = ladder.name(to).to_owned();
                let reply = changed_reply(String::new(), format!("{GOVERNED}{cost:.2?}"), effective, changed_j);
                self.tell_change(reply, None, Request::Control(Action::Level { name }));
            }
            Err(refused) => tracing::warn!("stays at its level: {refused}"),
        }
    }

    /// Sends the scene in force, the reply, and the state from which the changed scene goes on.
    fn tell_change(&mut self, reply: Reply, reply_to: Option<ReplyTo>, request: Request) {
        self.tell_change_at((self.stamp(), self.simulation.checkpoint()), reply, reply_to, request);
    }

    /// Sends the same for a change that was made in this state.
    pub(super) fn tell_change_at(
        &mut self,
        (stamp, state): (Stamp, Checkpoint),
        reply: Reply,
        reply_to: Option<ReplyTo>,
        request: Request,
    ) {
        if let Some(in_force) = self.levels.ladder.as_ref().map(|ladder| Arc::clone(ladder.in_force())) {
            self.send(Output::Scene(in_force));
        }
        self.send(Output::Answer(Box::new(Answer { reply, reply_to, request: Some(request), stamp })));
        self.send_checkpoint(state, stamp);
    }
}

/// The reply to an accepted change.
pub(super) fn changed_reply(id: String, reason: String, effective: Effective, changed_j: f64) -> Reply {
    Reply { reason, changed_j: Some(changed_j), ..Reply::accepted(id, effective) }
}
