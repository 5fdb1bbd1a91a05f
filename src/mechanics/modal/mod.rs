//! Floating frames with bending modes.

mod chain;
mod elastic;
mod energy;
mod frame;
mod link;
mod loads;
mod lu;
mod observe;
mod plane;
mod quartic;
mod shapes;
mod start;
mod station;
mod tangent;
#[cfg(test)]
mod tests;

use super::mechanism::{Input, Mechanism, Singular, Weights};
use super::observation::Observation;
use crate::scene::Scene;
use chain::Chain;
use observe::Observer;
use tangent::Tangent;

/// The `modal` model of a chain.
#[derive(Debug, Clone)]
pub struct Modal {
    chain: Chain,
    tangent: Tangent,
    observer: Observer,
    /// The residual of the state below, and that state: Newton asks for residual and tangent of the same one.
    residual: Vec<f64>,
    input: Input,
    state: [Vec<f64>; 3],
}

impl Modal {
    /// The model of a scene.
    pub fn new(scene: &Scene) -> Self {
        let chain = Chain::new(scene);
        let tangent = Tangent::new(&chain);
        let observer = Observer::new(&chain, scene.chain.links.iter().map(|link| link.elements));
        let unknown = vec![f64::NAN; chain.degrees_of_freedom];
        let state = [unknown.clone(), unknown.clone(), unknown.clone()];
        Self { chain, tangent, observer, residual: unknown, input: Input::default(), state }
    }

    /// Brings chain and residual to a state, unless they are there.
    fn evaluate(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) {
        let [last_q, last_v, last_a] = &mut self.state;
        if self.input == *input && last_q == q && last_v == v && last_a == a && !q.is_empty() {
            return;
        }
        last_q.copy_from_slice(q);
        last_v.copy_from_slice(v);
        last_a.copy_from_slice(a);
        self.input = *input;
        self.chain.residual(input, q, v, a, &mut self.residual);
    }
}

impl Mechanism for Modal {
    fn degrees_of_freedom(&self) -> usize {
        self.chain.degrees_of_freedom
    }

    fn start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) {
        start::start(&mut self.chain, &mut self.tangent, input, q, v);
        self.state[0].fill(f64::NAN);
    }

    fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.evaluate(input, q, v, a);
        r.copy_from_slice(&self.residual);
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        self.chain.residual_size(r)
    }

    fn factor(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.evaluate(input, q, v, a);
        self.tangent.assemble(&mut self.chain, a, w);
        self.tangent.factor()
    }

    fn solve(&mut self, x: &mut [f64]) {
        self.tangent.solve(x);
    }

    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation) {
        self.evaluate(input, q, v, a);
        self.observer.observe(&self.chain, input, q, out);
    }

    fn power(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 2] {
        self.evaluate(input, q, v, a);
        self.chain.power_w(input, v)
    }
}
