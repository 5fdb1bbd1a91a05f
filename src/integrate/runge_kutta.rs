//! The classical Runge–Kutta method of fourth order, explicit: for systems that are not stiff.

use super::corner::of_quadrature;
use super::system::{Effort, ErrorTerm, LocalError, State, StepError, System, Taken, Work, all_finite, solve_acceleration};

/// Stages at `t, t + h/2, t + h/2, t + h` with `aᵢ = −M(qᵢ)⁻¹ g(tᵢ, qᵢ, vᵢ)`, each from the slopes of the one before:
///
/// ```text
/// q₁ = q₀ + h (v₁ + 2 v₂ + 2 v₃ + v₄)/6      v₁ = v₀ + h (a₁ + 2 a₂ + 2 a₃ + a₄)/6
/// ```
///
/// Per eigenvalue μ, `R(z) = 1 + z + z²/2 + z³/6 + z⁴/24` with `z = hμ`. `|R(z)| ≤ 1` for `|z| ≤ 2.61` in the left half-plane: up to
/// `h ω = 2√2` without damping, to `h a = 2.785` of a decay `exp(−at)`; by direction, see [`RungeKutta::stable_to`].
/// A load constant during the step delivers its impulse exactly; a smooth load entered by its means is second order.
#[derive(Debug, Clone)]
pub struct RungeKutta {
    /// The stage: coordinates, velocities, accelerations.
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    /// The weighted sums of slopes.
    sum_v: Vec<f64>,
    sum_a: Vec<f64>,
    first_a: Vec<f64>,
    scratch: Vec<f64>,
    /// Errors of the embedded third order, of the step before.
    error_v: Vec<f64>,
    error_a: Vec<f64>,
}

/// For each stage: its place in the step as a fraction of h, and its weight.
const STAGES: [(f64, f64); 4] = [(0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)];

impl RungeKutta {
    /// For `degrees_of_freedom` unknowns.
    pub fn new(degrees_of_freedom: usize) -> Self {
        let zero = vec![0.0; degrees_of_freedom];
        Self {
            q: zero.clone(),
            v: zero.clone(),
            a: zero.clone(),
            sum_v: zero.clone(),
            sum_a: zero.clone(),
            first_a: zero.clone(),
            scratch: zero.clone(),
            error_v: zero.clone(),
            error_a: zero,
        }
    }

    /// The largest |z| at which `|R(z)| ≤ 1` still holds, in the direction of `angle_rad` from the positive real axis: from π/2, the
    /// imaginary axis, to π, the negative real one. Every ray there leaves the region once, between 2.6 and 3.
    pub fn stable_to(angle_rad: f64) -> f64 {
        let (mut inside, mut outside) = (2.6, 3.0);
        while outside - inside > 1e-12 {
            let middle = 0.5 * (inside + outside);
            let (re, im) = (middle * angle_rad.cos(), middle * angle_rad.sin());
            *(if Self::growth(re, im) <= 1.0 { &mut inside } else { &mut outside }) = middle;
        }
        inside
    }

    /// `|R(re + i im)|`.
    pub fn growth(re: f64, im: f64) -> f64 {
        // Horner's scheme: 1 + z (1 + z/2 (1 + z/3 (1 + z/4))).
        let (mut x, mut y) = (1.0, 0.0);
        for divisor in [4.0, 3.0, 2.0, 1.0] {
            (x, y) = (1.0 + (re * x - im * y) / divisor, (re * y + im * x) / divisor);
        }
        x.hypot(y)
    }

    /// The embedded method with weights `(1, 2, 2, 0, 1)/6`, whose last slope is the first of the next step, errs by
    /// `d = h (k₄ − k₅)/6`, `z⁴/72` per eigenvalue; the step itself by `−z⁵/120`: the change of d over a step, times −0.6. It is that of
    /// the step before, as the last slope is only known now.
    pub(super) fn local_error(&self, h_s: f64) -> LocalError<'_> {
        let of = |vector| ErrorTerm::Difference(vector, -0.6, h_s.powi(4));
        LocalError { q: of(&self.error_v), v: of(&self.error_a) }
    }

    /// Error of the velocity by a corner of the acceleration at `part` of the step, over `J h²`: that of Simpson's rule,
    /// `⅔ max(0, ½ − s) + ⅙ (1 − s) − ½ (1 − s)²`. The terms of `local_error` cancel over the steps after it.
    pub(super) fn corner_error(part: f64) -> f64 {
        of_quadrature(STAGES, part)
    }

    /// Advances `state` from `t_s` to `t_s + h_s`.
    ///
    /// # Errors
    /// See [`StepError`]; the state is then as it was.
    #[inline]
    pub fn step<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<Taken, StepError> {
        let mut work = Work::default();
        for slopes in [&mut self.v, &mut self.a, &mut self.sum_v, &mut self.sum_a] {
            slopes.fill(0.0);
        }
        for (stage, (place, weight)) in STAGES.into_iter().enumerate() {
            let part_s = place * h_s;
            for i in 0..self.q.len() {
                self.q[i] = state.q[i] + part_s * self.v[i];
                self.v[i] = state.v[i] + part_s * self.a[i];
            }
            solve_acceleration(system, t_s + part_s, &self.q, &self.v, &mut self.a, &mut self.scratch)?;
            work.add(weight * h_s, system.power(t_s + part_s, &self.q, &self.v, &self.a));
            if stage == 0 {
                self.first_a.copy_from_slice(&self.a);
                // A new state that moves has no slopes of a step before, from whose change the error is taken.
                let is_new = [&state.alpha, &state.residual].iter().all(|slopes| slopes.iter().all(|slope| *slope == 0.0));
                if is_new && self.v.iter().any(|v| *v != 0.0) {
                    state.alpha.copy_from_slice(&self.v);
                    state.residual.copy_from_slice(&self.a);
                }
                for i in 0..self.q.len() {
                    self.error_v[i] = h_s / 6.0 * (state.alpha[i] - self.v[i]);
                    self.error_a[i] = h_s / 6.0 * (state.residual[i] - self.a[i]);
                }
            }
            for i in 0..self.q.len() {
                self.sum_v[i] += weight * self.v[i];
                self.sum_a[i] += weight * self.a[i];
            }
        }
        for i in 0..self.q.len() {
            self.q[i] = state.q[i] + h_s * self.sum_v[i];
            self.sum_a[i] = state.v[i] + h_s * self.sum_a[i];
        }
        all_finite(&self.q)?;
        all_finite(&self.sum_a)?;
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.sum_a);
        state.a.copy_from_slice(&self.first_a);
        state.alpha.copy_from_slice(&self.v);
        state.residual.copy_from_slice(&self.a);
        let effort = Effort { residuals: 4, newton_iterations: 0, factorizations: 4 };
        Ok(Taken { effort, work: work.with_magnitude(0.0), left_over: 0.0 })
    }
}
