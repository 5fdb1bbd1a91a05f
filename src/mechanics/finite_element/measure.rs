//! Changes of a chord angle and of a deflection by small changes of the unknowns.

use nalgebra::Vector2;

use super::FiniteElement;
use super::layout::{PIVOT, ROOT};
use super::member::Member;
use super::strain::{cross, left};
use crate::mechanics::mechanism::{Measure, ROTATIONS};

impl FiniteElement {
    /// See [`Measure`].
    pub(super) fn measured(&self, q: &[f64], dq: &[f64]) -> Measure {
        Measure { angle_rad: self.chord_change(q, dq), deflection_m: self.deflection_change(q, dq), ..Measure::default() }
    }

    /// See [`Mechanism::chords`](crate::mechanics::Mechanism::chords).
    pub(super) fn free_chords(&self, q: &[f64], v: &[f64]) -> [[f64; 2]; ROTATIONS] {
        let turning = |a: Vector2<f64>, da: Vector2<f64>| [a.y.atan2(a.x), cross(&a, &da) / a.norm_squared()];
        let first = match &self.members[0] {
            Member::Flexible { .. } => turning(self.vector(self.first_end(), q), self.vector(self.first_end(), v)),
            _ => self.layout.root.map_or([0.0; 2], |root| [q[root], v[root]]),
        };
        let second = match self.members.get(1).filter(|_| !self.slides()) {
            Some(Member::Flexible { first, elements, .. }) => {
                let [start, end] = [*first, first + 2 * elements];
                turning(self.position(end, q) - self.position(start, q), self.moved(end, q, v) - self.moved(start, q, v))
            }
            Some(Member::Rigid { first, .. }) => {
                self.layout.unknown(2 * (first + 1) + 1).map_or([0.0; 2], |angle| [q[angle], v[angle]])
            }
            _ => [0.0; 2],
        };
        [first, second]
    }

    /// The slot of the first link's last pin.
    fn first_end(&self) -> usize {
        self.layout.pin.or(self.layout.end).unwrap_or(PIVOT)
    }

    /// `a × da/|a|²` with the vector a from the pivot to the first link's last pin; of a rigid link the change of its angle.
    fn chord_change(&self, q: &[f64], dq: &[f64]) -> f64 {
        match &self.members[0] {
            Member::Flexible { .. } => {
                let end = self.first_end();
                let (a, da) = (self.vector(end, q), self.vector(end, dq));
                cross(&a, &da) / a.norm_squared()
            }
            _ => self.layout.root.map_or(0.0, |root| dq[root]),
        }
    }

    /// `n·(dr_m − (dr₀ + dr₁)/2)` with the middle node m, the ends 0 and 1, and the normal n of the chord.
    fn deflection_change(&self, q: &[f64], dq: &[f64]) -> f64 {
        let bent = self.members.iter().rev().find_map(|member| match member {
            Member::Flexible { first, elements, swapped, .. } if elements % 2 == 0 => Some((*first, *elements, *swapped)),
            _ => None,
        });
        let Some((first, elements, swapped)) = bent else { return 0.0 };
        let [start, middle, end] = [first, first + elements, first + 2 * elements + usize::from(swapped)];
        let chord = self.position(end, q) - self.position(start, q);
        let [d0, dm, d1] = [start, middle, end].map(|slot| self.moved(slot, q, dq));
        left(&chord).dot(&(dm - (d0 + d1) * 0.5)) / chord.norm()
    }

    /// Change of a position by `dq`: of a rigid first link's end, `l J e dθ` with its direction e.
    fn moved(&self, slot: usize, q: &[f64], dq: &[f64]) -> Vector2<f64> {
        match self.layout.root.filter(|_| slot == ROOT) {
            Some(root) => left(&self.position(slot, q)) * dq[root],
            None if slot == ROOT => Vector2::zeros(),
            None => self.vector(slot, dq),
        }
    }

    fn position(&self, slot: usize, q: &[f64]) -> Vector2<f64> {
        match self.layout.root.filter(|_| slot == ROOT) {
            Some(root) => Vector2::new(q[root].cos(), q[root].sin()) * self.chain.links[0].length_m,
            // Prescribed: where it was evaluated last.
            None if slot == ROOT => self.motion.p[ROOT],
            None => self.vector(slot, q),
        }
    }

    /// A slot in the unknowns; what is held is 0.
    fn vector(&self, slot: usize, unknowns: &[f64]) -> Vector2<f64> {
        Vector2::from_fn(|component, _| self.layout.unknown(2 * slot + component).map_or(0.0, |i| unknowns[i]))
    }
}
