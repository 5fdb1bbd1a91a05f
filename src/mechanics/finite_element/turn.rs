//! The chain's momenta as it turns as if its links kept their shape.

use nalgebra::Vector2;

use super::FiniteElement;
use super::member::{Member, windows};
use super::rigid::PinMotion;
use super::strain::left;
use crate::mechanics::mechanism::Input;
use crate::scene::End;

/// A rigid body's motion: a point of it, the point's velocity, and the body's rate.
#[derive(Clone, Copy)]
struct Turning {
    position: Vector2<f64>,
    velocity: Vector2<f64>,
    rate: f64,
}

impl Turning {
    fn at(&self, position: Vector2<f64>) -> Vector2<f64> {
        self.velocity + left(&(position - self.position)) * self.rate
    }
}

impl FiniteElement {
    /// Whether a link can turn by itself.
    pub(super) fn is_free(&self, input: &Input, link: usize) -> bool {
        match link {
            0 => input.motion.is_none(),
            1 => self.members.len() == 2 && !self.slides(),
            _ => false,
        }
    }

    /// See [`Mechanism::turn_part`](crate::mechanics::Mechanism::turn_part), for the positions present. Motion and forces stay.
    pub(super) fn set_turn_part(&mut self, turned: usize, part: &mut [f64]) {
        std::mem::swap(&mut self.forces, &mut self.momenta);
        self.forces.fill(Vector2::zeros());
        let mut turning = Turning { position: Vector2::zeros(), velocity: Vector2::zeros(), rate: 0.0 };
        let mut inertia = 0.0;
        for link in 0..self.members.len() {
            turning.rate = if link == turned { 1.0 } else { self.rate_of_other(link, &turning) };
            inertia += self.add_turning(link, &mut turning);
        }
        if let Some(end) = self.layout.end {
            let velocity = turning.at(self.motion.p[end]);
            self.forces[end] += velocity * self.end.mass_kg;
            inertia += velocity.norm_squared() * self.end.mass_kg;
        }
        self.hand_out(part);
        std::mem::swap(&mut self.forces, &mut self.momenta);
        let per_inertia = 1.0 / inertia;
        part.iter_mut().for_each(|p| *p *= per_inertia);
    }

    /// Rate of a link that does not turn by itself, for the motion of its pin: with the second one's vector e to a slider, `ẏ = 0` there
    /// gives `−ẏ_A/e_x`.
    fn rate_of_other(&self, link: usize, pin: &Turning) -> f64 {
        match (link, &self.chain.end, self.layout.end) {
            (1, End::Slider(_), Some(end)) => -pin.velocity.y / (self.motion.p[end] - pin.position).x,
            _ => 0.0,
        }
    }

    /// Adds a link's momenta to those of its slots, and returns twice its kinetic energy. Takes the motion of its first pin and leaves
    /// that of its second.
    fn add_turning(&mut self, link: usize, turning: &mut Turning) -> f64 {
        let (p, forces, start) = (&self.motion.p, &mut self.forces, *turning);
        let mut twice_j = 0.0;
        match &self.members[link] {
            Member::Flexible { beam, first, elements, swapped } => {
                for window in windows(*first, *elements, *swapped) {
                    let x = window.gather(p);
                    let v = [start.at(x[0]), left(&x[1]) * start.rate, start.at(x[2]), left(&x[3]) * start.rate];
                    let momenta = beam.inertia(&v);
                    twice_j += v.iter().zip(&momenta).map(|(v, p)| v.dot(p)).sum::<f64>();
                    window.add(forces, momenta);
                    (turning.position, turning.velocity) = (x[2], v[2]);
                }
            }
            Member::Rigid { first, masses } => {
                let along = p[first + 1];
                let v = [start.velocity, left(&along) * start.rate];
                for ((row, slot), own) in masses.iter().zip(*first..).zip(&v) {
                    let momentum = v[0] * row[0] + v[1] * row[1];
                    twice_j += own.dot(&momentum);
                    forces[slot] += momentum;
                }
                turning.position += along;
                turning.velocity += v[1];
            }
            Member::Guided { first, rod } => {
                let zero = Vector2::zeros();
                let pin = PinMotion { p: p[*first], dp: start.velocity, ddp: zero, gravity: zero };
                let momentum = rod.momentum(&pin, self.end.mass_kg);
                twice_j += start.velocity.dot(&momentum);
                forces[*first] += momentum;
            }
        }
        twice_j
    }
}
