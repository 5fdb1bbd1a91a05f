//! Eigenvalues of mechanisms, at every number of them.

use super::{Point, Subject, modes};
use crate::scene::SceneSource;
use crate::simulation::Simulation;

/// At three of a thousand instants of this run the second eigenvalue is real, and the shift stood on it.
#[test]
fn regress_modes_are_found_at_every_instant_of_a_run() -> Result<(), Box<dyn std::error::Error>> {
    let pulse = "pulse=[{start_s=0.0,torque_nm=20.0,duration_s=0.1},{start_s=2.0,torque_nm=-10.0,duration_s=0.2}]";
    let scene = SceneSource::open("crank-slider", &[pulse.to_owned()])?.scene;
    let (subject, mut simulation) = (Subject::new(&scene, None)?, Simulation::new(&scene)?);
    while simulation.time_s() < 3.0 {
        simulation.step()?;
        let point = Point::from(simulation.motion().ok_or("no motion")?);
        modes(&subject, &point, 2).map_err(|error| format!("{} s: {error}", simulation.time_s()))?;
    }
    Ok(())
}

/// A stiff crank with strong material damping: beside its decay of 1e8 1/s, the swing of the chain was lost, or had three digits.
#[test]
fn regress_a_slow_swing_is_found_beside_fast_decays() -> Result<(), Box<dyn std::error::Error>> {
    const FREE: &str = "[crank]\nlength_m = 0.05\nsection = { shape = \"rectangle\", width_m = 0.005, height_m = 0.02 }\n\
                        density_kg_per_m3 = 7850.0\nyoungs_modulus_pa = 2.1e11\nelements = 2\nmodes = 1\n\
                        [rod]\nlength_m = 0.2\nsection = { shape = \"rectangle\", width_m = 0.015, height_m = 0.0012 }\n\
                        density_kg_per_m3 = 7850.0\nyoungs_modulus_pa = 2.1e11\nelements = 4\nmodes = 3\n\
                        [slider]\nmass_kg = 0.3\n[gravity]\ny_m_per_s2 = -9.81\n[base]\ndamper_nm_s_per_rad = 5e-4\n";
    for (model, elements) in [("modal", 2), ("finite-element", 4)] {
        for damping in ["0.0", "1e-6", "1e-4", "5e-4", "1e-3"] {
            let keys = [
                format!("solver.model={model}"),
                format!("crank.damping_s={damping}"),
                format!("crank.elements={elements}"),
                format!("rod.elements={elements}"),
            ];
            let subject = Subject::new(&SceneSource::parse("free.toml", FREE, &keys)?.scene, None)?;
            let point = subject.at_rest(-std::f64::consts::FRAC_PI_2)?;
            for count in [1, 5, 8, 20] {
                let found = modes(&subject, &point, count)?;
                let (name, hz, damping_ratio) = (found[0].name(), found[0].frequency_hz(), found[0].damping_ratio());
                let is_right = (hz - 0.699473).abs() < 1e-6 && (damping_ratio - 0.0665).abs() < 1e-4;
                assert!(name == "chain swing" && is_right, "{keys:?}, {count}: {name}, {hz} Hz, {damping_ratio}");
            }
        }
    }
    Ok(())
}

/// The shift of the highest of 16 modes shows the double 0 of a free beam as a growth and a decay: 15 modes were found.
#[test]
fn regress_as_many_modes_are_found_as_asked_for() -> Result<(), Box<dyn std::error::Error>> {
    const BEAM: &str = "[beam]\nlength_m = 0.5\nsection = { shape = \"rectangle\", width_m = 0.02, height_m = 0.004 }\n\
                        density_kg_per_m3 = 7850\nyoungs_modulus_pa = 2.1e11\nelements = 16\n[base]\n[solver]\nmodel = \"finite-element\"\n";
    let subject = Subject::new(&SceneSource::parse("beam.toml", BEAM, &[])?.scene, None)?;
    for angle_rad in [0.0, 0.5, 1.6] {
        let point = subject.at_rest(angle_rad)?;
        for count in 1..=20 {
            assert_eq!(modes(&subject, &point, count)?.len(), count, "{angle_rad} rad");
        }
    }
    Ok(())
}

/// Upside down, it falls at the rate at which another motion dies away: that came first or second by the rounding of the shift.
#[test]
fn regress_of_a_fall_the_growth_comes_first() -> Result<(), Box<dyn std::error::Error>> {
    let arm = "[beam]\nlength_m = 1.1\nrigid = true\nmass_kg = 2\n[base]\n[gravity]\ny_m_per_s2 = -9.81\n";
    let subject = Subject::new(&SceneSource::parse("arm.toml", arm, &[])?.scene, None)?;
    for count in 1..=3 {
        let found = modes(&subject, &subject.at_rest(std::f64::consts::FRAC_PI_2)?, count)?;
        assert!(found[0].eigenvalue.re > 3.0, "{count}: {}", found[0].eigenvalue);
    }
    Ok(())
}

/// A bar with a mass at its end, whose fast vibrations creep back at rates next to 1/c, as many as the mesh has unknowns. From the ninth
/// mode on nothing was found, or ten times the same decay. The stretching of a uniform bar: `β tan β = m/M`, `ω = β √(E/ρ)/L`,
/// `λ² + c ω² λ + ω² = 0`.
#[test]
fn val_modes_are_found_beside_a_crowd_of_decays() -> Result<(), Box<dyn std::error::Error>> {
    const ARM: &str = "[beam]\nlength_m = 0.8\nsection = { shape = \"tube\", outer_m = 0.012, inner_m = 0.010 }\n\
                       density_kg_per_m3 = 7850.0\nyoungs_modulus_pa = 2.06e11\ndamping_s = 1e-4\n[tip]\nmass_kg = 0.5\n\
                       [base]\ntorsion_spring_nm_per_rad = 25.0\ndamper_nm_s_per_rad = 0.05\n[solver]\nmodel = \"finite-element\"\n";
    let mass_kg = 7850.0 * 0.8 * std::f64::consts::FRAC_PI_4 * (0.012_f64.powi(2) - 0.010_f64.powi(2));
    for (elements, within) in [(40, 2e-4), (300, 1e-5)] {
        let scene = SceneSource::parse("arm.toml", ARM, &[format!("beam.elements={elements}")])?.scene;
        let subject = Subject::new(&scene, None)?;
        let found = modes(&subject, &subject.at_rest(0.0)?, 30)?;
        assert_eq!(found.len(), 30, "{elements} elements");
        for root in 1..5 {
            let mut beta = f64::from(root) * std::f64::consts::PI;
            for _ in 0..60 {
                beta = f64::from(root) * std::f64::consts::PI + (0.5 / mass_kg).recip().atan2(beta);
            }
            let omega = beta * f64::sqrt(2.06e11 / 7850.0) / 0.8;
            let half = 0.5 * 1e-4 * omega * omega;
            let decay = -omega * omega / (half + (half * half - omega * omega).sqrt());
            let nearest = found.iter().map(|mode| (mode.eigenvalue.re / decay - 1.0).abs() + mode.eigenvalue.im.abs());
            let apart = nearest.fold(f64::INFINITY, f64::min);
            assert!(apart < within, "{elements} elements, stretching {root}, {decay}: {apart:e}");
        }
    }
    Ok(())
}
