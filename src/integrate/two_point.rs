//! The two-point method of the thesis (5.2), on `q̇ = v`, `M(q) v̇ + g(t, q, v) = 0`.

use super::newton::{Newton, NewtonSettings, Trial};
use super::system::{Effort, State, StepError, System, Weights, all_finite};

/// `q` and `v` are linear over the step and satisfy the equations at `t + ϑh`:
///
/// ```text
/// q_ϑ = (1 − ϑ) q₀ + ϑ q₁     v_ϑ = (1 − ϑ) v₀ + ϑ v₁
/// (q₁ − q₀)/h = v_ϑ           (v₁ − v₀)/h = a          r(t + ϑh, q_ϑ, v_ϑ, a) = 0
/// ```
///
/// ϑ = 0 is explicit Euler, 1 implicit Euler, ½ the implicit midpoint rule: second order, unconditionally stable on linear
/// systems, it keeps quadratic invariants and damps nothing. Any other ϑ is first order; ϑ < ½ is unstable without damping,
/// ϑ > ½ damps. Per eigenvalue μ of a linear system, `g = (1 + (1 − ϑ) h μ) / (1 − ϑ h μ)`.
///
/// A load constant during the step gives `M (v₁ − v₀) = p h` whatever ϑ is. Functions of time enter at `t + ϑh`.
/// On linear systems this is the thesis's method to rounding; on nonlinear ones it is solved to convergence.
///
/// Eliminating q₁ and v₁, the unknown is `a`: `v_ϑ = v₀ + ϑh a`, `q_ϑ = q₀ + ϑh v_ϑ = q₀ + ϑh v₀ + (ϑh)² a`.
#[derive(Debug, Clone)]
pub struct TwoPoint {
    weight: f64,
    newton: Newton,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
}

impl TwoPoint {
    /// For `degrees_of_freedom` unknowns; `weight` is ϑ, 0 to 1.
    pub fn new(degrees_of_freedom: usize, weight: f64, settings: NewtonSettings) -> Self {
        let zero = vec![0.0; degrees_of_freedom];
        Self { weight, newton: Newton::new(degrees_of_freedom, settings), q: zero.clone(), v: zero.clone(), a: zero }
    }

    /// Advances `state` from `t_s` to `t_s + h_s`.
    ///
    /// # Errors
    /// See [`StepError`]; the state is then as it was.
    pub fn step<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<Effort, StepError> {
        self.begin_step();
        self.step_after(h_s, system, t_s, h_s, state)
    }

    /// Begins a step of several parts.
    pub(super) fn begin_step(&mut self) {
        self.newton.begin_step();
    }

    /// A part of a step, or all of it, where the one before, by which the prediction is made, was of `before_s`.
    pub(super) fn step_after<S: System>(
        &mut self,
        before_s: f64,
        system: &mut S,
        t_s: f64,
        h_s: f64,
        state: &mut State,
    ) -> Result<Effort, StepError> {
        let part_s = self.weight * h_s;
        let rest_s = (1.0 - self.weight) * before_s;
        self.predict(rest_s, part_s, state);
        let weights = Weights { acceleration: 1.0, velocity: part_s, position: part_s * part_s };
        let mut trial = Trial { q: &mut self.q, v: &mut self.v, a: &mut self.a };
        let effort = self.newton.solve(system, t_s + part_s, weights, &mut trial)?;
        self.extend(h_s, state);
        all_finite(&self.q)?;
        all_finite(&self.v)?;
        let own = part_s / (part_s + rest_s);
        for i in 0..self.a.len() {
            // The change of v_ϑ: a part of this step's acceleration, the rest of the one before's.
            state.alpha[i] = own * self.a[i] + (1.0 - own) * state.a[i];
        }
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.v);
        state.a.copy_from_slice(&self.a);
        Ok(effort)
    }

    /// `v_ϑ` goes on changing as it did over the step before, of h⁻: `v_ϑ = v_ϑ⁻ + (ϑh + (1 − ϑ) h⁻) α` with
    /// `v_ϑ⁻ = v₀ − (1 − ϑ) h⁻ a⁻`: where the step is too long for a vibration `v` and `a` alternate from step to step, and `v_ϑ`
    /// does not.
    fn predict(&mut self, rest_s: f64, part_s: f64, state: &State) {
        for i in 0..self.a.len() {
            self.a[i] = state.a[i];
            self.v[i] = state.v[i];
            if part_s != 0.0 {
                self.v[i] += (part_s + rest_s) * state.alpha[i] - rest_s * state.a[i];
                self.a[i] = (self.v[i] - state.v[i]) / part_s;
            }
            self.q[i] = state.q[i] + part_s * self.v[i];
        }
    }

    /// From the point of collocation to the end of the step.
    fn extend(&mut self, h_s: f64, state: &State) {
        for i in 0..self.a.len() {
            self.q[i] = state.q[i] + h_s * self.v[i];
            self.v[i] = state.v[i] + h_s * self.a[i];
        }
    }
}
