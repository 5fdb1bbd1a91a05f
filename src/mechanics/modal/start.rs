//! The state at t = 0.

use super::chain::Chain;
use super::tangent::Tangent;
use crate::mechanics::mechanism::{Input, Weights};

/// Most Newton iterations for the static equilibrium.
const ITERATIONS: usize = 50;
/// Residual relative to the forces at work at which it is found.
const TOLERANCE: f64 = 1e-13;

/// Straight links moving as rigid bodies, at the angle and rate of the scene (or of the prescribed motion); bent as static
/// equilibrium with the chord angles held asks, where the scene wants that.
pub(super) fn start(chain: &mut Chain, tangent: &mut Tangent, input: &Input, q: &mut [f64], v: &mut [f64]) {
    straight(chain, q, v);
    if chain.start.static_equilibrium && !bend(chain, tangent, input, q) {
        straight(chain, q, v);
    }
}

fn straight(chain: &Chain, q: &mut [f64], v: &mut [f64]) {
    for k in 0..q.len() {
        let angle = chain.is_angle(k);
        q[k] = if angle { chain.start.angle_rad } else { 0.0 };
        v[k] = if angle { chain.start.rate_rad_per_s } else { 0.0 };
    }
}

/// Solves `r(q, 0, 0) = 0` for all coordinates but the angles; whether that succeeded.
fn bend(chain: &mut Chain, tangent: &mut Tangent, input: &Input, q: &mut [f64]) -> bool {
    let still = Input { motion: input.motion.map(|[angle, ..]| [angle, 0.0, 0.0]), ..*input };
    let zero = vec![0.0; q.len()];
    let mut r = zero.clone();
    for _ in 0..ITERATIONS {
        chain.residual(&still, q, &zero, &zero, &mut r);
        tangent.assemble(chain, &zero, Weights { acceleration: 0.0, velocity: 0.0, position: 1.0 });
        for k in (0..q.len()).filter(|k| chain.is_angle(*k)) {
            r[k] = 0.0;
            tangent.hold(k);
        }
        if chain.residual_size(&r) < TOLERANCE {
            return true;
        }
        if tangent.factor().is_err() {
            return false;
        }
        tangent.solve(&mut r);
        for (q, r) in q.iter_mut().zip(&r) {
            *q -= r;
        }
    }
    q.iter().all(|q| q.is_finite())
}
