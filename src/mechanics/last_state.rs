//! The state that a model was last evaluated at.

use super::mechanism::Input;

/// Remembers it, so that residual, tangent, power and observation of one state, asked for one after the other, evaluate it once.
/// The torque is not part of it: models add that last, so that a load held constant during a step may change between two.
#[derive(Debug, Clone)]
pub(super) struct LastState {
    motion: Option<[f64; 3]>,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    known: Known,
}

/// The part of a state that the model holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Known {
    Nothing,
    /// Positions, velocities and accelerations.
    Motion,
    /// And the forces that they need.
    Forces,
}

impl LastState {
    /// No state yet, of `n` unknowns.
    pub(super) fn new(n: usize) -> Self {
        let zero = vec![0.0; n];
        Self { motion: None, q: zero.clone(), v: zero.clone(), a: zero, known: Known::Nothing }
    }

    /// Takes a state whose forces are wanted; whether they have to be worked out.
    pub(super) fn lacks_forces(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> bool {
        self.lacks(Known::Forces, input, q, v, a)
    }

    /// Takes a state whose motion is wanted; whether it has to be worked out.
    pub(super) fn lacks_motion(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> bool {
        self.lacks(Known::Motion, input, q, v, a)
    }

    fn lacks(&mut self, wanted: Known, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> bool {
        if self.known >= wanted && self.motion == input.motion && same(&self.a, a) && same(&self.v, v) && same(&self.q, q) {
            return false;
        }
        self.motion = input.motion;
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.a.copy_from_slice(a);
        self.known = wanted;
        true
    }

    /// Forgets it, after something else has been evaluated.
    pub(super) fn forget(&mut self) {
        self.known = Known::Nothing;
    }
}

/// Whether two vectors are equal to the bit: all of it, which is quicker than to stop at the first difference.
fn same(one: &[f64], other: &[f64]) -> bool {
    one.iter().zip(other).fold(0, |apart, (one, other)| apart | (one.to_bits() ^ other.to_bits())) == 0
}
