//! The implicit midpoint rule composed to fourth order: for small errors, and energy kept over long times.

use super::newton::NewtonSettings;
use super::system::{Effort, State, StepError, System};
use super::two_point::TwoPoint;

/// Suzuki's composition (Phys. Lett. A 146, 1990; Hairer, Lubich & Wanner, Geometric Numerical Integration, II.4) of the
/// [`TwoPoint`] method with ϑ = ½, which is symmetric and of second order: five steps of it,
///
/// ```text
/// γ h, γ h, (1 − 4γ) h, γ h, γ h     γ = 1/(4 − ∛4) ≈ 0.414     4γ³ + (1 − 4γ)³ = 0
/// ```
///
/// the third backwards. The condition on the cubes takes the error of third order away; symmetry that of fourth. Each part is
/// unconditionally stable on undamped linear systems and keeps quadratic invariants, so the whole does; of the midpoint rule's
/// error in phase, `z³/12` at `z = hω`, it leaves `9.3·10⁻⁴ z⁵`. Like its parts it damps nothing: what the step does not resolve
/// goes on ringing. Per eigenvalue μ, `g = Π (1 + γᵢ h μ/2)/(1 − γᵢ h μ/2)`.
///
/// Composed of steps that are symmetric but, where the mass matrix changes, not symplectic, it lets the energy of strongly vibrating
/// chains wander (the default scene undamped, with 1 and 3 modes, at 1 ms: by 1.7e-3 of what was put in, within 10 minutes). So a
/// simulation projects every whole step back onto the energy that its ledger asks for
/// ([`Integrator::is_projected`](super::Integrator)), which leaves 2e-11 there. It moves the state by no more than the error of the
/// step.
///
/// A load constant during the step, or one that rises linearly about the step's middle, delivers its impulse exactly.
#[derive(Debug, Clone)]
pub struct ComposedMidpoint {
    midpoint: TwoPoint,
    trial: State,
}

/// `1/(4 − ∛4)`.
const GAMMA: f64 = 0.414_490_771_794_375_7;
/// The parts of a step.
const PARTS: [f64; 5] = [GAMMA, GAMMA, 1.0 - 4.0 * GAMMA, GAMMA, GAMMA];

impl ComposedMidpoint {
    /// For `degrees_of_freedom` unknowns.
    pub fn new(degrees_of_freedom: usize, settings: NewtonSettings) -> Self {
        let zero = vec![0.0; degrees_of_freedom];
        Self { midpoint: TwoPoint::new(degrees_of_freedom, 0.5, settings), trial: State::new(zero.clone(), zero) }
    }

    /// Advances `state` from `t_s` to `t_s + h_s`.
    ///
    /// # Errors
    /// See [`StepError`]; the state is then as it was.
    pub fn step<S: System>(&mut self, system: &mut S, t_s: f64, h_s: f64, state: &mut State) -> Result<Effort, StepError> {
        self.trial.copy_from(state);
        self.midpoint.begin_step();
        let mut effort = Effort::default();
        let (mut done, mut before) = (0.0, PARTS[4]);
        for part in PARTS {
            let own = self.midpoint.step_after(before * h_s, system, t_s + done * h_s, part * h_s, &mut self.trial)?;
            effort.newton_iterations += own.newton_iterations;
            effort.factorizations += own.factorizations;
            done += part;
            before = part;
        }
        std::mem::swap(&mut self.trial, state);
        Ok(effort)
    }
}
