//! Laws: conserved quantities, exact impulses, resuming bit for bit.

use crate::problems::{Crank, Linear, SpringPendulum, esdirk, generalized_alpha, run, runge_kutta, two_point};
use flexcrank::integrate::{GeneralizedAlpha, Integrator, NewtonSettings, Singular, State, System, TwoPoint, Weights};
use nalgebra::{DMatrix, DVector};

fn exact_impulse_schemes(n: usize) -> Vec<Integrator> {
    let mut all = vec![runge_kutta(n), esdirk(n)];
    all.extend([0.0, 0.3, 0.5, 0.9, 1.0].map(|weight| two_point(n, weight)));
    all
}

fn schemes(n: usize) -> Vec<Integrator> {
    let mut all = exact_impulse_schemes(n);
    all.extend([0.0, 0.5, 0.8, 1.0].map(|rho| generalized_alpha(n, rho)));
    all
}

#[test]
fn prop_midpoint_conserves_energy_of_an_oscillator() {
    // Rounding enters with ε ωh a step: `q` is found by cancellation from `v₀ + ½h a`.
    for (omega_h, bound) in [(1e-3, 1e-11), (0.7, 1e-11), (30.0, 1e-11), (1e4, 1e-9)] {
        let mut state = State::new(vec![1.0], vec![0.3 * omega_h]);
        let energy = |state: &State| 0.5 * state.v[0].powi(2) + 0.5 * (omega_h * state.q[0]).powi(2);
        let before = energy(&state);
        run(&mut two_point(1, 0.5), &mut Linear::oscillator(omega_h, 0.0), 1.0, 10_000, &mut state, |_, _, _| {}).unwrap();
        let error = energy(&state) / before - 1.0;
        assert!(error.abs() < bound, "ωh {omega_h}: {error:e}");
    }
}

#[test]
fn prop_midpoint_conserves_angular_momentum_and_bounds_energy() {
    let mut system = SpringPendulum::new(1e4);
    let mut state = State::new(vec![1.01, 0.0], vec![0.0, 2.0]);
    let (momentum, energy) = (SpringPendulum::angular_momentum(&state), system.energy(&state));
    let mut worst = [0.0_f64; 2];
    for half in &mut worst {
        for _ in 0..20 {
            run(&mut two_point(2, 0.5), &mut system, 1e-3, 2500, &mut state, |_, _, _| {}).unwrap();
            *half = half.max((system.energy(&state) / energy - 1.0).abs());
        }
    }
    assert!((SpringPendulum::angular_momentum(&state) / momentum - 1.0).abs() < 1e-10);
    assert!(worst[0] < 1e-3 && worst[1] < 1.5 * worst[0], "{worst:?}");
}

fn free_masses() -> Linear {
    let none = DMatrix::zeros(2, 2);
    Linear::new(DMatrix::from_row_slice(2, 2, &[2.0, 0.4, 0.4, 1.0]), none.clone(), none, DVector::zeros(2))
}

/// Momentum less the impulse given so far, after each of 100 steps: 50 with loads that come and go, then a constant one.
fn impulse_errors(integrator: &mut Integrator) -> Vec<f64> {
    let (mut system, mut state, mut impulse) = (free_masses(), State::new(vec![0.0; 2], vec![0.0; 2]), DVector::zeros(2));
    let step = |n: u32| {
        let load = match n {
            50.. => [1.0, -2.0],
            _ if n % 7 < 3 => [f64::from(n) - 20.0, 3.0],
            _ => [0.0, 0.0],
        };
        system.load = DVector::from_row_slice(&load);
        impulse += 0.01 * &system.load;
        integrator.step(&mut system, 0.01 * f64::from(n), 0.01, &mut state).unwrap();
        (&system.mass * DVector::from_row_slice(&state.v) - &impulse).amax()
    };
    (0..100).map(step).collect()
}

#[test]
fn prop_impulse_arrives_exactly_within_its_step() {
    for mut integrator in exact_impulse_schemes(2) {
        assert!(impulse_errors(&mut integrator).iter().all(|error| *error < 1e-13), "{integrator:?}");
    }
}

#[test]
fn prop_generalized_alpha_delivers_the_whole_impulse() {
    for rho in [0.0, 0.5, 0.8, 1.0] {
        let errors = impulse_errors(&mut generalized_alpha(2, rho));
        assert!(errors[99] < 1e-13, "ρ {rho}: {errors:?}");
    }
}

/// A pulse on a stiff rotating pendulum delivers its angular impulse, wherever its edges fall: to rounding by the midpoint
/// rule, to its own error in conserving angular momentum by generalised-α.
#[test]
fn prop_angular_impulse_on_a_stiff_pendulum() {
    for h_s in [0.01, 0.0037] {
        for (mut integrator, bound) in [(two_point(2, 0.5), 1e-13), (generalized_alpha(2, 0.8), 1e-6)] {
            let mut state = State::new(vec![1.0, 0.0], vec![0.0, 0.0]);
            let mut system = SpringPendulum::new(1e8);
            let impulse = |t: f64| 2.0 * (t.clamp(0.0123, 0.1123) - 0.0123);
            run(&mut integrator, &mut system, h_s, 200, &mut state, |system, t, h| {
                system.torque_nm = (impulse(t + h) - impulse(t)) / h;
            })
            .unwrap();
            let error = SpringPendulum::angular_momentum(&state) - 0.2;
            assert!(error.abs() < bound, "{error:e}");
        }
    }
}

#[test]
fn prop_a_copied_state_resumes_bit_for_bit() {
    for (fresh, mut integrator) in schemes(1).into_iter().zip(schemes(1)) {
        let torque = |crank: &mut Crank, t: f64, _: f64| crank.torque_nm = if t < 0.4 { 2.0 } else { (5.0 * t).sin() };
        let mut state = State::new(vec![0.1], vec![1.0]);
        let mut crank = Crank::default();
        for n in 0..77 {
            torque(&mut crank, f64::from(n) * 0.01, 0.01);
            integrator.step(&mut crank, f64::from(n) * 0.01, 0.01, &mut state).unwrap();
        }
        let (mut resumed, mut other, mut fresh) = (state.clone(), Crank::default(), fresh);
        for n in 77..200 {
            let t = f64::from(n) * 0.01;
            torque(&mut crank, t, 0.01);
            torque(&mut other, t, 0.01);
            integrator.step(&mut crank, t, 0.01, &mut state).unwrap();
            fresh.step(&mut other, t, 0.01, &mut resumed).unwrap();
        }
        assert_eq!([state.q[0], state.v[0]].map(f64::to_bits), [resumed.q[0], resumed.v[0]].map(f64::to_bits));
    }
}

#[test]
fn prop_conserved_energy_of_a_crank() {
    for (mut integrator, bound) in [(two_point(1, 0.5), 1e-5), (generalized_alpha(1, 0.9), 1e-3), (runge_kutta(1), 1e-6)] {
        let mut state = State::new(vec![0.0], vec![1.0]);
        run(&mut integrator, &mut Crank::default(), 2e-3, 100_000, &mut state, |_, _, _| {}).unwrap();
        let error = Crank::energy(state.q[0], state.v[0]) / Crank::energy(0.0, 1.0) - 1.0;
        println!("{error:e}");
        assert!(error.abs() < bound, "{error:e}");
    }
}

#[test]
fn prop_nothing_to_solve_is_no_work() {
    let empty = || DMatrix::zeros(0, 0);
    let mut system = Linear::new(empty(), empty(), empty(), DVector::zeros(0));
    for mut integrator in schemes(system.degrees_of_freedom()) {
        let mut state = State::new(Vec::new(), Vec::new());
        let effort = integrator.step(&mut system, 0.0, 0.1, &mut state).unwrap();
        assert_eq!(effort.effort.newton_iterations, 0);
    }
}

/// A step load on a vibration far too fast for the step: it settles at the static deflection and its velocity stays below the
/// true amplitude `p/ω`.
#[test]
fn prop_generalized_alpha_does_not_ring_under_a_step_load() {
    let omega = 1e4;
    for rho in [0.0, 0.5, 0.8, 0.9] {
        let mut integrator = generalized_alpha(1, rho);
        let mut system = Linear::oscillator(omega, 0.0);
        let mut state = State::new(vec![0.0], vec![0.0]);
        for n in 0..200 {
            system.load[0] = if n < 3 { 0.0 } else { 1.0 };
            integrator.step(&mut system, f64::from(n), 1.0, &mut state).unwrap();
            assert!(state.v[0].abs() < 1.0 / omega, "ρ {rho}, step {n}: {:e}", state.v[0]);
        }
        let settled = state.q[0] * omega * omega;
        assert!((settled - 1.0).abs() < 1e-6, "ρ {rho}: {settled}");
    }
}

/// Where rounding of a stiff force hides the tolerance, the step is still taken, and is as good as rounding allows.
#[test]
fn prop_rounding_is_accepted_where_no_iteration_could_do_better() {
    let settings = NewtonSettings { tolerance: 1e-16, max_iterations: 10 };
    let mut integrators = [
        Integrator::TwoPoint(TwoPoint::new(2, 0.5, settings)),
        Integrator::GeneralizedAlpha(GeneralizedAlpha::new(2, 0.8, settings)),
    ];
    for integrator in &mut integrators {
        let mut state = State::new(vec![0.6, 0.8], vec![-0.8, 0.6]);
        let mut system = SpringPendulum::new(1e12);
        run(integrator, &mut system, 1e-3, 2000, &mut state, |_, _, _| {}).unwrap();
        assert!((SpringPendulum::angular_momentum(&state) - 1.0).abs() < 1e-6, "{state:?}");
    }
}

/// A residual that the two before foretell to be small enough is not evaluated, and is.
#[test]
fn prop_foretold_residuals_are_within_tolerance() {
    let settings = NewtonSettings { tolerance: 1e-9, max_iterations: 10 };
    for h_s in [0.02, 0.05, 0.1, 0.2] {
        let mut system = Counting { pendulum: SpringPendulum::new(1e3), residuals: 0 };
        let mut state = State::new(vec![1.3, 0.0], vec![0.0, 2.0]);
        let (steps, mut r) = (500, [0.0; 2]);
        // Implicit Euler: it solves at the end of the step.
        let mut integrator = Integrator::TwoPoint(TwoPoint::new(2, 1.0, settings));
        let (mut corrections, mut evaluated) = (0, 0);
        for step in 0..steps {
            corrections += integrator.step(&mut system, f64::from(step) * h_s, h_s, &mut state).unwrap().effort.newton_iterations;
            evaluated += std::mem::take(&mut system.residuals);
            system.residual(0.0, &state.q, &state.v, &state.a, &mut r);
            let size = system.residual_size(&r);
            assert!(size <= settings.tolerance, "h {h_s}, step {step}: {size:e}");
            system.residuals = 0;
        }
        assert!(evaluated < corrections + steps, "h {h_s}: {evaluated} for {corrections}");
    }
}

/// A pendulum that counts how often its residual is asked for.
struct Counting {
    pendulum: SpringPendulum,
    residuals: u32,
}

impl System for Counting {
    fn degrees_of_freedom(&self) -> usize {
        self.pendulum.degrees_of_freedom()
    }
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.residuals += 1;
        self.pendulum.residual(t_s, q, v, a, r);
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        self.pendulum.residual_size(r)
    }
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.pendulum.factor(t_s, q, v, a, w)
    }
    fn solve(&mut self, x: &mut [f64]) {
        self.pendulum.solve(x);
    }
}

/// Effort frozen: a slowdown that no timing would show.
#[test]
fn regress_effort() {
    for (mut integrator, iterations, factorizations) in [(two_point(2, 0.5), 1638, 1000), (generalized_alpha(2, 0.8), 1173, 1000)]
    {
        let mut state = State::new(vec![1.001, 0.0], vec![0.0, 1.0]);
        let effort = run(&mut integrator, &mut SpringPendulum::new(1e4), 1e-3, 1000, &mut state, |_, _, _| {}).unwrap();
        assert_eq!((effort.newton_iterations, effort.factorizations), (iterations, factorizations));
    }
}
