//! The shadow: a second model that runs beside the first on the same commands. Its difference and the cost of both are published.

use std::time::{Duration, Instant};

use super::command::Request;
use super::scene_change::PreparedChange;
use crate::integrate::StepError;
use crate::mechanics::Observation;
use crate::scene::ModelKind;
use crate::simulation::{AdvanceRequest, Diverged, Simulation};

/// The state of one model minus that of another at the same instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateDifference {
    /// Chord angle of the first link, rad.
    pub angle_rad: f64,
    /// Position of the chain's end along x, m.
    pub end_x_m: f64,
    /// Largest difference of the joint forces that both models compute, in x or y, N.
    pub joint_force_n: Option<f64>,
    /// Torque that a prescribed motion needs, N·m.
    pub driving_torque_nm: Option<f64>,
}

/// The difference of a second model to the main one, and the cost of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelDifference {
    /// The second model.
    pub model: ModelKind,
    /// Second minus main.
    pub state: StateDifference,
    /// Mean computing time of a step of the main model, s.
    pub main_step_s: f64,
    /// Mean computing time of a step of the second model, s.
    pub shadow_step_s: f64,
}

/// The second simulation, and the computing time of both.
pub struct ShadowSimulation {
    model: ModelKind,
    simulation: Simulation,
    main_cost: Duration,
    own_cost: Duration,
    steps: u32,
    /// Why the shadow stopped, if it diverged.
    lost: Option<Diverged>,
}

impl ShadowSimulation {
    /// Creates a shadow from a simulation of the same scene by another model, at its start.
    pub fn new(model: ModelKind, simulation: Simulation) -> Self {
        ShadowSimulation { model, simulation, main_cost: Duration::ZERO, own_cost: Duration::ZERO, steps: 0, lost: None }
    }

    /// Its model.
    pub fn model(&self) -> ModelKind {
        self.model
    }

    /// Takes the step that the main simulation took in `main_cost`.
    pub(super) fn follow(&mut self, main_cost: Duration) {
        let begun = Instant::now();
        if self.lost.is_none() {
            self.lost = self.simulation.step().err();
        }
        self.own_cost += begun.elapsed();
        self.main_cost += main_cost;
        self.steps = self.steps.saturating_add(1);
    }

    /// Applies the torque of a command that the main simulation accepted.
    pub(super) fn apply(&mut self, request: &Request) {
        // Both simulations have the same limits, so the shadow accepts the torque too.
        let _ = match request {
            Request::Torque(pulse) => self.simulation.add_pulse(pulse),
            Request::Setpoint(setpoint) => self.simulation.set_torque(setpoint),
            Request::Advance(AdvanceRequest { torque_nm: Some(torque_nm), steps }) => {
                self.simulation.set_torque_for(*torque_nm, *steps)
            }
            Request::Advance(_) | Request::Control(_) => return,
        };
    }

    /// Changes the scene as that of the main simulation was changed.
    pub(super) fn change(&mut self, change: &mut PreparedChange) {
        if self.lost.is_none() && change.apply_to_shadow(&mut self.simulation).is_err() {
            let energy_j = self.simulation.ledger().energy.moving_j();
            let (step, sim_time_s) = (self.simulation.step_count() + 1, self.simulation.time_s());
            self.lost = Some(Diverged { step, sim_time_s, energy_j, cause: StepError::NotFinite.into() });
        }
    }

    /// Returns to the start of the scene.
    pub(super) fn reset(&mut self) {
        self.lost = self.simulation.reset().err();
    }

    /// Why the shadow stopped, if it diverged.
    pub(super) fn lost(&self) -> Option<&Diverged> {
        self.lost.as_ref()
    }

    /// Returns shadow minus `main`; `None` after the shadow has diverged.
    pub(super) fn difference(&mut self, main: &Observation) -> Option<ModelDifference> {
        if self.lost.is_some() {
            return None;
        }
        if let Err(diverged) = self.simulation.observe() {
            self.lost = Some(diverged);
            return None;
        }
        let mean = |cost: Duration| cost.as_secs_f64() / f64::from(self.steps.max(1));
        let (main_step_s, shadow_step_s) = (mean(self.main_cost), mean(self.own_cost));
        let state = difference(self.simulation.observation(), main)?;
        Some(ModelDifference { model: self.model, state, main_step_s, shadow_step_s })
    }
}

/// Returns `own` minus `main`; `None` without links.
pub fn difference(own: &Observation, main: &Observation) -> Option<StateDifference> {
    Some(StateDifference {
        angle_rad: own.links.first()?.chord_rad - main.links.first()?.chord_rad,
        end_x_m: end_x_m(own)? - end_x_m(main)?,
        joint_force_n: joint_force_n(own, main),
        driving_torque_nm: own.motion_torque_nm.zip(main.motion_torque_nm).map(|(own, main)| own - main),
    })
}

fn end_x_m(seen: &Observation) -> Option<f64> {
    Some(seen.links.last()?.nodes.last()?.position_m[0])
}

fn joint_force_n(own: &Observation, main: &Observation) -> Option<f64> {
    let joints = |seen: &Observation| [seen.pivot_n, seen.crank_pin_n, seen.slider_pin_n];
    let pairs = joints(own).into_iter().zip(joints(main)).filter_map(|(own, main)| own.zip(main));
    pairs.flat_map(|(own, main)| [0, 1].map(|k| (own[k] - main[k]).abs())).reduce(f64::max)
}
