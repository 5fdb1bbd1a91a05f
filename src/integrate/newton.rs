//! Newton's iteration for the implicit schemes.

use super::fixed_cost::FixedCost;
use super::system::{Effort, StepError, System, Weights, all_finite};

/// When Newton's iteration is content, and when it gives up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonSettings {
    /// Largest residual relative to the forces at work.
    pub tolerance: f64,
    /// Most corrections in one step.
    pub max_iterations: usize,
}

/// A residual that is not below this fraction of the one before calls for a new factorization, if that is as much work as a correction.
/// A factorization that is more must save more corrections: the fraction grows with its work, up to [`SLOWEST`], unless the corrections
/// that are allowed would not suffice.
const SLOW: f64 = 0.05;
const SLOWEST: f64 = 0.2;
/// A residual expected to be below this fraction of the tolerance is not evaluated.
const SURE: f64 = 0.1;
/// A residual is not expected to fall below this fraction of the one before: the first one falls further, as a prediction's does.
const FASTEST: f64 = 1e-3;
/// A correction that is not below this fraction of the one before makes no progress.
const STAGNANT: f64 = 0.5;
/// Corrections of the coordinates below this fraction of the largest of them are rounding.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Finds `a` with `r(t, q, v, a) = load` where `q` and `v` depend on `a` linearly:
/// `q(a + x) = q(a) + w.position x`, `v(a + x) = v(a) + w.velocity x`.
///
/// Each correction solves `(∂r/∂a + w.velocity ∂r/∂v + w.position ∂r/∂q) x = load − r`. The matrix is factored at the prediction, or
/// was at an earlier one of the same step with the same weights, and kept as long as the residual falls fast.
#[derive(Debug, Clone)]
pub(super) struct Newton {
    settings: NewtonSettings,
    /// Corrections of a stage of fixed cost; `None` iterates to the tolerance.
    pub(super) fixed: Option<FixedCost>,
    /// Target of the residual: a load that the system does not know of.
    pub(super) load: Vec<f64>,
    residual: Vec<f64>,
    correction: Vec<f64>,
    /// The weights of this step's last factors.
    factored: Option<Weights>,
}

/// The trial values: coordinates, velocities and accelerations at the point of collocation.
pub(super) struct Trial<'a> {
    pub(super) q: &'a mut [f64],
    pub(super) v: &'a mut [f64],
    pub(super) a: &'a mut [f64],
}

impl Newton {
    pub(super) fn new(degrees_of_freedom: usize, settings: NewtonSettings) -> Self {
        let zero = vec![0.0; degrees_of_freedom];
        Self { settings, fixed: None, load: zero.clone(), residual: zero.clone(), correction: zero, factored: None }
    }

    /// Begins a step, which owes nothing to the one before.
    pub(super) fn begin_step(&mut self) {
        self.factored = None;
    }

    /// Iterates from the prediction in `trial`, which is corrected at least once, so that a linear system is solved to rounding
    /// whatever the tolerance. Converged when the residual is within tolerance, or by its geometric progression is expected to be
    /// after a second or later correction (Hairer & Wanner, *Solving Ordinary Differential Equations II*, IV.8); or when corrections
    /// no longer shrink and are rounding in the coordinates, so that no iteration could do better.
    pub(super) fn solve<S: System>(
        &mut self,
        system: &mut S,
        t_s: f64,
        w: Weights,
        trial: &mut Trial<'_>,
    ) -> Result<Effort, StepError> {
        if let Some(fixed) = self.fixed.filter(|_| !trial.a.is_empty()) {
            return self.correct_exactly(fixed, system, t_s, w, trial);
        }
        let mut effort = Effort::default();
        let slow = (SLOW * system.factor_over_correction()).min(SLOWEST);
        let (mut last_size, mut last_correction) = (f64::INFINITY, f64::INFINITY);
        loop {
            self.evaluate(system, t_s, trial)?;
            effort.residuals += 1;
            let size = system.residual_size(&self.correction);
            let corrected = effort.newton_iterations > 0 || largest(&self.correction) == 0.0;
            if trial.a.is_empty() || size <= self.settings.tolerance && corrected {
                return Ok(effort);
            }
            let left = self.settings.max_iterations.saturating_sub(effort.newton_iterations as usize);
            if left == 0 {
                return Err(StepError::NotConverged { residual: size, iterations: effort.newton_iterations });
            }
            let ratio = size / last_size;
            let too_slow = ratio > slow || ratio > SLOW && size * ratio.powi(left as i32) > self.settings.tolerance;
            if self.factored != Some(w) || too_slow {
                self.factor(system, t_s, w, trial)?;
                effort.factorizations += 1;
            }
            system.solve(&mut self.correction);
            all_finite(&self.correction)?;
            let correction = largest(&self.correction);
            if correction >= STAGNANT * last_correction && w.position * correction <= ROUNDING * largest(trial.q) {
                return Ok(effort);
            }
            self.correct(w, trial);
            effort.newton_iterations += 1;
            if effort.newton_iterations > 1 && size * (size / last_size).max(FASTEST) <= SURE * self.settings.tolerance {
                return Ok(effort);
            }
            (last_size, last_correction) = (size, correction);
        }
    }

    /// Makes the fixed number of corrections, with one matrix a step. The scheme judges the residual that is left.
    fn correct_exactly<S: System>(
        &mut self,
        fixed: FixedCost,
        system: &mut S,
        t_s: f64,
        w: Weights,
        trial: &mut Trial<'_>,
    ) -> Result<Effort, StepError> {
        let mut effort = Effort::default();
        for _ in 0..fixed.corrections {
            self.evaluate(system, t_s, trial)?;
            effort.residuals += 1;
            if self.factored != Some(w) {
                self.factor(system, t_s, w, trial)?;
                effort.factorizations += 1;
            }
            system.solve(&mut self.correction);
            all_finite(&self.correction)?;
            self.correct(w, trial);
            effort.newton_iterations += 1;
        }
        Ok(effort)
    }

    /// Size of the residual that the last correction left, relative to the forces at work; 0 if that correction was rounding in the
    /// coordinates. `residual` is the one last evaluated by `system`, at the coordinates `q`.
    ///
    /// # Errors
    /// [`StepError::NotConverged`] if so much is left that nothing was solved.
    pub(super) fn left_over<S: System>(&mut self, system: &S, residual: &[f64], q: &[f64]) -> Result<f64, StepError> {
        let (Some(fixed), Some(w)) = (self.fixed, self.factored) else { return Ok(0.0) };
        if w.position * largest(&self.correction) <= ROUNDING * largest(q) {
            return Ok(0.0);
        }
        for (i, left) in self.residual.iter_mut().enumerate() {
            *left = residual[i] - self.load[i];
        }
        let size = system.residual_size(&self.residual);
        if size <= FixedCost::LOST {
            return Ok(size);
        }
        Err(StepError::NotConverged { residual: size, iterations: u32::try_from(fixed.corrections).unwrap_or(u32::MAX) })
    }

    /// Factors the matrix at the trial values; without factors if that fails.
    fn factor<S: System>(&mut self, system: &mut S, t_s: f64, w: Weights, trial: &Trial<'_>) -> Result<(), StepError> {
        self.factored = None;
        system.factor(t_s, trial.q, trial.v, trial.a, w)?;
        self.factored = Some(w);
        Ok(())
    }

    /// Evaluates the residual less its target, into `correction`.
    fn evaluate<S: System>(&mut self, system: &mut S, t_s: f64, trial: &Trial<'_>) -> Result<(), StepError> {
        system.residual(t_s, trial.q, trial.v, trial.a, &mut self.residual);
        for (x, (residual, load)) in self.correction.iter_mut().zip(self.residual.iter().zip(&self.load)) {
            *x = residual - load;
        }
        all_finite(&self.correction)
    }

    fn correct(&self, w: Weights, trial: &mut Trial<'_>) {
        let values = trial.q.iter_mut().zip(trial.v.iter_mut()).zip(trial.a.iter_mut());
        for (((q, v), a), x) in values.zip(&self.correction) {
            *q -= w.position * x;
            *v -= w.velocity * x;
            *a -= x;
        }
    }
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most, x| x.abs().max(most))
}
