//! The error of a step in which the acceleration has a corner, as under a load that is linear in pieces.
//!
//! With a corner at the part s of a step of h, 0 to 1, and the jump J of da/dt there,
//!
//! ```text
//! a(t + x) = smooth + J max(0, x − s h)      v(t + x) = smooth + ½ J max(0, x − s h)²
//! ```
//!
//! A scheme samples the acceleration at a few places and does not see where between them the corner lies. So its rate errs by
//! `J h² E(s)`, of second order whatever its own, and the angle goes on erring with it. The angle's own error in the step is `J h³`, less
//! by a factor of h over the time that follows. A corner of a function of the angle is passed where that angle is reached, which the scheme
//! knows to `h²`: to leading order E is the same.
//!
//! Error terms for smooth motion see a corner as well, as a da/dt that changes. E is what they leave out, so that both add up to the error.
//! Over s it is 0 on average, but for the two-point method.

/// E(s) of a quadrature with stages at places c and of weights b: `Σ bᵢ max(0, cᵢ − s) − ½ (1 − s)²`. Of Runge–Kutta methods it is that of
/// the rate: before the corner the stages agree with the smooth motion, and after the step with the motion beyond the corner.
pub(super) fn of_quadrature(stages: impl IntoIterator<Item = (f64, f64)>, part: f64) -> f64 {
    let found: f64 = stages.into_iter().map(|(place, weight)| weight * (place - part).max(0.0)).sum();
    found - 0.5 * (1.0 - part).powi(2)
}

#[cfg(test)]
mod tests {
    use crate::integrate::{
        ErrorTerm, Esdirk, FixedCost, GeneralizedAlpha, Integrator, NewtonSettings, RungeKutta, Singular, State, StepError,
        System, TwoPoint, Weights,
    };

    const SETTINGS: NewtonSettings = NewtonSettings { tolerance: 1e-12, max_iterations: 20 };
    const STEP_S: f64 = 1.0 / 8192.0;
    /// Steps before the corner's, and all of them.
    const BEFORE: i32 = 3;
    const STEPS: i32 = 63;
    /// Exact in binary, as the step is.
    const PARTS: [f64; 8] = [0.0, 0.0625, 0.25, 0.4375, 0.5, 0.6875, 0.9375, 1.0];

    /// `θ̈ = max(0, x) + load`, where x is the time or the angle, and J = 1.
    #[derive(Default)]
    struct Bent {
        of_angle: bool,
        load: f64,
        at_work: f64,
        mass: f64,
    }

    impl System for Bent {
        fn degrees_of_freedom(&self) -> usize {
            1
        }
        fn residual(&mut self, t_s: f64, q: &[f64], _: &[f64], a: &[f64], r: &mut [f64]) {
            let x = if self.of_angle { q[0] } else { t_s };
            let force = x.max(0.0) + self.load;
            self.at_work = a[0].abs() + force.abs();
            r[0] = a[0] - force;
        }
        fn residual_size(&self, r: &[f64]) -> f64 {
            if r[0] == 0.0 { 0.0 } else { r[0].abs() / self.at_work }
        }
        fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
            self.mass = w.acceleration;
            Ok(())
        }
        fn solve(&mut self, x: &mut [f64]) {
            x[0] /= self.mass;
        }
    }

    fn schemes() -> Vec<(String, Integrator)> {
        let mut all = vec![
            ("Runge–Kutta".to_owned(), Integrator::RungeKutta(RungeKutta::new(1))),
            ("ESDIRK".to_owned(), Integrator::Esdirk(Esdirk::new(1, SETTINGS))),
        ];
        for rho in [0.0, 0.5, 0.8, 1.0] {
            let scheme = GeneralizedAlpha::new(1, rho, SETTINGS);
            all.push((format!("generalised-α {rho}"), Integrator::GeneralizedAlpha(scheme)));
        }
        for weight in [0.0, 0.3, 0.5, 0.7, 1.0] {
            all.push((format!("two-point {weight}"), Integrator::TwoPoint(TwoPoint::new(1, weight, SETTINGS))));
        }
        all
    }

    /// The rate's error long after a corner at the part of a step, less the sum of the terms for smooth motion, over `J h²`; and the one
    /// predicted. A load begins with the corner's step.
    fn errors(integrator: &Integrator, of_angle: bool, part: f64, load: f64) -> Result<[f64; 2], StepError> {
        let start_s = -(f64::from(BEFORE) + part) * STEP_S;
        let (angle, rate) = if of_angle { (start_s, 1.0) } else { (0.0, 0.0) };
        let (mut integrator, mut state) = (integrator.clone(), State::new(vec![angle], vec![rate]));
        let mut system = Bent { of_angle, ..Bent::default() };
        integrator.begin(&mut system, start_s, STEP_S, &mut state)?;
        let (mut smooth, mut left, mut predicted) = (0.0, 0.0, 0.0);
        for n in 0..STEPS {
            if n == BEFORE {
                system.load = load;
            }
            integrator.step(&mut system, start_s + f64::from(n) * STEP_S, STEP_S, &mut state)?;
            if n == BEFORE {
                predicted = integrator.corner_error(part);
            }
            smooth += match integrator.local_error(STEP_S).v {
                ErrorTerm::Direct(vector, factor) => factor * vector[0],
                ErrorTerm::Difference(vector, factor, _) => {
                    let change = vector[0] - left;
                    left = vector[0];
                    factor * change
                }
            };
        }
        let after_s = start_s + f64::from(STEPS) * STEP_S;
        let truth = if of_angle { after_s.cosh() } else { 0.5 * after_s * after_s + load * f64::from(STEPS - BEFORE) * STEP_S };
        Ok([(state.v[0] - truth - smooth) / (STEP_S * STEP_S), predicted])
    }

    #[test]
    fn val_a_corner_in_time_leaves_the_error_predicted() -> Result<(), StepError> {
        for (name, integrator) in schemes() {
            for part in PARTS {
                let [found, predicted] = errors(&integrator, false, part, 0.0)?;
                assert!((found - predicted).abs() < 1e-7, "{name} at {part}: {found} {predicted}");
            }
        }
        Ok(())
    }

    /// As the crank passes a corner of the slider's resistance.
    #[test]
    fn val_a_corner_at_an_angle_leaves_the_error_predicted() -> Result<(), StepError> {
        for (name, integrator) in schemes() {
            for part in PARTS {
                let [found, predicted] = errors(&integrator, true, part, 0.0)?;
                assert!((found - predicted).abs() < 1e-3, "{name} at {part}: {found} {predicted}");
            }
        }
        Ok(())
    }

    /// Where the load jumps ESDIRK takes the step by other methods.
    #[test]
    fn val_a_corner_in_a_step_with_a_jump_leaves_the_error_predicted() -> Result<(), StepError> {
        let esdirk = Integrator::Esdirk(Esdirk::new(1, SETTINGS));
        let fixed = esdirk.clone().with_fixed_cost(Some(FixedCost { corrections: 1 }));
        for (name, integrator) in [("in two", esdirk), ("fixed cost", fixed)] {
            for part in PARTS {
                let [found, predicted] = errors(&integrator, false, part, 1.0)?;
                assert!((found - predicted).abs() < 1e-6, "{name} at {part}: {found} {predicted}");
            }
        }
        Ok(())
    }

    #[test]
    fn prop_corners_all_over_the_step_cancel() {
        for (name, integrator) in schemes().into_iter().filter(|(_, scheme)| !matches!(scheme, Integrator::TwoPoint(_))) {
            let mean = (0..1000).map(|k| integrator.corner_error((f64::from(k) + 0.5) / 1000.0)).sum::<f64>() / 1000.0;
            assert!(mean.abs() < 1e-6, "{name}: {mean:e}");
        }
    }
}
