//! The modal model with room for `W` shape functions a link.

use std::f64::consts::PI;

use super::chain::{Chain, ChordAngle, LinkForces};
use super::observe::Observer;
use super::tangent::Tangent;
use crate::mechanics::last_state::LastState;
use crate::mechanics::mechanism::{
    ChainModel, Coordinate, Input, Measure, Mechanism, NoEquilibrium, ROTATIONS, Singular, Weights,
};
use crate::mechanics::observation::{Energy, Observation};
use crate::scene;

/// The model.
#[derive(Debug, Clone)]
pub(super) struct Fitted<const W: usize> {
    pub(super) scene: scene::Chain,
    pub(super) chain: Chain<W>,
    tangent: Tangent<W>,
    observer: Observer<W>,
    pub(super) last: LastState,
    /// The residual there without any moment at the pivot.
    residual: Vec<f64>,
    /// Room for the momenta of a turn.
    turned: Vec<LinkForces<W>>,
}

impl<const W: usize> Fitted<W> {
    /// The model of a chain; `prescribed` when the scene prescribes the motion of the first link's tangent at the pivot.
    pub(super) fn new(chain: &scene::Chain, prescribed: bool) -> Self {
        let (scene, elements) = (chain.clone(), chain.links.iter().map(|link| link.elements));
        let chain = Chain::new(chain, prescribed);
        let tangent = Tangent::new(&chain);
        let observer = Observer::new(&chain, elements);
        let n = chain.degrees_of_freedom;
        let turned = chain.forces.clone();
        Self { scene, chain, tangent, observer, last: LastState::new(n), residual: vec![0.0; n], turned }
    }

    /// Brings chain and residual to a state, unless they are there.
    fn evaluate(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) {
        if self.last.lacks_forces(input, q, v, a) {
            self.chain.residual(input, q, v, a, &mut self.residual);
        }
    }

    /// Brings the chain to a state, without its forces, unless both are there.
    pub(super) fn locate(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) {
        if self.last.lacks_motion(input, q, v, a) {
            self.chain.advance(input, q, v, a);
        }
    }
}

impl<const W: usize> Mechanism for Fitted<W> {
    fn degrees_of_freedom(&self) -> usize {
        self.chain.degrees_of_freedom
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        let mut coordinates = Vec::new();
        for ((link, scene), angle) in self.chain.links.iter().zip(&self.scene.links).zip(&self.chain.angles) {
            let name = scene.name.as_str();
            if matches!(angle, ChordAngle::Coordinate(_)) {
                coordinates.push(Coordinate::turn(format!("{name}_chord_rad")));
            }
            let modes = (1..=link.shapes.modes).map(|i| (format!("{name}_bending_{i}_m"), i));
            let root = (link.bending > link.shapes.modes).then(|| (format!("{name}_root_bending_m"), 1));
            let axial = (1..=link.axial).map(|i| (format!("{name}_stretching_{i}_m"), 1));
            // A sine of that height has slopes of 1.
            let of = |(name, waves): (String, usize)| Coordinate::displacement(name, link.shapes.length_m / (PI * waves as f64));
            coordinates.extend(modes.chain(root).chain(axial).map(of));
        }
        coordinates
    }

    fn start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium> {
        self.set_start(input, q, v)
    }

    fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.evaluate(input, q, v, a);
        r.copy_from_slice(&self.residual);
        self.chain.add_pivot(input, r);
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        self.chain.residual_size(r)
    }

    fn factor(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.evaluate(input, q, v, a);
        self.tangent.assemble(&mut self.chain, a, w);
        self.tangent.factor()
    }

    fn tangent(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        if q.is_empty() {
            return;
        }
        self.evaluate(input, q, v, a);
        let matrix = self.tangent.assemble(&mut self.chain, a, w);
        matrix.iter().enumerate().for_each(|(place, value)| entry(place % q.len(), place / q.len(), *value));
    }

    fn rigid_motion(&mut self, input: &Input, rate_rad_per_s: f64, _q: &[f64], v: &mut [f64], a: &mut [f64]) {
        let rate_rad_per_s = input.motion.map_or(rate_rad_per_s, |[_, rate, _]| rate);
        a.fill(0.0);
        for (v, is_angle) in v.iter_mut().zip(&self.chain.is_angle) {
            *v = if *is_angle { rate_rad_per_s } else { 0.0 };
        }
    }

    fn solve(&mut self, x: &mut [f64]) {
        self.tangent.solve(x);
    }

    /// Counted in instructions: 1.6 with 3 coordinates, 3.2 with 10, since each column is a third of a residual.
    fn factor_over_correction(&self) -> f64 {
        1.0 + 0.2 * self.chain.degrees_of_freedom as f64
    }

    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation) {
        self.evaluate(input, q, v, a);
        self.observer.observe(&self.chain, input, q, out);
    }

    fn energy(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> Energy {
        self.locate(input, q, v, a);
        self.chain.energy(q)
    }

    fn measure(&self, _q: &[f64], dq: &[f64]) -> Option<Measure> {
        let deflection_m = self.observer.deflection_change(&self.chain, dq);
        Some(Measure { angle_rad: self.chain.chord_change(dq), deflection_m, ..Measure::default() })
    }

    fn chords(&self, q: &[f64], v: &[f64]) -> [[f64; 2]; ROTATIONS] {
        let second = match self.chain.angles.get(1) {
            Some(ChordAngle::Coordinate(angle)) => [q[*angle], v[*angle]],
            _ => [0.0; 2],
        };
        [[q, v].map(|of| self.chain.chord_change(of)), second]
    }

    fn turn_part(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], link: usize, part: &mut [f64]) -> bool {
        let Some(&ChordAngle::Coordinate(turned)) = self.chain.angles.get(link) else { return false };
        self.locate(input, q, v, a);
        self.chain.turn_momentum(&mut self.turned, link, part);
        let per_inertia = 1.0 / part[turned];
        part.iter_mut().for_each(|p| *p *= per_inertia);
        per_inertia.is_normal()
    }

    fn power(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 2] {
        if self.chain.power_follows_from_rates() {
            return self.chain.power_of_rates_w(input, v);
        }
        if self.chain.is_prescribed() {
            self.evaluate(input, q, v, a);
        } else {
            self.locate(input, q, v, a);
        }
        self.chain.power_w(input, v)
    }

    fn as_chain(&mut self) -> Option<&mut dyn ChainModel> {
        Some(self)
    }
}
