//! Changes of the running scene: swapped in between two steps.

use std::sync::Arc;

use super::Stepper;
use crate::runtime::command::Command;
use crate::runtime::output::{Answer, Output};
use crate::runtime::scene_change::PreparedChange;
use crate::simulation::NotChanged;
use crate::wire::CommandReply;

impl Stepper {
    /// Applies a change of the scene, or lets it wait for a step at which it can hold.
    pub(super) fn handle_change(&mut self, mut command: Command) {
        let stamp = self.stamp();
        if let Some(reply) = self.ports.shared.reply_to_retry(&command.id, &command.request) {
            return self.send(Output::Answer(Box::new(Answer { reply, reply_to: command.reply, request: None, stamp })));
        }
        let Some(mut change) = command.change.take() else { return };
        match change.steps_ahead(&self.simulation) {
            Some(1..) if !self.run.paused => {
                command.change = Some(change);
                self.waiting_change = Some(command);
                return;
            }
            _ => {}
        }
        let Command { id, request, reply: reply_to, .. } = command;
        let effective = self.simulation.now();
        let changed = self.change_scene(&mut change);
        let reply = match &changed {
            Ok(changed_j) => CommandReply {
                id,
                accepted: true,
                effective_step: effective.step,
                effective_sim_time_s: effective.sim_time_s,
                changed_j: Some(*changed_j),
                ..CommandReply::default()
            },
            Err(refused) => CommandReply { id, reason: refused.to_string(), ..CommandReply::default() },
        };
        if reply.accepted {
            self.ports.shared.remember(&reply, Some(&request));
        } else {
            self.ports.shared.count_rejected();
        }
        let in_force = reply.accepted.then(|| Arc::clone(&change.in_force));
        self.send(Output::Scene(in_force, change));
        self.send(Output::Answer(Box::new(Answer { reply, reply_to, request: Some(request), stamp })));
        if changed.is_ok() {
            self.checkpoint();
        }
    }

    /// Lets the simulation and its shadow go on by the changed scene. Returns the energy that the change brought in, J.
    fn change_scene(&mut self, change: &mut PreparedChange) -> Result<f64, NotChanged> {
        let changed_j = change.apply(&mut self.simulation)?;
        if let Some(shadow) = &mut self.shadow {
            shadow.change(change);
        }
        Ok(changed_j)
    }

    /// Applies the change that waits, if its step has come.
    pub(super) fn take_waiting_change(&mut self) {
        let steps_ahead = |command: &Command| command.change.as_ref().and_then(|change| change.steps_ahead(&self.simulation));
        if let Some(command) = self.waiting_change.take_if(|command| !matches!(steps_ahead(command), Some(1..))) {
            self.handle_change(command);
        }
    }
}
