//! The generalised-α method: second order, with a chosen damping of frequencies too high for the step.

use super::fixed_cost::FixedCost;
use super::newton::{Newton, NewtonSettings, Trial};
use super::system::{ErrorTerm, LocalError, State, StepError, System, Taken, Weights, Work, all_finite};

/// Chung & Hulbert (J. Appl. Mech. 60, 1993) in the form of Arnold & Brüls (Multibody Syst. Dyn. 18, 2007), which stays second
/// order when `M` depends on `q`. With the auxiliary accelerations α beside the true ones `a`,
///
/// ```text
/// q₁ = q₀ + h v₀ + h² ((½ − β) α₀ + β α₁)        v₁ = v₀ + h ((1 − γ) α₀ + γ α₁)
/// (1 − α_m) α₁ + α_m α₀ = (1 − α_f) a₁ + α_f a₀   r(t + h, q₁, v₁, a₁) = 0
///
/// α_m = (2ρ∞ − 1)/(ρ∞ + 1)    α_f = ρ∞/(ρ∞ + 1)    γ = ½ − α_m + α_f    β = ¼ (1 − α_m + α_f)²
/// ```
///
/// ρ∞ is the spectral radius at infinite frequency: 1 damps nothing, 0 forgets it within three steps.
///
/// **Loads** enter `r` at `t + h`. A load that the owner holds constant during a step stands for its mean p̄ over the step, that
/// is for its value at `t + ½h`, so it would act half a step late. Hence its increase over the step before, `Δp`, is carried on
/// by half a step:
///
/// ```text
/// Δp = r₀ − r(t, q₀, v₀, a₀)      r(t + h, q₁, v₁, a₁) = ½ Δp
/// ```
///
/// where r₀ is what the step before left: only the load held constant can have changed between the two. This keeps second order
/// for smooth loads entered by their means. Summing the recurrences with constant `M`, the momentum after a load has become
/// constant, or ended, is `Σ p̄ h` up to a remainder that fades as `(α_m/(1 − α_m))ⁿ`: the impulse is exact, spread over a few
/// steps. A new state has `a = α = r₀ = 0`: what acts at its beginning is a load that begins there.
///
/// Letting `a₀` and `α₀` jump by `M⁻¹Δp` instead delivers the impulse within its step, but rings: a torque on the end of a beam
/// of 64 elements (`h ω` about 10⁴) then gave nodal rates some 10³ times the true ones, and Newton failed.
#[derive(Debug, Clone)]
pub struct GeneralizedAlpha {
    alpha_m: f64,
    alpha_f: f64,
    beta: f64,
    gamma: f64,
    newton: Newton,
    /// The end of the step.
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    residual: Vec<f64>,
    /// Between its two ends.
    middle: State,
    /// Change of the acceleration over the step.
    change: Vec<f64>,
}

impl GeneralizedAlpha {
    /// For `degrees_of_freedom` unknowns; `rho_infinity` is 0 to 1.
    pub fn new(degrees_of_freedom: usize, rho_infinity: f64, settings: NewtonSettings) -> Self {
        let zero = vec![0.0; degrees_of_freedom];
        let alpha_m = (2.0 * rho_infinity - 1.0) / (rho_infinity + 1.0);
        let alpha_f = rho_infinity / (rho_infinity + 1.0);
        Self {
            alpha_m,
            alpha_f,
            beta: 0.25 * (1.0 - alpha_m + alpha_f).powi(2),
            gamma: 0.5 - alpha_m + alpha_f,
            newton: Newton::new(degrees_of_freedom, settings),
            q: zero.clone(),
            v: zero.clone(),
            a: zero.clone(),
            middle: State::new(zero.clone(), zero.clone()),
            residual: zero.clone(),
            change: zero,
        }
    }

    pub(super) fn set_fixed_cost(&mut self, fixed: Option<FixedCost>) {
        self.newton.fixed = fixed;
    }

    /// Advances `state` from `t_s` to `t_s + h_s`.
    ///
    /// # Errors
    /// See [`StepError`]; the state is then as it was.
    pub fn step<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<Taken, StepError> {
        self.carry_load(system, t_s, state);
        self.predict(h_s, state);
        let share = (1.0 - self.alpha_f) / (1.0 - self.alpha_m); // ∂α₁/∂a₁
        let weights = Weights { acceleration: 1.0, velocity: h_s * self.gamma * share, position: h_s * h_s * self.beta * share };
        let mut trial = Trial { q: &mut self.q, v: &mut self.v, a: &mut self.a };
        self.newton.begin_step();
        let mut effort = self.newton.solve(system, t_s + h_s, weights, &mut trial)?;
        // At its beginning, and at its end.
        effort.residuals += 2;
        system.residual(t_s + h_s, &self.q, &self.v, &self.a, &mut self.residual);
        for x in [&self.q, &self.v, &self.a, &self.residual] {
            all_finite(x)?;
        }
        let left_over = self.newton.left_over(system, &self.residual, &self.q)?;
        let work = self.work(system, t_s, h_s, state);
        for i in 0..self.a.len() {
            self.change[i] = self.a[i] - state.a[i];
            state.alpha[i] = ((1.0 - self.alpha_f) * self.a[i] + self.alpha_f * state.a[i] - self.alpha_m * state.alpha[i])
                / (1.0 - self.alpha_m);
        }
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.v);
        state.a.copy_from_slice(&self.a);
        state.residual.copy_from_slice(&self.residual);
        Ok(Taken { effort, work, left_over })
    }

    /// Of coordinates `(β − δ/2 − ⅙) h³ ȧ`, of velocities `(1/12 − δ² + δ/2 − α_m δ) h³ ä` with `δ = α_f − α_m`: expand the recurrences
    /// with `α(t) = a(t − δh) + (δ/2 − δ²/2 − α_m δ) h² ä`. Derivatives by differences.
    pub(super) fn local_error(&self, h_s: f64) -> LocalError<'_> {
        let delta = self.alpha_f - self.alpha_m;
        let of_q = self.beta - 0.5 * delta - 1.0 / 6.0;
        let of_v = 1.0 / 12.0 - delta * delta + 0.5 * delta - self.alpha_m * delta;
        LocalError {
            q: ErrorTerm::Direct(&self.change, of_q * h_s * h_s),
            v: ErrorTerm::Difference(&self.change, of_v * h_s, h_s),
        }
    }

    /// Error of the velocity by a corner of the acceleration at `part` of the step, over `J h²`, whatever ρ∞. With s the part, and n
    /// counted from 1 at the end of the corner's step, `aₙ = J h (n − s)`. The recurrence from `a₀ = α₀ = 0` then has the solution
    ///
    /// ```text
    /// αₙ = J h (n − s − δ) + b (−α_m/(1 − α_m))ⁿ⁻¹      the last terms sum to J h δ (s − α_m)
    /// vₙ = h (Σ αₖ − (1 − γ) αₙ) → ½ J h² (n − s)² + J h² (s (1 − s)/2 + δ/2 − δ² − α_m δ)
    /// ```
    ///
    /// where the sum from 1 to n less half of the last one and γ = ½ + δ make s and δ drop out of what grows with n. The terms of
    /// `local_error` add up to `(1/12 − δ² + δ/2 − α_m δ) J h²`, which leaves `s (1 − s)/2 − 1/12`, 0 on average.
    pub(super) fn corner_error(part: f64) -> f64 {
        0.5 * part * (1.0 - part) - 1.0 / 12.0
    }

    /// Simpson's rule, with the middle of the step by Hermite's cubic between its ends:
    /// `q_m = (q₀ + q₁)/2 + h (v₀ − v₁)/8`, `v_m = 3 (q₁ − q₀)/(2h) − (v₀ + v₁)/4`, `a_m = (a₀ + a₁)/2`. Of a constant torque it is
    /// the torque times the angle turned through.
    fn work<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &State) -> Work {
        for i in 0..self.a.len() {
            let (q0, q1, v0, v1) = (state.q[i], self.q[i], state.v[i], self.v[i]);
            self.middle.q[i] = 0.5 * (q0 + q1) + 0.125 * h_s * (v0 - v1);
            self.middle.v[i] = 1.5 * (q1 - q0) / h_s - 0.25 * (v0 + v1);
            self.middle.a[i] = 0.5 * (state.a[i] + self.a[i]);
        }
        let first = system.power(t_s, &state.q, &state.v, &state.a);
        let halfway = system.power(t_s + 0.5 * h_s, &self.middle.q, &self.middle.v, &self.middle.a);
        let last = system.power(t_s + h_s, &self.q, &self.v, &self.a);
        let mut work = Work::default();
        for (weight, power) in [(1.0, first), (4.0, halfway), (1.0, last)] {
            work.add(weight * h_s / 6.0, power);
        }
        work.with_magnitude(0.5 * h_s * (first.put_in_w + last.put_in_w))
    }

    /// `½ Δp`.
    fn carry_load<S: System>(&mut self, system: &mut S, t_s: f64, state: &State) {
        let load = &mut self.newton.load;
        system.residual(t_s, &state.q, &state.v, &state.a, load);
        for (load, before) in load.iter_mut().zip(&state.residual) {
            *load = 0.5 * (before - *load);
        }
    }

    /// The auxiliary acceleration goes on as it was (the true one rings where the step is too long for it).
    fn predict(&mut self, h_s: f64, state: &State) {
        for i in 0..self.a.len() {
            let alpha = state.alpha[i];
            self.a[i] = (alpha - self.alpha_f * state.a[i]) / (1.0 - self.alpha_f);
            self.v[i] = state.v[i] + h_s * alpha;
            self.q[i] = state.q[i] + h_s * (state.v[i] + 0.5 * h_s * alpha);
        }
    }
}
