//! Observed orders of convergence on nonlinear problems, at a configuration-dependent inertia.

use crate::problems::{Crank, SpringPendulum, esdirk, generalized_alpha, run, runge_kutta, two_point};
use flexcrank::integrate::{Integrator, State};

/// Free crank from θ = 0 at 1 rad/s, at t = 3 s, by its first integral: `t = ∫₀^θ sqrt(I(s)/I(0)) ds`.
fn free_crank_angle() -> f64 {
    let rate = |theta: f64| (Crank::inertia(0.0)[0] / Crank::inertia(theta)[0]).sqrt();
    let mut theta = 3.0;
    for _ in 0..50 {
        let panels = 4000; // Simpson
        let width = theta / f64::from(2 * panels);
        let time: f64 = (0..=2 * panels)
            .map(|i| {
                let weight = if i == 0 || i == 2 * panels { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
                weight * width / 3.0 / rate(width * f64::from(i))
            })
            .sum();
        theta -= (time - 3.0) * rate(theta);
    }
    theta
}

fn order(errors: &[f64]) -> f64 {
    let last = errors.len() - 1;
    (errors[last - 1] / errors[last]).log2()
}

/// Observed order of the free crank's angle and rate at 3 s, halving the step.
fn free_crank(mut integrator: Integrator, steps: [usize; 2]) -> f64 {
    let exact = free_crank_angle();
    let rate = (Crank::inertia(0.0)[0] / Crank::inertia(exact)[0]).sqrt();
    let errors = steps.map(|steps| {
        let mut state = State::new(vec![0.0], vec![1.0]);
        run(&mut integrator, &mut Crank::default(), 3.0 / steps as f64, steps, &mut state, |_, _, _| {}).unwrap();
        (state.q[0] - exact).abs() + (state.v[0] - rate).abs()
    });
    order(&errors)
}

#[test]
fn order_on_a_free_crank() {
    for (name, integrator, steps, expected, within) in [
        ("two-point ½", two_point(1, 0.5), [400, 800], 2.0, 0.1),
        ("two-point 0", two_point(1, 0.0), [6400, 12800], 1.0, 0.1),
        ("two-point 0.55", two_point(1, 0.55), [6400, 12800], 1.0, 0.1),
        ("two-point 1", two_point(1, 1.0), [6400, 12800], 1.0, 0.1),
        ("generalised-α 0", generalized_alpha(1, 0.0), [800, 1600], 2.0, 0.1),
        ("generalised-α 0.8", generalized_alpha(1, 0.8), [800, 1600], 2.0, 0.1),
        ("generalised-α 1", generalized_alpha(1, 1.0), [800, 1600], 2.0, 0.1),
        ("Runge–Kutta", runge_kutta(1), [800, 1600], 4.0, 0.15),
        ("ESDIRK", esdirk(1), [100, 200], 4.0, 0.15),
    ] {
        let observed = free_crank(integrator, steps);
        println!("{name}: {observed:.3}");
        assert!((observed - expected).abs() < within, "{name}: {observed}");
    }
}

/// A smooth torque and the integral of it.
fn torque_nm(t_s: f64) -> f64 {
    2.0 * (1.0 - (3.0 * t_s).cos()) - t_s
}
fn impulse_nm_s(t_s: f64) -> f64 {
    2.0 * (t_s - (3.0 * t_s).sin() / 3.0) - 0.5 * t_s * t_s
}

#[test]
fn order_with_a_smooth_torque_entered_by_its_means() {
    let mut exact = State::new(vec![0.3], vec![1.0]);
    let mut system = Crank::default();
    system.torque = Some(torque_nm);
    run(&mut runge_kutta(1), &mut system, 2e-4, 10_000, &mut exact, |_, _, _| {}).unwrap();
    for (name, mut integrator) in [
        ("two-point ½", two_point(1, 0.5)),
        ("generalised-α 0", generalized_alpha(1, 0.0)),
        ("generalised-α 0.5", generalized_alpha(1, 0.5)),
        ("generalised-α 0.8", generalized_alpha(1, 0.8)),
        ("generalised-α 1", generalized_alpha(1, 1.0)),
        ("Runge–Kutta", runge_kutta(1)),
    ] {
        let errors = [400, 800, 1600].map(|steps| {
            let mut state = State::new(vec![0.3], vec![1.0]);
            run(&mut integrator, &mut Crank::default(), 2.0 / steps as f64, steps, &mut state, |crank, t, h| {
                crank.torque_nm = (impulse_nm_s(t + h) - impulse_nm_s(t)) / h;
            })
            .unwrap();
            (state.q[0] - exact.q[0]).abs() + (state.v[0] - exact.v[0]).abs()
        });
        println!("{name}: {errors:?} {:.3}", order(&errors));
        assert!((order(&errors) - 2.0).abs() < 0.1, "{name}: {errors:?}");
    }
}

/// A pulse whose edges fall inside steps, entered by its means.
#[test]
fn order_with_a_rectangular_pulse_entered_by_its_means() {
    let (from, to) = (0.31847, 0.92631);
    let impulse = |t: f64| 3.0 * (t.clamp(from, to) - from);
    let solve = |integrator: &mut Integrator, steps: usize| {
        let mut state = State::new(vec![0.3], vec![1.0]);
        run(integrator, &mut Crank::default(), 2.0 / steps as f64, steps, &mut state, |crank, t, h| {
            crank.torque_nm = (impulse(t + h) - impulse(t)) / h;
        })
        .unwrap();
        state
    };
    let exact = solve(&mut runge_kutta(1), 400_000);
    for mut integrator in [two_point(1, 0.5), generalized_alpha(1, 0.0), generalized_alpha(1, 0.8), generalized_alpha(1, 1.0)] {
        let errors = [250, 500, 1000, 2000, 4000].map(|steps| (solve(&mut integrator, steps).q[0] - exact.q[0]).abs());
        // The place of an edge within its step scatters the error; its bound falls as h².
        println!("{errors:?}");
        assert!(errors[4] < errors[0] / 64.0, "{errors:?}");
    }
}

#[test]
fn order_on_a_spring_pendulum() {
    let solve = |integrator: &mut Integrator, steps: usize| {
        let mut state = State::new(vec![1.1, 0.0], vec![0.0, 1.0]);
        run(integrator, &mut SpringPendulum::new(40.0), 2.0 / steps as f64, steps, &mut state, |_, _, _| {}).unwrap();
        state
    };
    let exact = solve(&mut runge_kutta(2), 20_000);
    for (mut integrator, expected) in [
        (two_point(2, 0.5), 2.0),
        (generalized_alpha(2, 0.0), 2.0),
        (generalized_alpha(2, 0.8), 2.0),
        (generalized_alpha(2, 1.0), 2.0),
        (runge_kutta(2), 4.0),
    ] {
        let errors = [800, 1600].map(|steps| {
            let state = solve(&mut integrator, steps);
            (state.q[0] - exact.q[0]).hypot(state.q[1] - exact.q[1])
        });
        println!("{errors:?} {:.3}", order(&errors));
        assert!((order(&errors) - expected).abs() < 0.1, "{errors:?}");
    }
}
