//! Steps that cannot be taken are refused, and leave the state as it was.

use crate::problems::{Crank, Linear, generalized_alpha, runge_kutta, two_point};
use flexcrank::integrate::{Integrator, NewtonSettings, State, StepError, System, TwoPoint};
use nalgebra::{DMatrix, DVector};

/// The step fails, the state stays, and the integrator works again afterwards.
fn refused<S: System>(mut integrator: Integrator, bad: &mut S, good: &mut S) -> StepError {
    let n = bad.degrees_of_freedom();
    let mut state = State::new(vec![0.1; n], vec![1.0; n]);
    integrator.step(good, 0.0, 0.01, &mut state).unwrap();
    let before = state.clone();
    let error = integrator.step(bad, 0.01, 0.01, &mut state).unwrap_err();
    assert_eq!(state, before);
    integrator.step(good, 0.01, 0.01, &mut state).unwrap();
    assert_ne!(state, before);
    error
}

fn all() -> [Integrator; 4] {
    [two_point(1, 0.5), two_point(1, 0.0), generalized_alpha(1, 0.8), runge_kutta(1)]
}

#[test]
fn prop_not_finite() {
    for integrator in all() {
        let mut bad = Crank::driven(f64::NAN);
        assert_eq!(refused(integrator, &mut bad, &mut Crank::default()), StepError::NotFinite);
    }
    for integrator in all() {
        let mut bad = Crank::driven(f64::INFINITY);
        assert_eq!(refused(integrator, &mut bad, &mut Crank::default()), StepError::NotFinite);
    }
    for integrator in all() {
        let mut bad = Crank::driven(f64::MAX);
        refused(integrator, &mut bad, &mut Crank::default());
    }
}

#[test]
fn prop_singular() {
    let one = |x| DMatrix::from_element(1, 1, x);
    let system = |mass| Linear::new(one(mass), one(0.0), one(0.0), DVector::from_element(1, 1.0));
    for integrator in all() {
        assert_eq!(refused(integrator, &mut system(0.0), &mut system(1.0)), StepError::Singular);
    }
}

#[test]
fn prop_not_converged() {
    let settings = NewtonSettings { tolerance: 1e-13, max_iterations: 1 };
    let mut integrator = TwoPoint::new(1, 0.5, settings);
    let mut state = State::new(vec![0.1], vec![1.0]);
    let before = state.clone();
    let error = integrator.step(&mut Crank::default(), 0.0, 0.5, &mut state).unwrap_err();
    assert!(matches!(error, StepError::NotConverged { iterations: 1, residual } if residual > 1e-13), "{error}");
    assert_eq!(state, before);
}
