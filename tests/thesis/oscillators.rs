//! Masses and springs of section 5.2.

use crate::reference::{Outcome, reference, simulation};

#[test]
fn val_two_point_oscillators_are_the_listing_within_1e_12() -> Outcome {
    for (scene, file, masses) in [
        ("thesis-oscillator", "thesis/sdof_h0.1_theta0.5.csv", 1),
        ("thesis-two-masses", "thesis/twodof_h0.01_theta0.5.csv", 2),
        ("thesis-two-masses-stiff", "thesis/twodof_stiff_k2_9990_h0.1_theta0.5.csv", 2),
    ] {
        let mut simulation = simulation(scene, &[])?;
        for (n, row) in reference(file)?.iter().enumerate() {
            if n > 0 {
                simulation.step()?;
            }
            let nodes = &simulation.observe()?.links[0].nodes;
            for (mass, node) in nodes.iter().enumerate() {
                let (x, v) = (row[1 + mass], row[1 + masses + mass]);
                assert!((node.position_m[0] - x).abs() < 1e-12, "{scene} row {n}: {} for {x}", node.position_m[0]);
                assert!((node.velocity_m_per_s[0] - v).abs() < 1e-12, "{scene} row {n}: {} for {v}", node.velocity_m_per_s[0]);
            }
        }
    }
    Ok(())
}

#[test]
fn val_exact_solution_is_the_textbook_one() -> Outcome {
    let mut one = simulation("thesis-oscillator", &[])?;
    let mut two = simulation("thesis-two-masses", &[])?;
    for _ in 0..100 {
        one.step()?;
        two.step()?;
        let t = one.time_s();
        assert!((one.observe()?.links[0].exact_x_m[0] - (1.0 - t.cos())).abs() < 1e-14);
        // λ² − 20 λ + 50 = 0 gives ω² = 10 ∓ √50; the shape of mode k is (1, 1 − ω²/10).
        let t = two.time_s();
        let [low, high] = [-1.0, 1.0].map(|sign| 10.0 + sign * 50.0_f64.sqrt());
        let shape = |square: f64| 1.0 - square / 10.0;
        let share = -shape(high) / (shape(low) - shape(high));
        let x = share * (low.sqrt() * t).cos() + (1.0 - share) * (high.sqrt() * t).cos();
        assert!((two.observe()?.links[0].exact_x_m[0] - x).abs() < 1e-12, "at {t}");
    }
    Ok(())
}

/// Largest error against the exact solution over 10 s.
fn error(overrides: &[&str], step_s: f64) -> Result<f64, Box<dyn std::error::Error>> {
    let step = format!("solver.step_s={step_s}");
    let overrides: Vec<&str> = overrides.iter().copied().chain([step.as_str()]).collect();
    let mut simulation = simulation("thesis-two-masses", &overrides)?;
    let mut worst = 0.0_f64;
    while simulation.time_s() < 10.0 - 0.5 * step_s {
        simulation.step()?;
        let masses = &simulation.observe()?.links[0];
        for (node, exact) in masses.nodes.iter().zip(&masses.exact_x_m) {
            worst = worst.max((node.position_m[0] - exact).abs());
        }
    }
    Ok(worst)
}

#[test]
fn order_of_every_integrator_on_the_two_masses() -> Outcome {
    let cases: [(&[&str], f64, f64, f64); 5] = [
        (&["solver.weight=0.5"], 0.005, 2.0, 0.1),
        (&["solver.weight=0.55"], 0.0005, 1.0, 0.1),
        (&["solver.weight=1.0"], 0.0002, 1.0, 0.1),
        (&["solver.integrator=generalized-alpha"], 0.005, 2.0, 0.1),
        (&["solver.integrator=runge-kutta"], 0.02, 4.0, 0.15),
    ];
    for (overrides, step_s, order, tolerance) in cases {
        let observed = (error(overrides, step_s)? / error(overrides, 0.5 * step_s)?).log2();
        assert!((observed - order).abs() < tolerance, "{overrides:?}: order {observed}");
    }
    Ok(())
}
