//! The two-point method of the thesis (5.2), on `q̇ = v`, `M(q) v̇ + g(t, q, v) = 0`.

use super::fixed_cost::FixedCost;
use super::newton::{Newton, NewtonSettings, Trial};
use super::system::{Effort, ErrorTerm, LocalError, State, StepError, System, Taken, Weights, Work, all_finite};

/// `q` and `v` are linear over the step and satisfy the equations at `t + ϑh`:
///
/// ```text
/// q_ϑ = (1 − ϑ) q₀ + ϑ q₁     v_ϑ = (1 − ϑ) v₀ + ϑ v₁
/// (q₁ − q₀)/h = v_ϑ           (v₁ − v₀)/h = a          r(t + ϑh, q_ϑ, v_ϑ, a) = 0
/// ```
///
/// ϑ = 0 is explicit Euler, 1 implicit Euler, ½ the implicit midpoint rule: second order, unconditionally stable on linear
/// systems, it keeps quadratic invariants and damps nothing. With a mass matrix that
/// varies with q, vibrations of `ωh > 1` may gain or lose energy. Any other ϑ is first order; ϑ < ½ is unstable without damping,
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
    /// Residual that a step of fixed cost leaves.
    residual: Vec<f64>,
    /// Change of the acceleration since the step before.
    change: Vec<f64>,
}

impl TwoPoint {
    /// For `degrees_of_freedom` unknowns; `weight` is ϑ, 0 to 1.
    pub fn new(degrees_of_freedom: usize, weight: f64, settings: NewtonSettings) -> Self {
        let zero = vec![0.0; degrees_of_freedom];
        Self {
            weight,
            newton: Newton::new(degrees_of_freedom, settings),
            q: zero.clone(),
            v: zero.clone(),
            a: zero.clone(),
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
        let (own_s, rest_s) = (self.weight * h_s, (1.0 - self.weight) * h_s);
        self.predict(own_s, rest_s, state);
        let weights = Weights { acceleration: 1.0, velocity: own_s, position: own_s * own_s };
        let mut trial = Trial { q: &mut self.q, v: &mut self.v, a: &mut self.a };
        self.newton.begin_step();
        let mut effort = self.newton.solve(system, t_s + own_s, weights, &mut trial)?;
        let left_over = self.left_over(system, t_s + own_s, &mut effort)?;
        let mut work = Work::default();
        work.add(h_s, system.power(t_s + own_s, &self.q, &self.v, &self.a));
        self.extend(h_s, state);
        all_finite(&self.q)?;
        all_finite(&self.v)?;
        let at_end = if self.weight < 0.5 { system.power(t_s + h_s, &self.q, &self.v, &self.a).put_in_w } else { 0.0 };
        for i in 0..self.a.len() {
            // The change of v_ϑ: a part of this step's acceleration, the rest of the one before's.
            self.change[i] = self.a[i] - state.a[i];
            state.alpha[i] = self.weight * self.a[i] + (1.0 - self.weight) * state.a[i];
        }
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.v);
        state.a.copy_from_slice(&self.a);
        Ok(Taken { effort, work: work.with_magnitude(h_s * at_end), left_over })
    }

    /// Residual left at the point of collocation by a step of fixed cost.
    fn left_over<S: System>(&mut self, system: &mut S, at_s: f64, effort: &mut Effort) -> Result<f64, StepError> {
        if self.newton.fixed.is_none() {
            return Ok(0.0);
        }
        system.residual(at_s, &self.q, &self.v, &self.a, &mut self.residual);
        effort.residuals += 1;
        self.newton.left_over(system, &self.residual, &self.q)
    }

    /// `h³ x‴/12` for ϑ = ½, otherwise `(ϑ − ½) h² ẍ`, by `g(z) − eᶻ`; derivatives by differences of the acceleration.
    pub(super) fn local_error(&self, h_s: f64) -> LocalError<'_> {
        let off = self.weight - 0.5;
        if off == 0.0 {
            let q = ErrorTerm::Direct(&self.change, h_s * h_s / 12.0);
            return LocalError { q, v: ErrorTerm::Difference(&self.change, h_s / 12.0, h_s) };
        }
        LocalError { q: ErrorTerm::Direct(&self.a, off * h_s * h_s), v: ErrorTerm::Direct(&self.change, off * h_s) }
    }

    /// Error of the velocity by a corner of the acceleration at `part` of the step, over `J h²`. With s the part, the corner's step samples
    /// `J h max(0, ϑ − s)`, and the n-th from it, counted from 1, `J h (n − 1 + ϑ − s)`. Summed and compared with `½ (n − s)²` the error is
    ///
    /// ```text
    /// n (ϑ − ½) + max(0, s − ϑ) − ½ s²
    /// ```
    ///
    /// The terms of `local_error` add up to `(ϑ − ½) (n − 1 + ϑ − s)` of it, and to 1/12 for ϑ = ½. Smooth motion has that
    /// 1/12 from `−1/24` of the midpoint rule and ⅛ of `q_ϑ`, which lies off the middle by `h² q̈/8`; a corner has only the former on average.
    pub(super) fn corner_error(&self, part: f64) -> f64 {
        let off = self.weight - 0.5;
        let left_out = if off == 0.0 { -1.0 / 12.0 } else { off * (1.0 - self.weight + part) };
        (part - self.weight).max(0.0) - 0.5 * part * part + left_out
    }

    /// `v_ϑ` goes on changing as it did over the step before: `v_ϑ = v_ϑ⁻ + h α` with `v_ϑ⁻ = v₀ − (1 − ϑ) h a⁻`: where the step is
    /// too long for a vibration `v` and `a` alternate from step to step, and `v_ϑ` does not.
    fn predict(&mut self, own_s: f64, rest_s: f64, state: &State) {
        for i in 0..self.a.len() {
            self.a[i] = state.a[i];
            self.v[i] = state.v[i];
            if own_s != 0.0 {
                self.v[i] += (own_s + rest_s) * state.alpha[i] - rest_s * state.a[i];
                self.a[i] = (self.v[i] - state.v[i]) / own_s;
            }
            self.q[i] = state.q[i] + own_s * self.v[i];
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
