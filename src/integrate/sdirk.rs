//! SDIRK of third order: begins a step in which the load jumps, or takes it whole at a fixed cost.

use super::dirk::{Stages, Tableau, of_kept_velocity};
use super::fixed_cost::FixedCost;
use super::system::{State, StepError, System, Taken, Work};

const STAGES: usize = 3;
/// Root of `γ³ − 3γ² + 3γ/2 − 1/6`, for order 3 and `R(∞) = 0`.
const GAMMA: f64 = 0.435_866_521_508_459;
/// Weight of the first stage in the second.
const A21: f64 = 0.5 * (1.0 - GAMMA);
/// Weights of the stages before.
const A: [[f64; STAGES]; STAGES] = [[0.0; STAGES], [A21, 0.0, 0.0], [B[0], B[1], 0.0]];
/// Weights of the step: those of the last stage.
const B: [f64; STAGES] =
    [-0.25 * (6.0 * GAMMA * GAMMA - 16.0 * GAMMA + 1.0), 0.25 * (6.0 * GAMMA * GAMMA - 20.0 * GAMMA + 5.0), GAMMA];

/// The method of three stages, third order and L-stable (Alexander, SIAM J. Numer. Anal. 14, 1977).
///
/// All stages are implicit, so it needs no accelerations to begin with, and what it cannot resolve is at rest under the new load from
/// its first stage on. Every stage is predicted with the velocity of the stage before: the load may turn the end of a beam by far more,
/// and Newton converges from where the beam was.
const SDIRK: Tableau<STAGES> =
    Tableau { c: [GAMMA, 0.5 * (1.0 + GAMMA), 1.0], a: A, b: B, gamma: GAMMA, predicted: of_kept_velocity(&A, GAMMA, GAMMA) };

/// Steps from `state` to `t_s + h_s` with nothing but its coordinates and velocities; the result is the last of the stages. With
/// `shared`, the stages share the corrections of that many stages of fixed cost.
///
/// # Errors
/// See [`StepError`].
pub(super) fn step<S: System>(
    stages: &mut Stages,
    system: &mut S,
    t_s: f64,
    h_s: f64,
    state: &State,
    shared: Option<(FixedCost, usize)>,
) -> Result<Taken, StepError> {
    let (mut taken, mut work) = (Taken::default(), Work::default());
    stages.newton.begin_step();
    stages.newton.load.fill(0.0);
    for (stage, c) in SDIRK.c.into_iter().enumerate() {
        let at_s = t_s + c * h_s;
        stages.newton.fixed = shared.map(|(fixed, of)| fixed.shared(stage, STAGES, of));
        stages.predict(&SDIRK, stage, h_s, state, None);
        taken.effort += stages.solve(system, stage, at_s, SDIRK.weights(h_s))?;
        work.add(SDIRK.b[stage] * h_s, system.power(at_s, &stages.q, &stages.v, &stages.a));
    }
    taken.work = work.with_magnitude(0.0);
    Ok(taken)
}

/// Error of the velocity by a corner of the acceleration at `part` of the step, over `J h²`.
pub(super) fn corner_error(part: f64) -> f64 {
    SDIRK.corner_error(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_conditions_hold_to_rounding() {
        let Tableau { c, a, b, gamma, .. } = SDIRK;
        let row = |i: usize| (0..STAGES).map(|j| a[i][j] * c[j]).sum::<f64>() + gamma * c[i];
        let sum = |f: &dyn Fn(usize) -> f64| (0..STAGES).map(|i| b[i] * f(i)).sum::<f64>();
        for (stage, place) in c.into_iter().enumerate() {
            assert!((a[stage].iter().sum::<f64>() + gamma - place).abs() < 1e-15, "stage {stage}: its place");
        }
        for (found, right) in
            [(sum(&|_| 1.0), 1.0), (sum(&|i| c[i]), 0.5), (sum(&|i| c[i] * c[i]), 1.0 / 3.0), (sum(&row), 1.0 / 6.0)]
        {
            assert!((found - right).abs() < 1e-14, "{found} {right}");
        }
        assert!((gamma.powi(3) - 3.0 * gamma * gamma + 1.5 * gamma - 1.0 / 6.0).abs() < 1e-15, "γ");
    }
}
