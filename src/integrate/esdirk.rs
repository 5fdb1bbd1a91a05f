//! ESDIRK4(3)6L\[2\]SA: fourth order, implicit, forgets what the step does not resolve, with an error estimate.

use super::beginning::overshoots;
use super::dirk::{Stages, Tableau, by_parabolas, of_kept_velocity};
use super::fixed_cost::FixedCost;
use super::newton::NewtonSettings;
use super::sdirk;
use super::system::{ErrorTerm, LocalError, State, StepError, System, Taken, Work, all_finite, solve_acceleration};

/// The implicit half of ARK4(3)6L\[2\]SA (Kennedy & Carpenter, Appl. Numer. Math. 44, 2003), a diagonally implicit Runge–Kutta method
/// of six stages, the first of them explicit:
///
/// ```text
/// Qᵢ = q₀ + h Σⱼ aᵢⱼ Vⱼ      Vᵢ = v₀ + h Σⱼ aᵢⱼ Aⱼ      r(t + cᵢ h, Qᵢ, Vᵢ, Aᵢ) = 0      q₁ = Q₆,  v₁ = V₆
/// ```
///
/// Order 4, stage order 2, embedded order 3. Every implicit stage has `aᵢᵢ = γ = ¼`, so Newton's matrix has the same weights
/// `(1, γh, γ²h²)` in all of them and is factored once a step. With `z = hμ` per eigenvalue μ,
///
/// ```text
/// R(z) = (1 − z/4 − z²/8 + z³/96 + 7z⁴/768) / (1 − z/4)⁵      |R(z)| ≤ 1 for Re z ≤ 0      R(∞) = 0
/// ```
///
/// so it is L-stable: it has no part that runs backwards, and a vibration with `hω = 1` fades by 2e-5 a step. It errs in phase by
/// `9·10⁻⁴ z⁵`. Stage order 2 is what keeps its order where a stiff membrane is coupled with a large rotation; SDIRK4 of Hairer &
/// Wanner (stage order 1) lost it there.
///
/// **Loads.** The first stage takes its accelerations from the last stage of the step before, which knows nothing of a load that jumps
/// between the two. Such a jump Δp shows in the residual, as in [`GeneralizedAlpha`](super::GeneralizedAlpha). The stages after it carry
/// what the first one lacks:
///
/// ```text
/// Δp = r₀ − r(t, q₀, v₀, a₀)      r(t + cᵢ h, Qᵢ, Vᵢ, Aᵢ) = eᵢ Δp      e₂ = e₆ = 0
/// Σ bᵢ eᵢ = b₁      Σ bᵢ aᵢⱼ eⱼ = Σ bᵢ aᵢ₁      Σ bᵢ cᵢ eᵢ = 0
/// ```
///
/// with the residual r₀ that the step before left. So impulse, its effect on positions, and its first moment are those of the load
/// itself, and the step ends balanced. Since `Σ bᵢ = 1` and `Σ bᵢ cᵢ = ½`, a load that is constant, or rises linearly over the step,
/// delivers its impulse exactly where `M` is constant.
///
/// Where `M` depends on q, the stages that carry a large jump lie too far apart: of a short pulse of hundreds of N·m on two free links
/// at 0.2 ms, 0.4 of the angular impulse arrived. So a step whose jump is over a hundredth of the forces at work begins with an
/// eighth by a method of third order that needs no accelerations (`sdirk.rs`), and goes on from the balanced state that it leaves.
/// Such steps are few, whatever h, so the order stays 4. The same pulse, spread over its steps, then arrives to 5e-3. Where steps are
/// cut at its edges, as `simulation` does, it is stronger and arrives to 2.3e-2; at a tenth of its strength, to 3e-6.
///
/// So does the first step under a load such as a constant torque, if the accelerations that the load gives overshoot (`beginning.rs`): the
/// state begins without any, and the load jumps. With them, Newton's iteration found other roots or singular matrices, and where it
/// held, the motion erred by up to a hundred times more. So does a step that fails with accelerations that `begin` gave, which α tells.
///
/// Giving the first stage accelerations of its own, `a₀ + M⁻¹ Δp`, delivers the impulse too (to 1.4e-2), but sets off vibrations that
/// the step does not resolve: the crank of a stiff chain (R1) then erred by 2.5e-5 rad instead of 1e-6.
///
/// **Error.** `d = h Σ (bᵢ − b̂ᵢ) (Vᵢ, Aᵢ)` is the error of the embedded third order in one step. Per eigenvalue it is `ĉ z⁴` and the
/// step's own error `c z⁵`, so the change of d over a step, times `c/ĉ = −3.79`, is the step's own.
#[derive(Debug, Clone)]
pub struct Esdirk {
    stages: Stages,
    fixed: Option<FixedCost>,
    residual: Vec<f64>,
    /// Jump of the load between the end of the step before and the beginning of this one.
    jump: Vec<f64>,
    /// The state after the first part of a step in which the load jumps.
    begun: State,
    error_q: Vec<f64>,
    error_v: Vec<f64>,
    /// Whether the load jumped by much at the beginning of the last step.
    jumped: bool,
}

const STAGES: usize = 6;
const GAMMA: f64 = 0.25;
/// Places of the stages in the step.
const C: [f64; STAGES] = [0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0];
/// Weights of the stages before.
const A: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [0.25, 0.0, 0.0, 0.0, 0.0, 0.0],
    [8611.0 / 62_500.0, -1743.0 / 31_250.0, 0.0, 0.0, 0.0, 0.0],
    [5_012_029.0 / 34_652_500.0, -654_441.0 / 2_922_500.0, 174_375.0 / 388_108.0, 0.0, 0.0, 0.0],
    [
        15_267_082_809.0 / 155_376_265_600.0,
        -71_443_401.0 / 120_774_400.0,
        730_878_875.0 / 902_184_768.0,
        2_285_395.0 / 8_070_912.0,
        0.0,
        0.0,
    ],
    [B[0], B[1], B[2], B[3], B[4], 0.0],
];
/// Weights of the step: those of the last stage.
const B: [f64; STAGES] = [82_889.0 / 524_892.0, 0.0, 15_625.0 / 83_664.0, 69_875.0 / 102_672.0, -2260.0 / 8211.0, GAMMA];
/// Weights of the embedded method of third order.
const EMBEDDED: [f64; STAGES] = [
    4_586_570_599.0 / 29_645_900_160.0,
    0.0,
    178_811_875.0 / 945_068_544.0,
    814_220_225.0 / 1_159_782_912.0,
    -3_700_637.0 / 11_593_932.0,
    61_727.0 / 225_920.0,
];
/// `c/ĉ`: c is minus the coefficient of `z⁵` in `(1 − z/4)⁵ eᶻ`, `ĉ = Σ (bᵢ − b̂ᵢ) aᵢⱼ aⱼₖ cₖ`.
const NEXT_ORDER: f64 = -3.793_5;
/// Part of a jump of the load that each stage carries.
const CARRIED: [f64; STAGES] = carried();
/// A jump over this part of the forces at work is large: below it the stages carry it.
const LARGE_JUMP: f64 = 1e-2;
/// Part of a step that is taken first if the load jumps by much. With a quarter or a sixteenth as many random scenes came out right, within
/// one in a hundred.
const FIRST_PART: f64 = 0.125;
/// The method. Accelerations are predicted by the parabola through the last stages, and for the second stage by what the step before left.
const ESDIRK: Tableau<STAGES> = Tableau { c: C, a: A, b: B, gamma: GAMMA, predicted: by_parabolas(&C) };
/// The method behind a large jump. What the step does not resolve swings there, so that accelerations of stages predict nothing: each stage
/// is predicted with the velocity of the stage before.
const BEHIND_JUMP: Tableau<STAGES> = Tableau { predicted: of_kept_velocity(&A, GAMMA, 0.0), ..ESDIRK };

/// e₃, e₄ and e₅ by Cramer's rule from the three conditions.
const fn carried() -> [f64; STAGES] {
    // Σ bᵢ aᵢⱼ for each j.
    let mut d = [0.0; STAGES];
    let mut j = 0;
    while j < STAGES {
        d[j] = B[j] * if j == 0 { 0.0 } else { GAMMA };
        let mut i = j + 1;
        while i < STAGES {
            d[j] += B[i] * A[i][j];
            i += 1;
        }
        j += 1;
    }
    let rows = [[B[2], B[3], B[4]], [d[2], d[3], d[4]], [B[2] * C[2], B[3] * C[3], B[4] * C[4]]];
    let right = [B[0], d[0], 0.0];
    let whole = determinant(rows);
    let mut carried = [0.0; STAGES];
    let mut column = 0;
    while column < 3 {
        let mut replaced = rows;
        let mut row = 0;
        while row < 3 {
            replaced[row][column] = right[row];
            row += 1;
        }
        carried[column + 2] = determinant(replaced) / whole;
        column += 1;
    }
    carried
}

const fn determinant([[a, b, c], [d, e, f], [g, h, i]]: [[f64; 3]; 3]) -> f64 {
    a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
}

impl Esdirk {
    /// For `degrees_of_freedom` unknowns.
    pub fn new(degrees_of_freedom: usize, settings: NewtonSettings) -> Self {
        let zero = vec![0.0; degrees_of_freedom];
        Self {
            stages: Stages::new(degrees_of_freedom, STAGES, settings),
            fixed: None,
            residual: zero.clone(),
            jump: zero.clone(),
            begun: State::new(zero.clone(), zero.clone()),
            error_q: zero.clone(),
            error_v: zero,
            jumped: false,
        }
    }

    pub(super) fn set_fixed_cost(&mut self, fixed: Option<FixedCost>) {
        self.fixed = fixed;
    }

    /// Gives a new state the accelerations that it begins with under the loads present, unless these overshoot.
    ///
    /// # Errors
    /// [`StepError`] when they cannot be solved for; the state then has none.
    pub fn begin<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<(), StepError> {
        let (Self { stages, residual, .. }, State { q, v, a, alpha, residual: left }) = (self, state);
        [&mut *a, &mut *alpha, &mut *left].into_iter().for_each(|part| part.fill(0.0));
        solve_acceleration(system, t_s, q, v, &mut stages.a, residual)?;
        let scratch = [&mut stages.q[..], &mut stages.v, residual];
        if !overshoots(system, (t_s, C[1] * h_s), [q, v, &stages.a], scratch) {
            a.copy_from_slice(&stages.a);
            alpha.copy_from_slice(a);
            system.residual(t_s, q, v, a, left);
        }
        Ok(())
    }

    /// Advances `state` from `t_s` to `t_s + h_s`.
    ///
    /// # Errors
    /// See [`StepError`]; the state is then as it was.
    pub fn step<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<Taken, StepError> {
        let mut jumps = self.jumps_by_much(system, t_s, state);
        let smooth = if jumps { None } else { Some(self.take(&ESDIRK, system, t_s, h_s, state)) };
        let mut taken = match smooth {
            Some(Err(_)) if state.alpha == state.a => {
                jumps = true;
                self.take_behind_jump(system, t_s, h_s, state)?
            }
            Some(taken) => taken?,
            None => self.take_behind_jump(system, t_s, h_s, state)?,
        };
        // At its beginning, and at its end.
        taken.effort.residuals += 2;
        system.residual(t_s + h_s, &self.stages.q, &self.stages.v, &self.stages.a, &mut self.residual);
        for x in [&self.stages.q, &self.stages.v, &self.stages.a, &self.residual] {
            all_finite(x)?;
        }
        taken.left_over = self.stages.newton.left_over(system, &self.residual, &self.stages.q)?;
        self.jumped = jumps;
        if jumps && self.fixed.is_some() {
            // This method has no estimate of its error.
            self.error_q.fill(0.0);
            self.error_v.fill(0.0);
            state.alpha.copy_from_slice(&self.stages.a);
        } else {
            self.predict_next(state);
        }
        state.q.copy_from_slice(&self.stages.q);
        state.v.copy_from_slice(&self.stages.v);
        state.a.copy_from_slice(&self.stages.a);
        state.residual.copy_from_slice(&self.residual);
        Ok(taken)
    }

    /// See the type's description.
    pub(super) fn local_error(&self, h_s: f64) -> LocalError<'_> {
        let of = |vector| ErrorTerm::Difference(vector, NEXT_ORDER, h_s.powi(4));
        LocalError { q: of(&self.error_q), v: of(&self.error_v) }
    }

    /// Error of the velocity by a corner of the acceleration at `part` of the step, over `J h²`, by the methods that took the last step. The
    /// terms of `local_error` cancel over the steps after it.
    pub(super) fn corner_error(&self, part: f64) -> f64 {
        let rest = 1.0 - FIRST_PART;
        match self.fixed {
            _ if !self.jumped => ESDIRK.corner_error(part),
            Some(_) => sdirk::corner_error(part),
            None if part < FIRST_PART => FIRST_PART.powi(2) * sdirk::corner_error(part / FIRST_PART),
            None => rest.powi(2) * BEHIND_JUMP.corner_error((part - FIRST_PART) / rest),
        }
    }

    /// Finds the jump of the load at the beginning of the step; returns whether it is too large for the stages to carry.
    fn jumps_by_much<S: System>(&mut self, system: &mut S, t_s: f64, state: &State) -> bool {
        system.residual(t_s, &state.q, &state.v, &state.a, &mut self.jump);
        for (jump, before) in self.jump.iter_mut().zip(&state.residual) {
            *jump = before - *jump;
        }
        system.residual_size(&self.jump) > LARGE_JUMP
    }

    /// Takes a step that begins without accelerations.
    fn take_behind_jump<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &State) -> Result<Taken, StepError> {
        match self.fixed {
            Some(fixed) => sdirk::step(&mut self.stages, system, t_s, h_s, state, Some((fixed, STAGES - 1))),
            None => self.step_in_two(system, t_s, h_s, state),
        }
    }

    /// Takes the first part of a step by the method that needs no accelerations, and the rest from the state that this leaves.
    fn step_in_two<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &State) -> Result<Taken, StepError> {
        let first_s = FIRST_PART * h_s;
        let mut taken = sdirk::step(&mut self.stages, system, t_s, first_s, state, None)?;
        let mut begun = std::mem::take(&mut self.begun);
        begun.q.copy_from_slice(&self.stages.q);
        begun.v.copy_from_slice(&self.stages.v);
        begun.a.copy_from_slice(&self.stages.a);
        for (alpha, a) in begun.alpha.iter_mut().zip(&self.stages.a) {
            *alpha = BEHIND_JUMP.predicted[1][0] * a;
        }
        self.jump.fill(0.0);
        let rest = self.take(&BEHIND_JUMP, system, t_s + first_s, h_s - first_s, &begun);
        self.begun = begun;
        taken += rest?;
        Ok(taken)
    }

    /// Solves for the six stages of a step.
    fn take<S: System>(
        &mut self,
        method: &Tableau<STAGES>,
        system: &mut S,
        t_s: f64,
        h_s: f64,
        state: &State,
    ) -> Result<Taken, StepError> {
        let (mut taken, mut work) = (Taken::default(), Work::default());
        let n = self.jump.len();
        self.stages.all_v[..n].copy_from_slice(&state.v);
        self.stages.all_a[..n].copy_from_slice(&state.a);
        work.add(B[0] * h_s, system.power(t_s, &state.q, &state.v, &state.a));
        let weights = method.weights(h_s);
        self.stages.newton.begin_step();
        self.stages.newton.fixed = self.fixed;
        for stage in 1..STAGES {
            let at_s = t_s + C[stage] * h_s;
            self.stages.predict(method, stage, h_s, state, (stage == 1).then_some(&state.alpha));
            for (load, jump) in self.stages.newton.load.iter_mut().zip(&self.jump) {
                *load = CARRIED[stage] * jump;
            }
            taken.effort += self.stages.solve(system, stage, at_s, weights)?;
            if B[stage] != 0.0 {
                work.add(B[stage] * h_s, system.power(at_s, &self.stages.q, &self.stages.v, &self.stages.a));
            }
        }
        self.estimate_error(h_s);
        taken.work = work.with_magnitude(0.0);
        Ok(taken)
    }

    fn estimate_error(&mut self, h_s: f64) {
        let n = self.jump.len();
        for i in 0..n {
            let (mut q, mut v) = (0.0, 0.0);
            for stage in 0..STAGES {
                let weight = B[stage] - EMBEDDED[stage];
                q += weight * self.stages.all_v[stage * n + i];
                v += weight * self.stages.all_a[stage * n + i];
            }
            (self.error_q[i], self.error_v[i]) = (h_s * q, h_s * v);
        }
    }

    /// Accelerations of the next step's second stage, by the parabola through stages at 0, 0.62 and 1 of this one.
    fn predict_next(&self, state: &mut State) {
        let n = self.jump.len();
        for i in 0..n {
            let [first, fourth, last] = [0, 3, 5].map(|stage| self.stages.all_a[stage * n + i]);
            state.alpha[i] = NEXT[0] * first + NEXT[1] * fourth + NEXT[2] * last;
        }
    }
}

/// Lagrange's weights at 1.5 of the parabola through 0, c₄ and 1.
const NEXT: [f64; 3] = [(1.5 - C[3]) * 0.5 / C[3], 1.5 * 0.5 / (C[3] * (C[3] - 1.0)), 1.5 * (1.5 - C[3]) / (1.0 - C[3])];

#[cfg(test)]
mod tests {
    use super::*;

    /// Every weight of the method: `Σⱼ aᵢⱼ cⱼᵏ`.
    fn row(stage: usize, power: i32) -> f64 {
        let before: f64 = (0..stage).map(|j| A[stage][j] * C[j].powi(power)).sum();
        before + if stage > 0 { GAMMA * C[stage].powi(power) } else { 0.0 }
    }

    #[test]
    fn order_conditions_hold_to_rounding() {
        for (stage, place) in C.into_iter().enumerate() {
            assert!((row(stage, 0) - place).abs() < 1e-15, "stage {stage}: its place");
            assert!((row(stage, 1) - place.powi(2) / 2.0).abs() < 1e-15, "stage {stage}: stage order 2");
        }
        let twice = |stage: usize| -> f64 {
            (0..stage).map(|j| A[stage][j] * row(j, 1)).sum::<f64>() + if stage > 0 { GAMMA * row(stage, 1) } else { 0.0 }
        };
        let sum = |b: &[f64; STAGES], f: &dyn Fn(usize) -> f64| (0..STAGES).map(|i| b[i] * f(i)).sum::<f64>();
        for (b, order) in [(&B, 4), (&EMBEDDED, 3)] {
            let mut conditions = vec![
                sum(b, &|_| 1.0) - 1.0,
                sum(b, &|i| C[i]) - 0.5,
                sum(b, &|i| C[i].powi(2)) - 1.0 / 3.0,
                sum(b, &|i| row(i, 1)) - 1.0 / 6.0,
            ];
            if order == 4 {
                conditions.extend([
                    sum(b, &|i| C[i].powi(3)) - 0.25,
                    sum(b, &|i| C[i] * row(i, 1)) - 0.125,
                    sum(b, &|i| row(i, 2)) - 1.0 / 12.0,
                    sum(b, &twice) - 1.0 / 24.0,
                ]);
            }
            assert!(conditions.iter().all(|x| x.abs() < 1e-14), "order {order}: {conditions:?}");
        }
    }

    #[test]
    fn prop_stages_carry_what_the_first_one_lacks_of_a_jump() {
        let into_position =
            |j: usize| (j + 1..STAGES).map(|i| B[i] * A[i][j]).sum::<f64>() + if j > 0 { B[j] * GAMMA } else { 0.0 };
        let sum = |f: &dyn Fn(usize) -> f64| (1..STAGES).map(|i| CARRIED[i] * f(i)).sum::<f64>();
        assert!((sum(&|i| B[i]) - B[0]).abs() < 1e-15);
        assert!((sum(&into_position) - into_position(0)).abs() < 1e-15);
        assert!(sum(&|i| B[i] * C[i]).abs() < 1e-15);
        assert_eq!((CARRIED[1], CARRIED[5]), (0.0, 0.0));
        assert!(CARRIED.iter().all(|carried| carried.abs() < 1.0));
    }

    #[test]
    fn val_predictions_are_exact_for_parabolas() {
        for (stage, place) in C.into_iter().enumerate().skip(3) {
            for power in 0..=2 {
                let predicted: f64 = (0..stage).map(|j| ESDIRK.predicted[stage][j] * C[j].powi(power)).sum();
                assert!((predicted - place.powi(power)).abs() < 1e-14, "stage {stage}, power {power}: {predicted}");
            }
        }
    }
}
