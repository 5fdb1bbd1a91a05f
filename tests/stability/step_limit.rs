//! The step up to which the explicit scheme is stable.

use flexcrank::scene::SceneSource;
use flexcrank::simulation::{EnergyVerdict, Simulation};

use crate::Tried;

/// The simulation of a scene with the explicit scheme.
fn explicit(scene: &str, step_s: f64, given: &[&str]) -> Result<Simulation, Box<dyn std::error::Error>> {
    let mut overrides: Vec<String> = given.iter().map(|&given| given.to_owned()).collect();
    overrides.extend(["solver.integrator=runge-kutta".to_owned(), format!("solver.step_s={step_s:?}")]);
    Ok(Simulation::new(&SceneSource::open(scene, &overrides)?.scene)?)
}

/// The step up to which the explicit scheme takes a scene, s.
fn limit_s(scene: &str, given: &[&str]) -> f64 {
    let (mut taken_s, mut refused_s) = (1e-9, 10.0_f64);
    while refused_s / taken_s > 1.0 + 1e-6 {
        let step_s = (taken_s * refused_s).sqrt();
        *(if explicit(scene, step_s, given).is_ok() { &mut taken_s } else { &mut refused_s }) = step_s;
    }
    taken_s
}

#[test]
fn val_the_explicit_step_limit_is_that_of_the_fastest_motion() -> Tried {
    let runs = |step_s: f64| -> Result<bool, Box<dyn std::error::Error>> {
        let text = format!(
            "[oscillator]\nmasses_kg = [2.0, 1e-3]\nsprings = [[0, 1, 300.0], [1, 2, 4e5]]\nstart_m = [1.0, -2e3]\n\
             [solver]\nintegrator = \"runge-kutta\"\nstep_s = {step_s:?}\n"
        );
        Ok(Simulation::new(&SceneSource::parse("oscillator", &text, &[])?.scene).is_ok())
    };
    // det(K − ω² M) = 0.
    let (a, b, c): (f64, f64, f64) = (2.0 * 1e-3, -(2.0 * 4e5 + 1e-3 * 400_300.0), 300.0 * 4e5);
    let omega = ((-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).sqrt();
    let limit_s = 8.0_f64.sqrt() / omega;
    assert!(runs(0.999 * limit_s)? && !runs(1.001 * limit_s)?, "{limit_s}");
    Ok(())
}

#[test]
fn val_the_explicit_step_limit_of_a_damper_is_that_of_its_decay() -> Tried {
    // A rigid bar of m and L about its end, with damper c: exp(−3ct/mL²); −2.785 is where the region ends.
    let given = ["solver.model=rigid", "base.torsion_spring_nm_per_rad=0.0", "base.damper_nm_s_per_rad=7000.0"];
    let source = SceneSource::open("thesis-beam-tip", &given.map(str::to_owned))?;
    let chain = source.scene.chain().ok_or("a chain")?;
    let tip_kg = match chain.end {
        flexcrank::scene::End::Free { tip_mass_kg } => tip_mass_kg,
        flexcrank::scene::End::Slider(_) => 0.0,
    };
    let beam = &chain.links[0];
    let inertia = beam.inertia_kg_m2 + beam.mass_kg * beam.centre_of_mass_m.powi(2) + tip_kg * beam.length_m.powi(2);
    let expected_s = 2.785_293_563 * inertia / 7000.0;
    let found_s = limit_s("thesis-beam-tip", &given);
    assert!((found_s / expected_s - 1.0).abs() < 1e-4, "{found_s} {expected_s}");
    Ok(())
}

#[test]
fn prop_a_scene_below_the_explicit_step_limit_runs_and_one_beyond_is_refused() -> Tried {
    for (scene, given) in [
        ("crank-slider", &[][..]),
        ("crank-slider", &["crank.damping_s=0.0", "rod.damping_s=0.0", "rod.axial=false", "crank.axial=false"]),
        ("thesis-two-masses-stiff", &[]),
        ("ref-r2s", &["solver.model=modal"]),
    ] {
        let limit_s = limit_s(scene, given);
        let mut simulation = explicit(scene, 0.9 * limit_s, given)?;
        for _ in 0..5_000 {
            simulation.step().map_err(|diverged| format!("{scene} {given:?} at {limit_s}: {diverged}"))?;
        }
        assert_eq!(simulation.energy_verdict(), EnergyVerdict::Balanced, "{scene} {given:?}");
        let refused = explicit(scene, 1.2 * limit_s, given).err().ok_or("beyond the limit")?.to_string();
        for part in ["solver.step_s = ", "beyond the stability limit of runge-kutta", "is within it; or take"] {
            assert!(refused.contains(part), "{refused}");
        }
        let suggested = refused.split("solver.step_s=").nth(1).and_then(|rest| rest.split(' ').next()).ok_or("no suggestion")?;
        explicit(scene, suggested.parse()?, given)?;
    }
    Ok(())
}
