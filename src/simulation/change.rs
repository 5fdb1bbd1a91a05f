//! A change of the running scene: another simulation goes on where this one stands.

use super::drive::DriveLaw;
use super::engine::Engine;
use super::load::margin_s;
use super::{BuildError, Cause, EpochChanges, Simulation, finite};
use crate::integrate::{StepError, Work};
use crate::mechanics::{CannotTransfer, Present, Transfer};
use crate::scene::{Link, ModelKind, Scene, Solver, System};

/// A running scene could not be changed; it goes on as before.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NotChanged {
    /// The steps of both scenes meet later only, after this many of the present steps.
    #[error(
        "a longer step can only begin at an instant that both steps reach, {} from here: `control NAME step {}` goes there",
        steps(*.0),
        .0
    )]
    Later(u64),
    /// Neither step is a multiple of the other.
    #[error("a step of {new_s} s is neither a multiple nor a part of the present step, {present_s} s")]
    Step {
        /// The present step, s.
        present_s: f64,
        /// The new step, s.
        new_s: f64,
    },
    /// The state does not fit the new model.
    #[error("the state does not fit the changed scene")]
    OtherState,
    /// The state cannot be transferred to the new model.
    #[error(transparent)]
    Transfer(#[from] CannotTransfer),
    /// The changed scene cannot go on from here.
    #[error("the changed scene cannot go on from here: {0}")]
    Cause(#[from] Cause),
}

fn steps(count: u64) -> String {
    if count == 1 { "1 step".to_owned() } else { format!("{count} steps") }
}

/// No way leads from one scene to another.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoRoute {
    /// A model cannot compute its scene.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A state cannot go from one model to the other.
    #[error(transparent)]
    Transfer(#[from] CannotTransfer),
}

impl From<StepError> for NotChanged {
    fn from(error: StepError) -> Self {
        NotChanged::Cause(error.into())
    }
}

/// The way of a state from the model of one scene to that of another.
pub struct Route {
    kind: RouteKind,
}

enum RouteKind {
    /// The same equations: everything is kept.
    Alike,
    /// The same coordinates: they and the velocities are kept.
    Coordinates,
    /// Another model.
    Transfer(Box<Transfer>),
}

impl Route {
    /// The way from `before` to `after`, two scenes of the same geometry.
    ///
    /// # Errors
    /// [`BuildError`] if a model cannot compute its scene; [`CannotTransfer`] if a state cannot go from one to the other.
    pub fn new(before: &Scene, after: &Scene) -> Result<Self, NoRoute> {
        let kind = if same_equations(before, after) {
            RouteKind::Alike
        } else if same_coordinates(before, after) {
            RouteKind::Coordinates
        } else {
            RouteKind::Transfer(Box::new(transfer(before, after)?))
        };
        Ok(Route { kind })
    }

    /// Brings `to` at `t_s`, to go on in steps of `h_s`, to the state of `from`.
    fn take(
        &mut self,
        (from, from_law): (&mut (dyn Engine + 'static), &DriveLaw),
        (to, to_law): (&mut (dyn Engine + 'static), &DriveLaw),
        [t_s, h_s]: [f64; 2],
        room: &mut Vec<f64>,
    ) -> Result<(), NotChanged> {
        match (&mut self.kind, from.dynamics(), to.dynamics()) {
            (RouteKind::Coordinates, Some(old), Some(new)) if old.q.len() == new.q.len() => {
                new.q.copy_from_slice(old.q);
                new.v.copy_from_slice(old.v);
                to.begin(to_law, t_s, h_s)?;
            }
            (RouteKind::Transfer(transfer), Some(old), Some(new)) => {
                let input = from_law.input(t_s);
                let present = Present { input: &input, q: old.q, v: old.v };
                transfer.apply((old.mechanism, &present), (new.mechanism, h_s), new.q, new.v)?;
                let input = to_law.input(t_s);
                let present = Present { input: &input, q: new.q, v: new.v };
                transfer.accelerations(new.mechanism, &present, h_s, new.a)?;
                to.begin_as_given(to_law, t_s);
            }
            _ => {
                room.clear();
                from.save(room);
                if !to.restore(room) {
                    return Err(NotChanged::OtherState);
                }
            }
        }
        Ok(())
    }
}

fn transfer(before: &Scene, after: &Scene) -> Result<Transfer, NoRoute> {
    let (Some(old), Some(new)) = (before.chain(), after.chain()) else { return Err(CannotTransfer::NotAChain.into()) };
    let (mut from, mut to) = (Simulation::new(before)?, Simulation::new(after)?);
    match (from.engine.dynamics(), to.engine.dynamics()) {
        (Some(from), Some(to)) => Ok(Transfer::new(old, from.mechanism, new, to.mechanism)?),
        _ => Err(CannotTransfer::NotAChain.into()),
    }
}

/// Whether the models of two scenes of the same geometry have the same coordinates.
fn same_coordinates(before: &Scene, after: &Scene) -> bool {
    let model = after.solver.model;
    let same_link = |(old, new): (&Link, &Link)| {
        let is_rigid = |link: &Link| link.rigid || link.bar.is_none();
        let both_or_none = is_rigid(old) == is_rigid(new);
        match model {
            ModelKind::Modal => both_or_none && (old.modes, old.axial) == (new.modes, new.axial),
            ModelKind::FiniteElement => both_or_none && old.elements == new.elements,
            ModelKind::Rigid | ModelKind::Incremental | ModelKind::MassSpring => true,
        }
    };
    let links = |scene: &Scene| scene.chain().map(|chain| chain.links.clone()).unwrap_or_default();
    before.solver.model == model && links(before).iter().zip(&links(after)).all(same_link)
}

/// Whether two scenes have the same equations of motion, step and scheme.
fn same_equations(before: &Scene, after: &Scene) -> bool {
    let common = |scene: &Scene| {
        let mut scene = scene.clone();
        (scene.commands, scene.levels) = (before.commands, Vec::new());
        scene.solver.balance_tolerance = before.solver.balance_tolerance;
        if let (System::Chain(chain), Some(first)) = (&mut scene.system, before.chain()) {
            chain.start = first.start;
        }
        scene
    };
    common(after) == common(before)
}

impl Simulation {
    /// Steps from here to the next instant at which a change to a scene with this step may hold; `None` if there is none.
    pub fn steps_to_change(&self, solver: &Solver) -> Option<u64> {
        self.grid.steps_to_common(self.step, solver.step_s)
    }

    /// Whether a torque begins or ends in the next step, or a prescribed acceleration jumps.
    pub fn has_edge_in_next_step(&self) -> bool {
        let next_s = self.grid.time_s(self.step + 1);
        self.edge_within([self.time_s(), next_s]).is_some()
    }

    /// Goes on as `next`, a simulation of the changed scene; `next` becomes this one as it was. Returns the energy that the change
    /// brought in, J.
    ///
    /// # Errors
    /// [`NotChanged`]; this simulation is as it was then, and `next` is to be built anew.
    pub fn change_to(&mut self, next: &mut Simulation, route: &mut Route) -> Result<f64, NotChanged> {
        match self.grid.steps_to_common(self.step, next.grid.step_s) {
            Some(0) => {}
            Some(later) => return Err(NotChanged::Later(later)),
            None => return Err(NotChanged::Step { present_s: self.grid.step_s, new_s: next.grid.step_s }),
        }
        let now_s = self.time_s();
        next.law.go_on_from(&self.law, now_s);
        next.load.go_on_from(&self.load);
        next.law.during(next.load.after(now_s, next.grid.step_s), [now_s, now_s + margin_s(now_s, next.grid.step_s)]);
        let (from, to) = ((&mut *self.engine, &self.law), (&mut *next.engine, &next.law));
        route.take(from, to, [now_s, next.grid.step_s], &mut next.saved)?;
        next.grid = self.grid.with_step(self.step, next.grid.step_s);
        (next.step, next.epoch) = (self.step, self.epoch);
        let energy = next.engine.energy(&next.law, now_s);
        finite(&Work::default(), &energy)?;
        next.ledger = self.ledger.changed(energy).with_least(next.least_j);
        next.error = next
            .engine
            .local_error(&next.law, now_s, next.grid.step_s)
            .map(|_| self.error.unwrap_or_default().without_last_step());
        next.changed = true;
        next.observe().map_err(|diverged| diverged.cause)?;
        next.last = self.last;
        next.passed.go_on_from(&self.passed);
        (next.retried, next.unconverged, next.distrusted) = (self.retried, self.unconverged, self.distrusted);
        let changed_j = next.ledger().changed_j - self.ledger().changed_j;
        std::mem::swap(self, next);
        Ok(changed_j)
    }

    /// Traces of the changes in this epoch.
    pub(super) fn epoch_changes(&self) -> Option<EpochChanges> {
        let (start, changed) = self.ledger.start_and_changed();
        self.changed.then(|| EpochChanges { grid: self.grid, motion: self.law.origin(), start, changed })
    }
}

#[cfg(test)]
mod tests {
    use super::NotChanged;

    #[test]
    fn regress_a_longer_step_that_must_wait_is_refused_with_what_to_do() {
        for (later, place) in [(1, "1 step from here"), (4, "4 steps from here")] {
            let said = NotChanged::Later(later).to_string();
            let way = format!("reach, {place}: `control NAME step {later}` goes there");
            assert!(said.starts_with("a longer step can only begin at ") && said.ends_with(&way), "{said}");
        }
    }
}
