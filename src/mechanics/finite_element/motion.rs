//! Positions, velocities and accelerations of all slots, from the unknowns and the prescribed angle.

use nalgebra::Vector2;

use super::beam::Four;
use super::layout::{Layout, PIVOT, ROOT};
use super::polar::Polar;
use crate::mechanics::mechanism::Input;
use crate::scene::Chain;

/// A polar vector and its slot.
#[derive(Debug, Clone)]
pub(super) struct PolarSlot {
    pub(super) slot: usize,
    /// The radius of a rigid link's vector.
    held_radius: Option<f64>,
    pub(super) polar: Polar,
    /// Force on the vector as its members need it, in Cartesian coordinates.
    pub(super) force: Vector2<f64>,
}

/// The motion of the chain's slots at one instant.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    pub(super) p: Vec<Vector2<f64>>,
    pub(super) v: Vec<Vector2<f64>>,
    pub(super) a: Vec<Vector2<f64>>,
    /// The root's, and the second link's if it has one.
    pub(super) polars: Vec<PolarSlot>,
}

impl Motion {
    /// At rest at zero.
    pub(super) fn new(chain: &Chain, layout: &Layout) -> Self {
        let zero = vec![Vector2::zeros(); layout.slots()];
        let polars = [Some(ROOT), layout.second].into_iter().flatten().zip(&chain.links);
        let polars = polars.map(|(slot, link)| PolarSlot {
            slot,
            held_radius: link.rigid.then_some(link.length_m),
            polar: Polar::default(),
            force: Vector2::zeros(),
        });
        Self { p: zero.clone(), v: zero.clone(), a: zero, polars: polars.collect() }
    }

    /// Takes the state in.
    pub(super) fn load(&mut self, layout: &Layout, input: &Input, q: &[f64], v: &[f64], a: &[f64]) {
        for (i, &place) in layout.active.iter().enumerate() {
            let (slot, component) = (place / 2, place % 2);
            self.p[slot][component] = q[i];
            self.v[slot][component] = v[i];
            self.a[slot][component] = a[i];
        }
        for polar in &mut self.polars {
            let slot = polar.slot;
            let (mut u, mut du, mut ddu) = (self.p[slot], self.v[slot], self.a[slot]);
            if let Some(radius) = polar.held_radius {
                (u.x, du.x, ddu.x) = (radius, 0.0, 0.0);
            }
            if let (ROOT, Some([angle, rate, acceleration])) = (slot, input.motion) {
                (u.y, du.y, ddu.y) = (angle, rate, acceleration);
            }
            polar.polar = Polar::new(u, du, ddu);
            [self.p[slot], self.v[slot], self.a[slot]] = polar.polar.cartesian();
        }
    }

    /// Sets the coordinates of a polar slot, at rest.
    pub(super) fn set_polar(&mut self, slot: usize, u: Vector2<f64>) {
        for polar in self.polars.iter_mut().filter(|polar| polar.slot == slot) {
            polar.polar = Polar::new(u, Vector2::zeros(), Vector2::zeros());
        }
    }

    /// Sets angular rate and acceleration of a polar slot, its radius constant.
    pub(super) fn set_polar_rate(&mut self, slot: usize, rate: f64, acceleration: f64) {
        for polar in self.polars.iter_mut().filter(|polar| polar.slot == slot) {
            polar.polar.du = Vector2::new(0.0, rate);
            polar.polar.ddu = Vector2::new(0.0, acceleration);
        }
    }

    /// The root's polar coordinates.
    pub(super) fn root(&self) -> &Polar {
        &self.polars[0].polar
    }

    /// The polar coordinates of a slot that has them.
    pub(super) fn polar(&self, slot: usize) -> Option<&Polar> {
        self.polars.iter().find(|polar| polar.slot == slot).map(|polar| &polar.polar)
    }
}

/// The slots of an element: from `first` on, its last two in the other order if `swapped`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub(super) first: usize,
    pub(super) swapped: bool,
}

impl Window {
    /// Whether the element is the chain's first, at the pivot.
    #[inline]
    pub(super) fn at_hub(self) -> bool {
        self.first == PIVOT
    }

    /// The element's vectors in its own order.
    #[inline]
    pub(super) fn gather(self, values: &[Vector2<f64>]) -> Four {
        let v = &values[self.first..self.first + 4];
        if self.swapped { [v[0], v[1], v[3], v[2]] } else { [v[0], v[1], v[2], v[3]] }
    }

    /// Sets the element's vectors.
    pub(super) fn set(self, values: &mut [Vector2<f64>], mut four: Four) {
        if self.swapped {
            four.swap(2, 3);
        }
        values[self.first..self.first + 4].copy_from_slice(&four);
    }

    /// Adds the element's vectors.
    #[inline]
    pub(super) fn add(self, values: &mut [Vector2<f64>], mut four: Four) {
        if self.swapped {
            four.swap(2, 3);
        }
        for (value, add) in values[self.first..self.first + 4].iter_mut().zip(four) {
            *value += add;
        }
    }
}
