//! The generalised-α method: second order, with a chosen damping of frequencies too high for the step.

use super::newton::{Newton, NewtonSettings, Trial};
use super::system::{Effort, State, StepError, System, Weights, all_finite};

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
/// ρ∞ is the spectral radius at infinite frequency: 1 damps nothing, 0 removes what is too fast in one step.
///
/// **Loads.** Everything, a load constant during the step too, enters `r` at `t + h`. Left at that, a load p̄ that stands for its
/// mean over the step would act half a step late (first order), and `a₀` and `α₀` would still hold the load of the step before.
/// So the step begins by letting the load jump: `δ = −M⁻¹ (r(t, q₀, v₀, a₀) − r₀)`, where r₀ is what the step before left, is
/// added to both `a₀` and `α₀`. The load's share of `a₀`, `a₁`, `α₀`, `α₁` is then the same `M⁻¹ p̄`, its share of `v₁ − v₀` is
/// `h M⁻¹ p̄` and of `q₁ − q₀` `½ h² M⁻¹ p̄`: the impulse arrives exactly, within its step, with every ρ∞, a step load does not
/// ring, and a smooth load entered by its means keeps second order. The same correction finds the initial accelerations.
/// It costs a residual a step, and a factorization of `M` only when the load has changed by more than Newton's tolerance.
#[derive(Debug, Clone)]
pub struct GeneralizedAlpha {
    alpha_m: f64,
    alpha_f: f64,
    beta: f64,
    gamma: f64,
    tolerance: f64,
    newton: Newton,
    /// a₀, α₀ after the load's jump.
    a0: Vec<f64>,
    alpha0: Vec<f64>,
    /// The end of the step.
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    jump: Vec<f64>,
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
            tolerance: settings.tolerance,
            newton: Newton::new(degrees_of_freedom, settings),
            a0: zero.clone(),
            alpha0: zero.clone(),
            q: zero.clone(),
            v: zero.clone(),
            a: zero.clone(),
            jump: zero,
        }
    }

    /// Advances `state` from `t_s` to `t_s + h_s`.
    ///
    /// # Errors
    /// See [`StepError`]; the state is then as it was.
    pub fn step<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<Effort, StepError> {
        let jumps = self.let_load_jump(system, t_s, state)?;
        self.predict(h_s, state);
        let share = (1.0 - self.alpha_f) / (1.0 - self.alpha_m); // ∂α₁/∂a₁
        let weights = Weights { acceleration: 1.0, velocity: h_s * self.gamma * share, position: h_s * h_s * self.beta * share };
        let mut trial = Trial { q: &mut self.q, v: &mut self.v, a: &mut self.a };
        let mut effort = self.newton.solve(system, t_s + h_s, weights, &mut trial)?;
        effort.factorizations += jumps;
        for x in [&self.q, &self.v, &self.a] {
            all_finite(x)?;
        }
        for i in 0..self.a.len() {
            state.alpha[i] = self.auxiliary(i);
        }
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.v);
        state.a.copy_from_slice(&self.a);
        state.residual.copy_from_slice(&self.newton.residual);
        Ok(effort)
    }

    /// a₀ and α₀ just after `t_s`; returns the number of factorizations.
    fn let_load_jump<S: System>(&mut self, system: &mut S, t_s: f64, state: &State) -> Result<u32, StepError> {
        self.a0.copy_from_slice(&state.a);
        self.alpha0.copy_from_slice(&state.alpha);
        system.residual(t_s, &state.q, &state.v, &state.a, &mut self.jump);
        all_finite(&self.jump)?;
        for (jump, before) in self.jump.iter_mut().zip(&state.residual) {
            *jump -= before;
        }
        if self.jump.is_empty() || system.residual_size(&self.jump) <= self.tolerance {
            return Ok(0);
        }
        system.factor(t_s, &state.q, &state.v, &state.a, Weights::MASS)?;
        system.solve(&mut self.jump);
        for (i, delta) in self.jump.iter().enumerate() {
            self.a0[i] -= delta;
            self.alpha0[i] -= delta;
        }
        Ok(1)
    }

    /// The acceleration goes on as it was.
    fn predict(&mut self, h_s: f64, state: &State) {
        self.a.copy_from_slice(&self.a0);
        for i in 0..self.a.len() {
            let (alpha0, alpha1) = (self.alpha0[i], self.auxiliary(i));
            self.q[i] = state.q[i] + h_s * (state.v[i] + h_s * ((0.5 - self.beta) * alpha0 + self.beta * alpha1));
            self.v[i] = state.v[i] + h_s * ((1.0 - self.gamma) * alpha0 + self.gamma * alpha1);
        }
    }

    /// α₁ that belongs to a₁.
    fn auxiliary(&self, i: usize) -> f64 {
        ((1.0 - self.alpha_f) * self.a[i] + self.alpha_f * self.a0[i] - self.alpha_m * self.alpha0[i]) / (1.0 - self.alpha_m)
    }
}
