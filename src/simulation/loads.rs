//! The loads of a scene without its model.

use super::drive::DriveLaw;
use super::load::Load;
use crate::mechanics::Input;
use crate::scene::Scene;

/// Torque and prescribed motion of a scene, step by step, as the fourth-order schemes see them.
pub struct Loads {
    law: DriveLaw,
    load: Load,
}

impl Loads {
    /// The loads at t = 0.
    pub fn new(scene: &Scene) -> Self {
        let mut law = DriveLaw::new(&scene.drive, &scene.chain().map(|chain| chain.start).unwrap_or_default());
        let mut load = Load::new(scene);
        load.reset();
        (load.uses_torque_slope, load.cuts_steps) = (true, true);
        law.begin(load.before(0.0, scene.solver.step_s));
        Loads { law, load }
    }

    /// Sets the loads of a step. Returns whether they jump at the step's beginning.
    pub fn during(&mut self, from_s: f64, to_s: f64) -> bool {
        let before = self.input(from_s);
        self.law.during(self.load.during(from_s, to_s, to_s - from_s), [from_s, to_s]);
        self.input(from_s) != before
    }

    /// The first time between the two at which a torque begins or ends, or a prescribed acceleration jumps, s.
    pub fn edge_within(&self, from_s: f64, to_s: f64) -> Option<f64> {
        let edges = [self.load.pulses.edge_within(from_s, to_s), self.law.edge_within(from_s, to_s)];
        edges.into_iter().flatten().min_by(f64::total_cmp)
    }

    /// Largest rate of a prescribed motion, rad/s; 0 under a torque.
    pub fn largest_rate_rad_per_s(&self) -> f64 {
        self.law.largest_rate_rad_per_s()
    }

    /// Torque and prescribed motion at an instant of the step.
    pub fn input(&self, t_s: f64) -> Input {
        self.law.input(t_s)
    }
}
