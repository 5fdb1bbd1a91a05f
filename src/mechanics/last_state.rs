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
}

/// Equal to no motion.
const NEVER: Option<[f64; 3]> = Some([f64::NAN; 3]);

impl LastState {
    /// No state yet, of `n` unknowns.
    pub(super) fn new(n: usize) -> Self {
        let zero = vec![0.0; n];
        Self { motion: NEVER, q: zero.clone(), v: zero.clone(), a: zero }
    }

    /// Takes a state; whether it is another than the last.
    pub(super) fn changes(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> bool {
        if self.motion == input.motion && self.q == q && self.v == v && self.a == a {
            return false;
        }
        self.motion = input.motion;
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.a.copy_from_slice(a);
        true
    }

    /// Forgets it, after something else has been evaluated.
    pub(super) fn forget(&mut self) {
        self.motion = NEVER;
    }
}
