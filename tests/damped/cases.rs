//! Meshes and steps at which a composed scheme with a part that ran backwards gave a wrong motion without a word.

use flexcrank::simulation::EnergyVerdict;

use crate::{End, LOOKS, apart_rad, run};

const NEAR_RAD: f64 = 1e-3;

/// Runs the default scene to `until_s`.
fn default_scene(overrides: &[&str], integrator: &str, step_s: f64, until_s: f64) -> Result<crate::Run, End> {
    let mut overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
    overrides.extend([format!("solver.integrator={integrator}"), format!("solver.step_s={step_s}")]);
    let between = until_s / LOOKS as f64 / step_s;
    assert!((between - between.round()).abs() < 1e-9, "looks must fall on steps: {between} of {step_s} s");
    run("crank-slider", &overrides, between.round() as usize)
}

/// The crank's angle, as the scene stands, is that of generalised-α at a fine step of the same mesh or modes.
fn right(overrides: &[&str], steps_s: &[f64], until_s: f64, fine_s: f64) {
    let fine = default_scene(overrides, "generalized-alpha", fine_s, until_s).unwrap();
    for &step_s in steps_s {
        let found = default_scene(overrides, "esdirk", step_s, until_s).unwrap();
        let error = apart_rad(&found, &fine);
        println!("{overrides:?} {step_s} s: {error:.1e} rad at most, {} at the end", found.angles_rad[LOOKS - 1]);
        assert!(error < NEAR_RAD, "{overrides:?}, {step_s} s: off by {error:e} rad");
        assert_eq!(found.verdict, EnergyVerdict::Balanced, "{overrides:?}, {step_s} s");
    }
}

/// All eight steps divide the looks of 0.36 s, where the crank stands at some 3 rad.
fn finite_elements(elements: u32, steps_s: &[f64], until_s: f64) {
    let mesh = [format!("crank.elements={elements}"), format!("rod.elements={elements}")];
    right(&["solver.model=finite-element", &mesh[0], &mesh[1]], steps_s, until_s, 2e-5);
}

/// 12 of these 32 were wrong, ten of them silently. The finest steps of the finest meshes for shorter, as they take seconds.
#[test]
fn regress_few_elements_are_right_at_every_step() {
    for elements in [2, 4] {
        finite_elements(elements, &[1e-4, 8e-5, 6e-5, 5e-5, 4e-5, 2.5e-5, 2e-5, 1e-5], 0.36);
    }
}

#[test]
fn regress_many_elements_are_right_at_every_step() {
    for elements in [8, 16] {
        finite_elements(elements, &[1e-4, 8e-5, 6e-5, 5e-5, 4e-5, 2.5e-5], 0.36);
        finite_elements(elements, &[2e-5, 1e-5], 0.12);
    }
}

/// Modes with more damping than the default scene's, and more modes.
#[test]
fn regress_damped_modes_are_right_at_every_step() {
    let damped = |damping_s: &'static str| match damping_s {
        "1e-2" => ["crank.damping_s=1e-2", "rod.damping_s=1e-2"],
        _ => ["crank.damping_s=1e-3", "rod.damping_s=1e-3"],
    };
    for damping_s in ["1e-3", "1e-2"] {
        right(&damped(damping_s), &[5e-5, 2e-5], 0.5, 1e-5);
    }
    for (modes, steps_s, until_s) in [
        (["crank.modes=3", "rod.modes=8"], &[7e-4][..], 0.7),
        (["crank.modes=6", "rod.modes=12"], &[1e-3, 7e-4], 0.7),
        (["crank.modes=6", "rod.modes=20"], &[1e-3, 7e-4], 0.7),
    ] {
        right(&[&damped("1e-3")[..], &modes[..]].concat(), steps_s, until_s, 2e-5);
    }
}
