//! A second model beside the first, on the same commands: what the difference is, and what either costs.

use std::time::{Duration, Instant};

use crate::mechanics::Observation;
use crate::scene::ModelKind;
use crate::simulation::{Diverged, PulseRequest, Simulation};
use crate::wire;

/// The second simulation, and the computing time of both.
pub struct ShadowSimulation {
    model: ModelKind,
    simulation: Simulation,
    main_cost: Duration,
    own_cost: Duration,
    steps: u32,
    /// Why it fell behind, when it did.
    lost: Option<Diverged>,
}

impl ShadowSimulation {
    /// A simulation of the same scene by another model, at its start.
    pub fn new(model: ModelKind, simulation: Simulation) -> Self {
        ShadowSimulation { model, simulation, main_cost: Duration::ZERO, own_cost: Duration::ZERO, steps: 0, lost: None }
    }

    /// Steps after the main simulation, whose step took `main_cost`.
    pub(super) fn follow(&mut self, main_cost: Duration) {
        let begun = Instant::now();
        if self.lost.is_none() {
            self.lost = self.simulation.step().err();
        }
        self.own_cost += begun.elapsed();
        self.main_cost += main_cost;
        self.steps = self.steps.saturating_add(1);
    }

    /// Takes a pulse that the main simulation has taken.
    pub(super) fn add_pulse(&mut self, pulse: &PulseRequest) {
        // Both have the same limits: what the one has taken, the other takes.
        let _ = self.simulation.add_pulse(pulse);
    }

    /// Back to the start.
    pub(super) fn reset(&mut self) {
        self.lost = self.simulation.reset().err();
    }

    /// Why it is no longer there, when it has diverged.
    pub(super) fn lost(&self) -> Option<&Diverged> {
        self.lost.as_ref()
    }

    /// Shadow minus `main`; `None` once it has diverged.
    pub(super) fn difference(&mut self, main: &Observation, stamp: &crate::simulation::Stamp) -> Option<wire::Shadow> {
        if self.lost.is_some() {
            return None;
        }
        if let Err(diverged) = self.simulation.observe() {
            self.lost = Some(diverged);
            return None;
        }
        let own = self.simulation.observation();
        let mean = |cost: Duration| cost.as_secs_f64() / f64::from(self.steps.max(1));
        Some(wire::Shadow {
            stamp: Some(wire::stamp(stamp)),
            model: self.model.as_str().to_owned(),
            angle_rad: own.links.first()?.chord_rad - main.links.first()?.chord_rad,
            end_x_m: end_x_m(own)? - end_x_m(main)?,
            joint_force_n: joint_force_n(own, main),
            driving_torque_nm: own.motion_torque_nm.zip(main.motion_torque_nm).map(|(own, main)| own - main),
            main_step_s: mean(self.main_cost),
            shadow_step_s: mean(self.own_cost),
        })
    }
}

fn end_x_m(seen: &Observation) -> Option<f64> {
    Some(seen.links.last()?.nodes.last()?.position_m[0])
}

fn joint_force_n(own: &Observation, main: &Observation) -> Option<f64> {
    let joints = |seen: &Observation| [seen.pivot_n, seen.crank_pin_n, seen.slider_pin_n];
    let pairs = joints(own).into_iter().zip(joints(main)).filter_map(|(own, main)| own.zip(main));
    pairs.flat_map(|(own, main)| [0, 1].map(|k| (own[k] - main[k]).abs())).reduce(f64::max)
}
