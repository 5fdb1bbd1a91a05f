//! Diagonally implicit Runge–Kutta methods on a second-order system, one stage at a time.

use super::corner::of_quadrature;
use super::newton::{Newton, NewtonSettings, Trial};
use super::system::{Effort, State, StepError, System, Weights};

/// A method of `N` stages:
///
/// ```text
/// Qᵢ = q₀ + h Σⱼ aᵢⱼ Vⱼ      Vᵢ = v₀ + h Σⱼ aᵢⱼ Aⱼ      r(t + cᵢ h, Qᵢ, Vᵢ, Aᵢ) = 0      q₁ = Q_N,  v₁ = V_N
/// ```
pub(super) struct Tableau<const N: usize> {
    /// Places of the stages in the step.
    pub(super) c: [f64; N],
    /// Weights of the stages before, a row for each stage.
    pub(super) a: [[f64; N]; N],
    /// Weights of the step, equal to those of the last stage.
    pub(super) b: [f64; N],
    /// `aᵢᵢ` of every implicit stage, so that all of them share one tangent.
    pub(super) gamma: f64,
    /// Weights with which the accelerations of the stages before predict those of a stage.
    pub(super) predicted: [[f64; N]; N],
}

impl<const N: usize> Tableau<N> {
    /// Weights of Newton's tangent, the same in every stage.
    pub(super) fn weights(&self, h_s: f64) -> Weights {
        Weights { acceleration: 1.0, velocity: self.gamma * h_s, position: (self.gamma * h_s).powi(2) }
    }

    /// Error of the velocity by a corner of the acceleration at `part` of the step, over `J h²`.
    pub(super) fn corner_error(&self, part: f64) -> f64 {
        of_quadrature(self.c.into_iter().zip(self.b), part)
    }
}

/// Predictions that give each stage the velocity of the stage before: `γ a = Σⱼ (aᵢ₋₁ⱼ − aᵢⱼ) Aⱼ`, all `aᵢᵢ` being γ but the first, which
/// is `first`.
pub(super) const fn of_kept_velocity<const N: usize>(a: &[[f64; N]; N], gamma: f64, first: f64) -> [[f64; N]; N] {
    let mut weights = [[0.0; N]; N];
    let mut i = 1;
    while i < N {
        let mut j = 0;
        while j < i {
            let before = match (j + 1 == i, j) {
                (false, _) => a[i - 1][j],
                (true, 0) => first,
                (true, _) => gamma,
            };
            weights[i][j] = (before - a[i][j]) / gamma;
            j += 1;
        }
        i += 1;
    }
    weights
}

/// Predictions by the parabola through the last three stages before, and by a line for the third stage: Lagrange's weights at its place.
pub(super) const fn by_parabolas<const N: usize>(c: &[f64; N]) -> [[f64; N]; N] {
    let mut weights = [[0.0; N]; N];
    let mut i = 2;
    while i < N {
        let first = i.saturating_sub(3);
        let mut j = first;
        while j < i {
            let (mut weight, mut k) = (1.0, first);
            while k < i {
                if k != j {
                    weight *= (c[i] - c[k]) / (c[j] - c[k]);
                }
                k += 1;
            }
            weights[i][j] = weight;
            j += 1;
        }
        i += 1;
    }
    weights
}

/// The stages of a step.
#[derive(Debug, Clone)]
pub(super) struct Stages {
    pub(super) newton: Newton,
    /// Velocities of the stages, one stage after the other.
    pub(super) all_v: Vec<f64>,
    /// Accelerations of the stages, one stage after the other.
    pub(super) all_a: Vec<f64>,
    /// Coordinates, velocities and accelerations of the stage that is solved for.
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) a: Vec<f64>,
}

impl Stages {
    /// For `degrees_of_freedom` unknowns and methods of at most `most` stages.
    pub(super) fn new(degrees_of_freedom: usize, most: usize, settings: NewtonSettings) -> Self {
        let (zero, stages) = (vec![0.0; degrees_of_freedom], vec![0.0; most * degrees_of_freedom]);
        Self {
            newton: Newton::new(degrees_of_freedom, settings),
            all_v: stages.clone(),
            all_a: stages,
            q: zero.clone(),
            v: zero.clone(),
            a: zero,
        }
    }

    /// Predicts a stage of a step from `state`: by the accelerations of the stages before, or by those of `guess`.
    pub(super) fn predict<const N: usize>(
        &mut self,
        method: &Tableau<N>,
        stage: usize,
        h_s: f64,
        state: &State,
        guess: Option<&[f64]>,
    ) {
        let n = self.q.len();
        let own = method.gamma * h_s;
        let (weights, predicted) = (&method.a[stage][..stage], &method.predicted[stage][..stage]);
        for i in 0..n {
            let (mut q, mut v, mut a) = (0.0, 0.0, 0.0);
            for (j, (weight, predicted)) in weights.iter().zip(predicted).enumerate() {
                let (stage_v, stage_a) = (self.all_v[j * n + i], self.all_a[j * n + i]);
                q += weight * stage_v;
                v += weight * stage_a;
                a += predicted * stage_a;
            }
            self.a[i] = guess.map_or(a, |guess| guess[i]);
            self.v[i] = state.v[i] + h_s * v + own * self.a[i];
            self.q[i] = state.q[i] + h_s * q + own * self.v[i];
        }
    }

    /// Solves for the stage predicted, and stores it.
    ///
    /// # Errors
    /// See [`StepError`].
    pub(super) fn solve<S: System>(
        &mut self,
        system: &mut S,
        stage: usize,
        at_s: f64,
        weights: Weights,
    ) -> Result<Effort, StepError> {
        let mut trial = Trial { q: &mut self.q, v: &mut self.v, a: &mut self.a };
        let effort = self.newton.solve(system, at_s, weights, &mut trial)?;
        let place = stage * self.q.len()..(stage + 1) * self.q.len();
        self.all_v[place.clone()].copy_from_slice(&self.v);
        self.all_a[place].copy_from_slice(&self.a);
        Ok(effort)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_kept_velocity_is_that_of_the_stage_before() {
        let (a, gamma) = ([[0.0; 4], [0.3, 0.0, 0.0, 0.0], [-0.2, 0.7, 0.0, 0.0], [0.4, -0.6, 0.9, 0.0]], 0.25);
        let accelerations = [3.0, -5.0, 7.0, 2.0];
        for first in [0.0, gamma] {
            let predicted = of_kept_velocity(&a, gamma, first);
            let velocity = |stage: usize, own: f64| {
                let before: f64 = (0..stage).map(|j| a[stage][j] * accelerations[j]).sum();
                before + if stage == 0 { first } else { gamma } * own
            };
            for stage in 1..4 {
                let own: f64 = (0..stage).map(|j| predicted[stage][j] * accelerations[j]).sum();
                assert!((velocity(stage, own) - velocity(stage - 1, accelerations[stage - 1])).abs() < 1e-13, "stage {stage}");
            }
        }
    }
}
