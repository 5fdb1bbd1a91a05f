//! A mechanism under the loads of its scene.

use super::periodic::PeriodicSystem;
use crate::integrate::{Singular, System, Weights};
use crate::mechanics::{self, Mechanism};
use crate::simulation::Loads;

/// A mechanism under the loads of its scene, as the integrators see it. It need not be periodic.
pub(super) struct Loaded<'a> {
    pub(super) mechanism: &'a mut dyn Mechanism,
    pub(super) loads: Loads,
}

fn weights(w: Weights) -> mechanics::Weights {
    mechanics::Weights { acceleration: w.acceleration, velocity: w.velocity, position: w.position }
}

impl System for Loaded<'_> {
    fn degrees_of_freedom(&self) -> usize {
        self.mechanism.degrees_of_freedom()
    }
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.mechanism.residual(&self.loads.input(t_s), q, v, a, r);
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        self.mechanism.residual_size(r)
    }
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.mechanism.factor(&self.loads.input(t_s), q, v, a, weights(w)).map_err(|mechanics::Singular| Singular)
    }
    fn solve(&mut self, x: &mut [f64]) {
        self.mechanism.solve(x);
    }
}

impl PeriodicSystem for Loaded<'_> {
    fn tangent(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        self.mechanism.tangent(&self.loads.input(t_s), q, v, a, weights(w), entry);
    }
}
