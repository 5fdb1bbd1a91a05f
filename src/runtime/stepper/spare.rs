//! The spare: the next cheaper level takes every step beside the level in force, so that a step that takes too long can be given up.
//!
//! The spare begins each step where the recorded change to its level would let it begin, and goes on from there if the step of the
//! level in force is given up. The recording then holds that change, and the step at the cheaper level, as if the change had been made
//! in time.

use std::time::{Duration, Instant};

use super::Stepper;
use super::changes::{GOVERNED, changed_reply};
use super::step_cost::StepCost;
use crate::runtime::command::{Action, Request};
use crate::runtime::slowdown::Slowdown;
use crate::runtime::step_worker::{StepWorker, TakeStep, TakenStep};
use crate::simulation::{Checkpoint, Diverged, Effective, Simulation, Stamp};

/// The thread that computes the steps of the level in force, and the state of the spare.
pub(super) struct Spare {
    worker: StepWorker,
    /// The spare at the beginning of the next step, if that is known already.
    prepared: Option<Prepared>,
    /// State in which the spare began its last step. Its memory is used again.
    began: Option<Checkpoint>,
    /// Level of the step that was given up, until the worker is done with it.
    given_up: Option<usize>,
}

/// A simulation that stands where the run would go on at the next cheaper level.
struct Prepared {
    simulation: Box<Simulation>,
    /// Energy that the change would bring in, J.
    changed_j: f64,
}

/// A step that is taken at two levels.
struct Trial {
    /// When it is known that the step of the level in force takes too long.
    give_up: Instant,
    effective: Effective,
    stamp: Stamp,
    changed_j: f64,
}

impl Spare {
    /// Starts the thread.
    pub(super) fn start(take: TakeStep) -> std::io::Result<Self> {
        Ok(Spare { worker: StepWorker::start(take)?, prepared: None, began: None, given_up: None })
    }

    /// Whether the worker still computes a step that was given up.
    fn is_busy(&self) -> bool {
        self.given_up.is_some() && !self.worker.is_done()
    }

    /// Whether a step of this level was given up, and its simulation has not come back.
    pub(super) fn has_given_up(&self, level: usize) -> bool {
        self.given_up == Some(level)
    }
}

/// Takes a step as the stepping thread does, prolonged by the same loads.
pub(super) fn prolonged_by(mut slowdown: Option<Slowdown>) -> TakeStep {
    Box::new(move |simulation, clock| {
        let begun = Instant::now();
        let taken = simulation.step();
        if let Some(slowdown) = &mut slowdown {
            slowdown.prolong(clock.elapsed(), begun);
        }
        taken
    })
}

impl Stepper {
    /// Starts the spare, if the options ask for one. The thread has the scheduling of this one.
    pub(super) fn start_spare(&mut self) {
        if !self.stepping.spare || self.levels.governor.is_none() {
            return;
        }
        match Spare::start(prolonged_by(self.stepping.slowdown)) {
            Ok(spare) => self.levels.spare = Some(spare),
            Err(error) => tracing::warn!("runs without a spare: {error}"),
        }
    }

    /// Whether the step that was given up is still being computed, so that its level cannot be returned to.
    pub(super) fn spare_is_busy(&self) -> bool {
        self.levels.spare.as_ref().is_some_and(Spare::is_busy)
    }

    /// Whether the worker holds this level for a step that was given up.
    pub(super) fn is_given_up(&self, level: usize) -> bool {
        self.levels.spare.as_ref().is_some_and(|spare| spare.has_given_up(level))
    }

    /// Carries the present state over to the spare while there is time: between two steps.
    pub(super) fn prepare_spare_ahead(&mut self) {
        if self.levels.spare.is_some() {
            let begun = self.clock.elapsed();
            self.prepare_spare();
            self.deadlines.timings.solving += self.clock.elapsed().saturating_sub(begun);
        }
    }

    /// Carries the present state over to the spare, if that is not done, and the next step can be taken at both levels.
    fn prepare_spare(&mut self) {
        if self.run.paused || !self.fetch_given_up() || self.simulation.has_edge_in_next_step() {
            return;
        }
        let (Some(ladder), Some(spare)) = (&mut self.levels.ladder, &mut self.levels.spare) else { return };
        let meets = |level| ladder.steps_ahead(&self.simulation, level) == Some(0);
        if spare.prepared.is_some() || !ladder.next_cheaper().is_some_and(meets) {
            return;
        }
        let Some((in_force, changed_j)) = ladder.try_cheaper(&mut self.simulation) else { return };
        let (state, pulses) = spare.began.take().map(|began| (began.state, began.pulses)).unwrap_or_default();
        spare.began = Some(self.simulation.checkpoint_in(state, pulses));
        let mut simulation = in_force;
        std::mem::swap(&mut self.simulation, &mut simulation);
        spare.prepared = Some(Prepared { simulation, changed_j });
    }

    /// Gives the spare back to the levels: the next step begins elsewhere, or is none.
    pub(super) fn discard_prepared(&mut self) {
        let (Some(ladder), Some(spare)) = (&mut self.levels.ladder, &mut self.levels.spare) else { return };
        if let Some((level, prepared)) = ladder.next_cheaper().zip(spare.prepared.take()) {
            ladder.put_back(level, prepared.simulation);
        }
    }

    /// Gives a step that was given up back to its level, if it is done. Returns whether the worker is free.
    pub(super) fn fetch_given_up(&mut self) -> bool {
        let Some(spare) = &mut self.levels.spare else { return false };
        let Some(level) = spare.given_up else { return true };
        let Some(TakenStep { simulation, cost, .. }) = spare.worker.taken() else { return false };
        spare.given_up = None;
        if let (Some(ladder), Some(governor)) = (&mut self.levels.ladder, &mut self.levels.governor) {
            ladder.put_back(level, simulation);
            let back = governor.after_given_up(self.clock.elapsed(), level, cost);
            // A wish that waits is of a later step.
            self.levels.wanted = self.levels.wanted.or(back.map(|level| (level, cost)));
        }
        true
    }

    /// Waits for the end of a step that was given up.
    pub(super) fn await_given_up(&mut self) {
        if let (Some(Spare { worker, given_up, .. }), Some(ladder)) = (&mut self.levels.spare, &mut self.levels.ladder)
            && let Some(level) = given_up.take()
            && let Some(TakenStep { simulation, .. }) = worker.wait(None)
        {
            ladder.put_back(level, simulation);
        }
    }

    /// Takes a step at the level in force and at the next cheaper one, and goes on from the better one that is done in time. Returns
    /// `None`, and takes no step, if the next step is to be taken at one level only.
    pub(super) fn step_beside_spare(&mut self, begun: Instant) -> Option<(Result<(), Diverged>, StepCost)> {
        self.levels.spare.as_ref()?;
        self.prepare_spare();
        let trial = Trial {
            give_up: begun + self.levels.governor.as_ref()?.costly(),
            effective: self.simulation.now(),
            stamp: self.stamp(),
            changed_j: self.begin_trial()?,
        };
        let own = Instant::now();
        let by_spare = self.simulation.step();
        self.prolong(own);
        let own = own.elapsed();
        // A spare that diverged is no way out.
        let until = by_spare.is_ok().then_some(trial.give_up);
        let (taken, own) = match self.await_level_in_force(until) {
            Some(step) => {
                self.end_trial(step.simulation);
                (step.taken, step.cost)
            }
            None => {
                self.go_on_from_spare(&trial);
                (by_spare, own)
            }
        };
        Some((taken, StepCost { wall: begun.elapsed(), own }))
    }

    /// Waits for the step of the level in force. The wait is time of the solver as long as the worker has its processor.
    fn await_level_in_force(&mut self, until: Option<Instant>) -> Option<TakenStep> {
        let begun = Instant::now();
        let step = self.levels.spare.as_mut()?.worker.wait(until);
        let most = match (&step, until) {
            (Some(step), _) => step.cost,
            (None, until) => until.map_or(Duration::MAX, |until| until.saturating_duration_since(begun)),
        };
        self.deadlines.timings.elsewhere += begun.elapsed().min(most);
        step
    }

    /// Hands the level in force over to the worker, and goes on at the next cheaper level. Returns the energy that the change would
    /// bring in, J.
    fn begin_trial(&mut self) -> Option<f64> {
        let spare = self.levels.spare.as_mut()?;
        let Prepared { mut simulation, changed_j } = spare.prepared.take()?;
        std::mem::swap(&mut self.simulation, &mut simulation);
        spare.worker.hand_over(simulation, self.clock);
        Some(changed_j)
    }

    /// Goes on at the level in force, whose step was done in time.
    fn end_trial(&mut self, in_force: Box<Simulation>) {
        if let Some(ladder) = &mut self.levels.ladder {
            ladder.keep_level(&mut self.simulation, in_force);
        }
    }

    /// Gives up the step of the level in force, and reports the change to the cheaper level at the step's beginning.
    fn go_on_from_spare(&mut self, trial: &Trial) {
        let levels = &mut self.levels;
        let (Some(ladder), Some(governor), Some(spare)) = (&mut levels.ladder, &mut levels.governor, &mut levels.spare) else {
            return;
        };
        let limit = governor.costly();
        spare.given_up = Some(ladder.present());
        ladder.keep_cheaper();
        governor.went_to(ladder.present());
        levels.wanted = None;
        let name = ladder.name(ladder.present()).to_owned();
        let Some(began) = spare.began.clone() else { return };
        let reply = changed_reply(String::new(), format!("{GOVERNED}more than {limit:.2?}"), trial.effective, trial.changed_j);
        let request = Request::Control(Action::Level { name });
        self.tell_change_at((trial.stamp, began), reply, None, request);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail")]
mod tests;
