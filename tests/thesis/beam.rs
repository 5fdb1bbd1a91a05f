//! The hinged beam of sections 5.4 and 5.5.

use crate::reference::{Outcome, reference, simulation, turn};

#[test]
fn val_incremental_beam_is_the_listing_within_5e_9() -> Outcome {
    for (scene, file, every) in [
        ("thesis-beam", "thesis/beam_spring_h1e-3_theta0.9__every50.csv", 50),
        ("thesis-beam-tip", "thesis/beam_spring_tipmass100_h1e-3_theta0.9__every100.csv", 100),
    ] {
        let mut simulation = simulation(scene, &["pulse.0.duration_s=0.099"])?;
        for (n, row) in reference(file)?.iter().enumerate() {
            while simulation.step_count() < n as u64 * every {
                simulation.step()?;
            }
            let seen = simulation.observe()?;
            let nodes = &seen.links[0].nodes;
            let [x, y] = nodes[1].position_m;
            for (column, computed) in [turn(&nodes[0]), x, y, turn(&nodes[1]), seen.links[0].chord_rad].into_iter().enumerate() {
                let listed = row[column + 1];
                assert!((computed - listed).abs() < 5e-9, "{scene} row {n} column {}: {computed} for {listed}", column + 1);
            }
        }
    }
    Ok(())
}

/// Times at which the chord angle passes zero upwards, by linear interpolation, and the first peak.
fn swings(scene: &str, overrides: &[&str], until_s: f64) -> Result<(Vec<f64>, f64), Box<dyn std::error::Error>> {
    let mut simulation = simulation(scene, overrides)?;
    let (mut crossings, mut peak, mut before) = (Vec::new(), 0.0_f64, 0.0);
    while simulation.time_s() < until_s {
        simulation.step()?;
        let now = simulation.observe()?.links[0].chord_rad;
        if before < 0.0 && now >= 0.0 {
            crossings.push(simulation.time_s() - simulation.step_s() * now / (now - before));
        }
        if crossings.is_empty() {
            peak = peak.max(now);
        }
        before = now;
    }
    Ok((crossings, peak))
}

#[test]
fn val_periods_and_peaks_of_the_other_models() -> Outcome {
    let models: [&[&str]; 3] = [
        &["solver.model=rigid", "solver.integrator=runge-kutta"],
        &["solver.model=modal", "solver.integrator=generalized-alpha"],
        &["solver.model=finite-element", "solver.integrator=generalized-alpha", "beam.elements=2"],
    ];
    for overrides in models {
        for (scene, period_s, peak_rad) in [("thesis-beam", 3.5589, Some(1.7632e-3)), ("thesis-beam-tip", 10.5528, None)] {
            let (crossings, peak) = swings(scene, overrides, 2.5 * period_s)?;
            let period = crossings[1] - crossings[0];
            assert!((period - period_s).abs() < 1e-4, "{scene} {overrides:?}: period {period} s");
            if let Some(peak_rad) = peak_rad {
                assert!((peak / peak_rad - 1.0).abs() < 1e-3, "{scene} {overrides:?}: peak {peak} rad");
            }
        }
    }
    Ok(())
}
