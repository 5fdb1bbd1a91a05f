//! The incremental method is of first order, and has a wrong limit as the step shrinks.

use crate::reference::{Outcome, reference, simulation};

/// Error of the crank's chord angle against the rigid reference.
fn error(step_s: f64, weight: f64, at_s: f64) -> Result<f64, Box<dyn std::error::Error>> {
    let (step, weight) = (format!("solver.step_s={step_s}"), format!("solver.weight={weight}"));
    let mut simulation = simulation("thesis-crank-slider", &[&step, &weight])?;
    while simulation.time_s() < at_s - 0.5 * step_s {
        simulation.step()?;
    }
    let rows = reference("thesis/ref_rigid_crank_slider_L0.5_1.5_1Nm_0.1s.csv")?;
    let row = rows.iter().find(|row| (row[0] - at_s).abs() < 1e-9).ok_or("no such row")?;
    Ok(simulation.observe()?.links[0].chord_rad - row[1])
}

#[test]
fn regress_error_at_4_s_is_first_order_in_the_step() -> Outcome {
    for (step_s, known) in [(0.1, -0.0787), (0.05, -0.0406), (0.025, -0.0205), (0.0125, -0.0103)] {
        let found = error(step_s, 0.55, 4.0)?;
        assert!((found / known - 1.0).abs() < 0.02, "h = {step_s}: {found}");
    }
    Ok(())
}

#[test]
fn order_is_one_for_every_weight() -> Outcome {
    for weight in [0.5, 0.55, 0.75, 1.0] {
        let order = (error(0.025, weight, 4.0)? / error(0.0125, weight, 4.0)?).log2();
        assert!((order - 1.0).abs() < 0.1, "weight {weight}: order {order}");
    }
    Ok(())
}

#[test]
fn regress_the_limit_is_wrong_as_the_step_shrinks() -> Outcome {
    for (step_s, known) in [(1e-3, -1.8e-4), (5e-4, -1.9e-4), (2e-4, -3.6e-4), (1e-4, -6.9e-4), (5e-5, -1.37e-3)] {
        let found = error(step_s, 0.55, 2.0)?;
        assert!((found / known - 1.0).abs() < 0.1, "h = {step_s}: {found}");
    }
    Ok(())
}
