//! The chain as a line in motion: see [`ChainModel`].

use std::f64::consts::PI;

use super::chain::{Chain, ChordAngle, LinkForces};
use super::fitted::Fitted;
use super::link::Link;
use super::plane::{Vector, add, add_scaled, quarter, scale};
use crate::mechanics::chain_line::{LinkShape, Place, PlacePoint};
use crate::mechanics::mechanism::{ChainModel, Input};

/// Rounds of the projection on the shape functions. Each lessens the error of the quadrature by orders of magnitude.
const ROUNDS: usize = 3;

impl<const W: usize> ChainModel for Fitted<W> {
    fn points(&mut self, input: &Input, q: &[f64], v: &[f64], places: &[Place], out: &mut [PlacePoint]) {
        self.locate(input, q, v, v);
        for (place, point) in places.iter().zip(out) {
            *point = self.chain.point(place);
        }
    }

    fn chord_angles(&mut self, input: &Input, q: &[f64], out: &mut [f64]) {
        self.locate(input, q, q, q);
        for (angle, frame) in out.iter_mut().zip(&self.chain.frames) {
            *angle = frame.chord.angle;
        }
    }

    fn pull_back(&mut self, input: &Input, q: &[f64], places: &[Place], vectors: &[Vector], p: &mut [f64]) {
        self.locate(input, q, q, q);
        self.last.forget();
        self.chain.pull_back_places(places, vectors, p);
    }

    fn fit(&mut self, input: &Input, shapes: &[LinkShape], q: &mut [f64]) {
        q.fill(0.0);
        for (i, shape) in shapes.iter().enumerate() {
            let link = &self.chain.links[i];
            link.bend_as(shape, &mut q[link.own()]);
            link.stretch_as(shape, &mut q[link.own()]);
            match self.chain.angles[i] {
                ChordAngle::Coordinate(k) => q[k] = shape.chord_rad,
                ChordAngle::Prescribed => link.keep_chord(shape, input, &mut q[link.own()]),
                ChordAngle::Closed => {}
            }
        }
    }

    fn momentum(&mut self, input: &Input, q: &[f64], v: &[f64], p: &mut [f64]) {
        self.locate(input, q, v, v);
        self.last.forget();
        self.chain.momentum(p);
    }

    fn turn(&mut self, _input: &Input, _q: &[f64], link: usize, v: &mut [f64]) -> bool {
        v.fill(0.0);
        match self.chain.angles.get(link) {
            Some(ChordAngle::Coordinate(k)) => v[*k] = 1.0,
            _ => return false,
        }
        true
    }
}

impl<const W: usize> Chain<W> {
    /// Position, direction and velocity at a place, for the motion present.
    fn point(&self, place: &Place) -> PlacePoint {
        let (link, frame) = (&self.links[place.link], &self.frames[place.link]);
        let [value, slope] = link.shapes.values(place.xi);
        let (mut u, mut du, mut along) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for f in 0..link.shapes.functions() {
            u = add_scaled(u, value[f], link.u[f]);
            du = add_scaled(du, value[f], link.du[f]);
            along = add_scaled(along, slope[f] / link.shapes.length_m, link.u[f]);
        }
        let point = frame.point(u, du, [0.0; 2]);
        PlacePoint { position_m: point.position, slope: frame.direction.to_global(along), velocity_m_per_s: point.velocity }
    }

    /// See [`ChainModel::pull_back`], for the motion present; spends the forces.
    fn pull_back_places(&mut self, places: &[Place], vectors: &[Vector], p: &mut [f64]) {
        for forces in &mut self.forces {
            (forces.first, forces.functions) = ([0.0; 2], [[0.0; 2]; W]);
        }
        for (place, vector) in places.iter().zip(vectors) {
            let (link, forces) = (&self.links[place.link], &mut self.forces[place.link]);
            let local = self.frames[place.link].direction.to_local(*vector);
            let [value, _] = link.shapes.values(place.xi);
            forces.first = add(forces.first, local);
            for (force, value) in forces.functions.iter_mut().zip(value) {
                *force = add_scaled(*force, value, local);
            }
        }
        self.hand_down([0.0; 2], p);
    }

    /// Momenta of pins and functions, pulled back as if they were inertia forces: both are `M` times a column of vectors.
    fn momentum(&mut self, p: &mut [f64]) {
        for (i, link) in self.links.iter().enumerate() {
            let (frame, forces) = (&self.frames[i], &mut self.forces[i]);
            let velocities = std::array::from_fn(|f| add_scaled(link.du[f], frame.chord.rate, quarter(link.u[f])));
            let first = frame.direction.to_local(frame.first.velocity);
            forces.first = link.inertia(first, &velocities, &mut forces.functions);
        }
        self.hand_down(scale(self.tip.mass_kg, self.end.velocity), p);
    }

    /// Momenta `M c` of the velocities c of [`Mechanism::turn_part`](crate::mechanics::Mechanism::turn_part), for the positions present.
    /// A closed link's rate follows from `ẏ = 0` at its end; other links than `turned` do not turn. Uses `forces`; motion and forces stay.
    pub(super) fn turn_momentum(&self, forces: &mut [LinkForces<W>], turned: usize, p: &mut [f64]) {
        let mut pin = [0.0; 2];
        for (i, (link, frame)) in self.links.iter().zip(&self.frames).enumerate() {
            let chord_m = frame.direction.to_global(link.u[0]);
            let rate = match self.angles[i] {
                ChordAngle::Closed => -pin[1] / chord_m[0],
                _ => f64::from(i == turned),
            };
            let velocities = std::array::from_fn(|f| scale(rate, quarter(link.u[f])));
            forces[i].first = link.inertia(frame.direction.to_local(pin), &velocities, &mut forces[i].functions);
            pin = add_scaled(pin, rate, quarter(chord_m));
        }
        p.fill(0.0);
        self.pull_back(scale(self.tip.mass_kg, pin), forces, p);
    }

    fn hand_down(&mut self, end: Vector, p: &mut [f64]) {
        p.fill(0.0);
        let mut forces = std::mem::take(&mut self.forces);
        self.pull_back(end, &mut forces, p);
        self.forces = forces;
    }
}

impl<const W: usize> Link<W> {
    /// Sets the bending coordinates by projection of the deflection from the chord, weighed by mass: `η_i = ∫ w φ_i / ∫ φ_i²`, since
    /// the shapes are orthogonal. Rounds on what is left make up for the quadrature.
    fn bend_as(&self, shape: &LinkShape, own: &mut [f64]) {
        for _ in 0..ROUNDS {
            let mut change = [0.0; W];
            for sample in &shape.samples {
                let [value, _] = self.shapes.values(sample.xi);
                let bending = own.iter().take(self.bending).enumerate();
                let fitted: f64 = bending.map(|(i, eta)| eta * value[self.shapes.function_of(i)]).sum();
                let left = sample.weight * (sample.position_m[1] - fitted);
                for (i, change) in change.iter_mut().take(self.bending).enumerate() {
                    *change += left * value[self.shapes.function_of(i)];
                }
            }
            for (i, eta) in own.iter_mut().take(self.bending).enumerate() {
                *eta += change[i] / self.shapes.square[self.shapes.function_of(i)];
            }
        }
    }

    /// Adds so much of ψ, the static shape of a moment at the first end, that the prescribed tangent leaves the chord where it is:
    /// `θ − β = Σ φ_i'(0) η_i/L`, with `ψ'(0) = 1`. Otherwise the slope that the shapes cannot hold would turn the link.
    fn keep_chord(&self, shape: &LinkShape, input: &Input, own: &mut [f64]) {
        let tangent = input.motion.map_or(shape.chord_rad, |[angle, ..]| angle);
        let present: f64 = self.shapes.root_slope.iter().zip(own.iter()).map(|(slope, eta)| slope * eta).sum();
        let missing = self.shapes.length_m * (tangent - shape.chord_rad) - present;
        for (i, eta) in own.iter_mut().take(self.bending).enumerate() {
            *eta += missing * self.shapes.root_part(i);
        }
    }

    /// Sets the axial coordinates, if there are any, for the field present: the mean strain is kept, and of what the sine of one
    /// half-wave adds to the position that which bending does not, `2 ∫ (x − cξ) sin πξ dξ + L/π ∫ y'² cos πξ dξ`.
    fn stretch_as(&self, shape: &LinkShape, own: &mut [f64]) {
        let [mean, half_wave] = &mut own[self.bending..] else { return };
        *mean = shape.stretch * self.shapes.length_m;
        *half_wave = 0.0;
        for sample in &shape.samples {
            let (sin, cos) = (PI * sample.xi).sin_cos();
            let along = sample.position_m[0] - shape.chord_m * sample.xi;
            let shortened = self.shapes.length_m / PI * sample.slope[1].powi(2);
            *half_wave += sample.weight * (2.0 * along * sin + shortened * cos);
        }
    }
}
