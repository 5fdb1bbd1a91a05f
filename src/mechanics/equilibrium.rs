//! Static equilibrium of a chain.

use std::f64::consts::{PI, TAU};

use super::mechanism::{Input, Mechanism, NoEquilibrium, Weights};
use crate::scene;

/// Most steps towards it: some sixty turns of the crank.
const STEPS: usize = 2000;
/// Most that a direction may turn in one of them, rad.
const MOST_TURN_RAD: f64 = 0.2;
/// The first step, s.
const FIRST_STEP_S: f64 = 1e-3;
/// Beyond this the inertia of a step is nothing, s.
const LONGEST_STEP_S: f64 = 1e4;
/// Residual, relative to the forces at work, at which it is reached.
const TOLERANCE: f64 = 1e-11;
/// A correction that turns nothing further than this, relative to how far directions have turned, is rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Freedom that a static equilibrium leaves at the pivot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pivot {
    /// Nothing: the first link's tangent stays at the angle where the scene starts.
    Held,
    /// The tangent turns to where the base spring balances the chain.
    Free,
}

impl Pivot {
    /// Free where a base spring, and no prescribed motion, decides where the tangent comes to rest.
    pub(super) fn of(chain: &scene::Chain, input: &Input) -> Self {
        let sprung = chain.base.torsion_spring_nm_per_rad > 0.0;
        if sprung && input.motion.is_none() { Pivot::Free } else { Pivot::Held }
    }
}

/// Direction, rad, in which a free second link rests once the first is held at `angle_rad`: along gravity; where there is none, in
/// line with the first, as a scene starts. It is that of a straight link, at most half a turn from `angle_rad`.
pub(super) fn second_link_rad(chain: &scene::Chain, angle_rad: f64) -> f64 {
    let [x, y] = chain.gravity_m_per_s2;
    if [x, y] == [0.0; 2] {
        return angle_rad;
    }
    let turn = (y.atan2(x) - angle_rad).rem_euclid(TAU);
    angle_rad + if turn > PI { turn - TAU } else { turn }
}

/// Brings `q` to `r(q, 0, 0) = 0`, downhill from where it is; `turn` is the largest of some changes of coordinates that are, or
/// amount to, angles of directions.
///
/// ```text
/// (M/h² + K) x = r(q, 0, 0)      q ← q − x
/// ```
///
/// are steps of implicit Euler that forget the velocities: a careful descent while `h` is short, Newton's iteration when it is
/// long. It doubles with every step. It is quartered, and the step not taken, where a direction would turn too far, or where
/// `x·r < 0`, for which the matrix must be indefinite: a step as long as that heads for an unstable equilibrium.
pub(super) fn settle<M: Mechanism>(
    mechanism: &mut M,
    input: &Input,
    q: &mut [f64],
    turn: impl Fn(&M, &[f64]) -> f64,
) -> Result<(), NoEquilibrium> {
    if q.is_empty() {
        return Ok(());
    }
    let still = vec![0.0; q.len()];
    let (mut r, mut x) = (still.clone(), still.clone());
    let mut step_s = FIRST_STEP_S;
    for _ in 0..STEPS {
        mechanism.residual(input, q, &still, &still, &mut r);
        let reached = mechanism.residual_size(&r) <= TOLERANCE;
        if reached {
            // One more of Newton's steps takes out most of what the tolerance has left.
            step_s = LONGEST_STEP_S;
        }
        x.copy_from_slice(&r);
        let weights = Weights { acceleration: step_s.powi(-2), velocity: 0.0, position: 1.0 };
        let solved = mechanism.factor(input, q, &still, &still, weights).is_ok();
        if solved {
            mechanism.solve(&mut x);
        }
        let (turned, work) = (turn(mechanism, &x), x.iter().zip(&r).map(|(x, r)| x * r).sum::<f64>());
        // False also where a number is not one.
        let taken = solved && turned <= MOST_TURN_RAD && work >= 0.0;
        if taken {
            q.iter_mut().zip(&x).for_each(|(q, x)| *q -= x);
        }
        if reached || taken && step_s == LONGEST_STEP_S && turned <= ROUNDING * turn(mechanism, q) {
            return Ok(());
        }
        step_s = if taken { (step_s * 2.0).min(LONGEST_STEP_S) } else { step_s * 0.25 };
    }
    Err(NoEquilibrium)
}
