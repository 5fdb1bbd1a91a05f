//! The chain as a line in motion: see [`ChainModel`].

use nalgebra::Vector2;

use super::FiniteElement;
use super::member::Member;
use super::motion::Window;
use crate::mechanics::chain_line::{LinkShape, Place, PlacePoint};
use crate::mechanics::mechanism::{ChainModel, Input};

/// A place in its element: the element's slots and what multiplies them.
struct Spot {
    window: Window,
    /// `N₁, ℓ N₂, N₃, ℓ N₄`.
    shape: [f64; 4],
    /// Their derivatives by the undeformed length.
    slope: [f64; 4],
}

impl Spot {
    /// The place of a flexible link of this length and so many elements from slot `first`.
    fn new(xi: f64, length_m: f64, first: usize, elements: usize, swapped: bool) -> Self {
        let along = xi * elements as f64;
        let k = (along as usize).min(elements - 1);
        let (x, l) = (along - k as f64, length_m / elements as f64);
        let y = 1.0 - x;
        Self {
            window: Window { first: first + 2 * k, swapped: swapped && k + 1 == elements },
            shape: [y * y * (1.0 + 2.0 * x), l * x * y * y, x * x * (3.0 - 2.0 * x), -l * x * x * y],
            slope: [-6.0 * x * y / l, y * (1.0 - 3.0 * x), 6.0 * x * y / l, x * (3.0 * x - 2.0)],
        }
    }
}

/// `Σ k x`.
fn sum(k: [f64; 4], x: [Vector2<f64>; 4]) -> Vector2<f64> {
    x[0] * k[0] + x[1] * k[1] + x[2] * k[2] + x[3] * k[3]
}

impl FiniteElement {
    fn point(&self, place: &Place) -> PlacePoint {
        let m = &self.motion;
        let length_m = self.chain.links[place.link].length_m;
        let straight = |first: usize, a: Vector2<f64>, da: Vector2<f64>| PlacePoint {
            position_m: (m.p[first] + a * place.xi).into(),
            slope: (a / length_m).into(),
            velocity_m_per_s: (m.v[first] + da * place.xi).into(),
        };
        match &self.members[place.link] {
            Member::Flexible { first, elements, swapped, .. } => {
                let spot = Spot::new(place.xi, length_m, *first, *elements, *swapped);
                let (x, dx) = (spot.window.gather(&m.p), spot.window.gather(&m.v));
                PlacePoint {
                    position_m: sum(spot.shape, x).into(),
                    slope: sum(spot.slope, x).into(),
                    velocity_m_per_s: sum(spot.shape, dx).into(),
                }
            }
            Member::Rigid { first, .. } => straight(*first, m.p[first + 1], m.v[first + 1]),
            Member::Guided { first, rod } => {
                let [a, da, _] = rod.along(&self.guided_state(*first).0);
                straight(*first, a, da)
            }
        }
    }

    /// Adds a vector at a place to the forces on the slots that move it.
    fn push(&mut self, place: &Place, vector: Vector2<f64>) {
        match &self.members[place.link] {
            Member::Flexible { first, elements, swapped, .. } => {
                let length_m = self.chain.links[place.link].length_m;
                let spot = Spot::new(place.xi, length_m, *first, *elements, *swapped);
                spot.window.add(&mut self.forces, spot.shape.map(|k| vector * k));
            }
            Member::Rigid { first, .. } => {
                self.forces[*first] += vector;
                self.forces[first + 1] += vector * place.xi;
            }
            Member::Guided { first, rod } => {
                let (first, pin) = (*first, self.guided_state(*first).0);
                self.forces[first] += rod.push(&pin, place.xi, &vector);
            }
        }
    }

    /// Adds the momenta of a link to those of its slots.
    fn add_momentum(&mut self, link: usize) {
        let v = &self.motion.v;
        match &self.members[link] {
            Member::Flexible { beam, first, elements, swapped } => {
                for window in super::member::windows(*first, *elements, *swapped) {
                    window.add(&mut self.forces, beam.inertia(&window.gather(v)));
                }
            }
            Member::Rigid { first, masses } => {
                for (row, slot) in masses.iter().zip(*first..) {
                    self.forces[slot] += v[*first] * row[0] + v[first + 1] * row[1];
                }
            }
            Member::Guided { first, rod } => {
                let (first, pin) = (*first, self.guided_state(*first).0);
                self.forces[first] += rod.momentum(&pin, self.end.mass_kg);
            }
        }
    }

    /// The forces as the unknowns feel them.
    pub(super) fn hand_out(&mut self, p: &mut [f64]) {
        for polar in &self.motion.polars {
            self.forces[polar.slot] = polar.polar.force(&self.forces[polar.slot]);
        }
        for (value, &place) in p.iter_mut().zip(&self.layout.active) {
            *value = self.forces[place / 2][place % 2];
        }
    }
}

impl ChainModel for FiniteElement {
    fn points(&mut self, input: &Input, q: &[f64], v: &[f64], places: &[Place], out: &mut [PlacePoint]) {
        self.locate(input, q, v, v);
        for (place, point) in places.iter().zip(out) {
            *point = self.point(place);
        }
    }

    fn chord_angles(&mut self, input: &Input, q: &[f64], out: &mut [f64]) {
        self.locate(input, q, q, q);
        for (i, angle) in out.iter_mut().enumerate() {
            *angle = self.chord_rad(i);
        }
    }

    fn pull_back(&mut self, input: &Input, q: &[f64], places: &[Place], vectors: &[[f64; 2]], p: &mut [f64]) {
        self.locate(input, q, q, q);
        self.last.forget();
        self.forces.fill(Vector2::zeros());
        for (place, vector) in places.iter().zip(vectors) {
            self.push(place, (*vector).into());
        }
        self.hand_out(p);
    }

    fn fit(&mut self, input: &Input, shapes: &[LinkShape], q: &mut [f64]) {
        self.last.forget();
        self.place(input, shapes);
        self.store(|motion| &motion.p, |polar| polar.u, q);
    }

    fn momentum(&mut self, input: &Input, q: &[f64], v: &[f64], p: &mut [f64]) {
        self.locate(input, q, v, v);
        self.last.forget();
        self.forces.fill(Vector2::zeros());
        for link in 0..self.members.len() {
            self.add_momentum(link);
        }
        if let Some(end) = self.layout.end {
            self.forces[end] += self.motion.v[end] * self.end.mass_kg;
        }
        self.hand_out(p);
    }

    fn turn(&mut self, input: &Input, q: &[f64], link: usize, v: &mut [f64]) -> bool {
        let free = self.is_free(input, link);
        self.last.forget();
        v.fill(0.0);
        if free {
            self.motion.load(&self.layout, input, q, v, v);
            self.set_link_rates(if link == 0 { [1.0, 0.0] } else { [0.0, 1.0] });
            self.store(|motion| &motion.v, |polar| polar.du, v);
        }
        free
    }
}
