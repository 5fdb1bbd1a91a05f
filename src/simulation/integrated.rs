//! Models that are second-order systems, advanced by one of the integrators.

use super::drive::DriveLaw;
use super::engine::{Engine, Ledger};
use crate::integrate::{Effort, Integrator, Singular, State, StepError, System, Weights, solve_acceleration};
use crate::mechanics::{self, Energy, Mechanism, NoEquilibrium, Observation};

/// Largest part of the velocities that a step gives or takes for the energy's sake: what asks for more is no error of high order. The
/// rest is left to the steps that follow, and the ledger shows it until they have taken it.
const LARGEST_SHARE: f64 = 0.005;
/// Energies below this part of what is there are rounding.
const ROUNDING: f64 = 1e-12;
/// What a share so small leaves is not worth another look at the energy.
const LITTLE: f64 = 1e-9;
/// Corrections of a step's energy at most.
const CORRECTIONS: usize = 5;

/// A mechanism, its integrator and their state.
pub(super) struct Integrated<M> {
    mechanism: M,
    integrator: Integrator,
    state: State,
    start: State,
    before: State,
    middle: State,
}

/// A mechanism under a drive, as the integrators see it.
struct Driven<'a, M> {
    mechanism: &'a mut M,
    law: &'a DriveLaw,
}

impl<M: Mechanism> System for Driven<'_, M> {
    fn degrees_of_freedom(&self) -> usize {
        self.mechanism.degrees_of_freedom()
    }
    #[inline]
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.mechanism.residual(&self.law.input(t_s), q, v, a, r);
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        self.mechanism.residual_size(r)
    }
    #[inline]
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        let weights = mechanics::Weights { acceleration: w.acceleration, velocity: w.velocity, position: w.position };
        self.mechanism.factor(&self.law.input(t_s), q, v, a, weights).map_err(|mechanics::Singular| Singular)
    }
    fn solve(&mut self, x: &mut [f64]) {
        self.mechanism.solve(x);
    }
}

impl<M: Mechanism> Integrated<M> {
    pub(super) fn new(mut mechanism: M, integrator: Integrator, law: &DriveLaw) -> Result<Self, NoEquilibrium> {
        let n = mechanism.degrees_of_freedom();
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        mechanism.start(&law.input(0.0), &mut q, &mut v)?;
        let start = State::new(q, v);
        Ok(Integrated { mechanism, integrator, state: start.clone(), before: start.clone(), middle: start.clone(), start })
    }

    /// Work of the step by Simpson's rule, its middle state by cubic Hermite interpolation:
    /// `q_m = (q₀ + q₁)/2 + h (v₀ − v₁)/8`, `v_m = 3 (q₁ − q₀)/(2h) − (v₀ + v₁)/4`. Exact where power is a constant times a
    /// rate, as a torque's is; otherwise of fourth order.
    fn work(&mut self, law: &DriveLaw, t_s: f64, h_s: f64) -> Ledger {
        let Integrated { mechanism, state: after, before, middle, .. } = self;
        for i in 0..middle.q.len() {
            let (q0, q1, v0, v1) = (before.q[i], after.q[i], before.v[i], after.v[i]);
            middle.q[i] = 0.5 * (q0 + q1) + 0.125 * h_s * (v0 - v1);
            middle.v[i] = 1.5 * (q1 - q0) / h_s - 0.25 * (v0 + v1);
        }
        let mut power = |t_s: f64, at: &State| mechanism.power(&law.input(t_s), &at.q, &at.v, &after.a);
        let first = power(t_s, before);
        let halfway = power(t_s + 0.5 * h_s, middle);
        let last = power(t_s + h_s, after);
        let [put_in, dissipated] = [0, 1].map(|k| h_s * (first[k] + 4.0 * halfway[k] + last[k]) / 6.0);
        let by_rates = 0.5 * h_s * (first[0] + last[0]);
        [put_in, dissipated, put_in.abs().max(by_rates.abs())]
    }

    /// Brings the state at `t_s` back to the surface `E(q, v) = E` of the energy that the ledger asks for (Hairer, Lubich & Wanner,
    /// *Geometric Numerical Integration*, IV.4), with velocities and strains sharing what is to be given or taken:
    ///
    /// ```text
    /// q ← q − λ τ² x,   v ← v − λ v,   dE/dλ ≈ −(2T + τ² g·x)     S x = g
    /// ```
    ///
    /// with the kinetic energy T, homogeneous of second degree; g is the residual at rest, and S the matrix that the step factored
    /// last, `M + ½h′D + ¼h′²K` of a part h′ of it, by which a vibration too fast for the step gives 4τ²/h′² of λ at most. So strains
    /// give near standstill, where no scaling of velocities takes anything. `τ² = 2U/(g·x)` with the strain energy U scales a single
    /// vibration as its velocity, but is no more than h². The slope leaves out what q changes of T, and takes the loads that g has
    /// and E has not (resistance) for forces that have a potential: so λ is sought by looks at the energy. An excess of order p + 1
    /// in the step moves the state by no more, so the scheme keeps its order p. What one step could not take is part of the next
    /// one's excess.
    fn project(&mut self, law: &DriveLaw, t_s: f64, h_s: f64, energy_j: f64) {
        let Integrated { mechanism, state, middle, .. } = self;
        let State { q: q0, v: v0, a: pull, alpha: still, residual: gradient } = middle;
        let input = law.input(t_s);
        let there = mechanism.energy(&input, &state.q, &state.v, &state.a);
        let mut excess_j = there.total_j() - energy_j;
        if excess_j.abs() <= ROUNDING * size_j(&there) {
            return;
        }
        q0.copy_from_slice(&state.q);
        v0.copy_from_slice(&state.v);
        still.fill(0.0);
        Driven { mechanism: &mut *mechanism, law: &DriveLaw::none() }.residual(t_s, q0, still, still, gradient);
        pull.copy_from_slice(gradient);
        mechanism.solve(pull);
        let along: f64 = gradient.iter().zip(pull.iter()).map(|(g, x)| g * x).sum();
        // Nil where nothing strains, or where what strains is about to buckle.
        let square_s2 = (2.0 * there.strain_j.unwrap_or(0.0) / along).max(0.0).min(h_s * h_s);
        let slope_j = 2.0 * there.kinetic_j + square_s2 * along;
        let mut share = 0.0;
        for _ in 0..CORRECTIONS {
            let more = excess_j / slope_j;
            // Nothing to give, or no energy to be told.
            if !more.is_finite() {
                return;
            }
            share = (share + more).clamp(-LARGEST_SHARE, LARGEST_SHARE);
            for i in 0..q0.len() {
                state.q[i] = q0[i] - share * square_s2 * pull[i];
                state.v[i] = v0[i] - share * v0[i];
            }
            if more.abs() <= LITTLE {
                return;
            }
            excess_j = mechanism.energy(&input, &state.q, &state.v, pull).total_j() - energy_j;
        }
    }
}

/// How much energy there is, wherever potential energy is counted from.
fn size_j(energy: &Energy) -> f64 {
    energy.kinetic_j + energy.strain_j.unwrap_or(0.0) + energy.potential_j.unwrap_or(0.0).abs()
}

impl<M: Mechanism> Engine for Integrated<M> {
    fn reset(&mut self) {
        self.state.clone_from(&self.start);
    }

    fn step(&mut self, law: &DriveLaw, t_s: f64, h_s: f64, energy_j: f64) -> Result<(Effort, Ledger), StepError> {
        self.before.q.copy_from_slice(&self.state.q);
        self.before.v.copy_from_slice(&self.state.v);
        let mut system = Driven { mechanism: &mut self.mechanism, law };
        let effort = self.integrator.step(&mut system, t_s, h_s, &mut self.state)?;
        let ledger = self.work(law, t_s, h_s);
        // What was taken without factors was taken at rest.
        if self.integrator.is_projected() && !law.is_motion() && effort.factorizations > 0 {
            self.project(law, t_s + h_s, h_s, energy_j + ledger[0] - ledger[1]);
        }
        Ok((effort, ledger))
    }

    fn observe(&mut self, law: &DriveLaw, t_s: f64, out: &mut Observation) -> Result<(), StepError> {
        let State { q, v, .. } = &self.state;
        let (acceleration, scratch) = (&mut self.middle.a, &mut self.middle.alpha);
        solve_acceleration(&mut Driven { mechanism: &mut self.mechanism, law }, t_s, q, v, acceleration, scratch)?;
        self.mechanism.observe(&law.input(t_s), q, v, acceleration, out);
        Ok(())
    }

    fn save(&self, out: &mut Vec<f64>) {
        let State { q, v, a, alpha, residual } = &self.state;
        [q, v, a, alpha, residual].iter().for_each(|part| out.extend_from_slice(part));
    }

    fn restore(&mut self, saved: &[f64]) -> bool {
        let n = self.state.q.len();
        if saved.len() != 5 * n {
            return false;
        }
        let State { q, v, a, alpha, residual } = &mut self.state;
        for (part, saved) in [q, v, a, alpha, residual].into_iter().zip(saved.chunks_exact(n.max(1))) {
            part.copy_from_slice(saved);
        }
        true
    }
}
