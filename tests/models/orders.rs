//! Orders of convergence.

use flexcrank::mechanics::Observation;

use crate::bench::{FINITE, MIDPOINT, MODAL, RIGID, chord, largest, look, run_to, simulation};

/// Chord angles of the crank every 0.02 s to 1 s.
fn angles(overrides: &[&str], step_s: f64) -> Vec<f64> {
    let mut run = simulation("ref-r2s", &[overrides, &[&format!("solver.step_s={step_s}"), "solver.tolerance=1e-11"]].concat());
    let at = |k: u32| {
        run_to(&mut run, 0.02 * f64::from(k));
        chord(look(&mut run))
    };
    (1..=50).map(at).collect()
}

/// Largest difference between two runs.
fn apart(one: &[f64], other: &[f64]) -> f64 {
    largest(one.iter().zip(other).map(|(a, b)| a - b))
}

/// Meshes of 4, 8 and 16 elements a link against one of 48 at the same step.
#[test]
fn order_of_the_mesh_is_above_three_and_a_half() {
    let run = |elements: u32| {
        let mesh = [format!("crank.elements={elements}"), format!("rod.elements={elements}")];
        angles(&[FINITE, &mesh[0], &mesh[1], MIDPOINT[0], MIDPOINT[1]], 1e-4)
    };
    let fine = run(48);
    let errors = [4, 8, 16].map(|elements| apart(&run(elements), &fine));
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(order >= 3.5, "order {order:.2} of {errors:?} rad");
    }
}

#[test]
fn order_of_time_is_two() {
    for (name, overrides) in [("generalized-alpha", &["solver.integrator=generalized-alpha"][..]), ("two-point", &MIDPOINT[..])] {
        for (model, finest) in [(FINITE, 5e-5), (MODAL, 2.5e-5)] {
            let run = |step_s: f64| angles(&[&[model][..], overrides].concat(), step_s);
            let [coarse, middle, fine] = [4.0 * finest, 2.0 * finest, finest].map(run);
            let order = (apart(&coarse, &middle) / apart(&middle, &fine)).log2();
            assert!((order - 2.0).abs() < 0.1, "{name}, {model}: order {order:.3}");
        }
    }
}

/// Largest change of a quantity every 0.02 s to 0.4 s as the step is halved, twice.
fn order_of(scene: &str, keys: &[&str], coarsest_s: f64, of: fn(&Observation) -> f64) -> f64 {
    let run = |step_s: f64| {
        let step = format!("solver.step_s={step_s}");
        let mut run = simulation(scene, &[keys, &["solver.integrator=esdirk", "solver.tolerance=1e-12", &step]].concat());
        let at = |k: u32| {
            run_to(&mut run, 0.02 * f64::from(k));
            of(look(&mut run))
        };
        (1..=20).map(at).collect::<Vec<f64>>()
    };
    let [coarse, middle, fine] = [1.0, 0.5, 0.25].map(|part| run(part * coarsest_s));
    (apart(&coarse, &middle) / apart(&middle, &fine)).log2()
}

/// Bars of rubber, so that the step resolves their stretch.
const SOFT: &str = "
[crank]
length_m = 0.5
area_m2 = 1e-4
second_moment_m4 = 8.333e-7
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e8
elements = 2
axial = true
[rod]
length_m = 1.5
area_m2 = 1e-4
second_moment_m4 = 8.333e-7
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e8
elements = 2
axial = true
modes = 2
[slider]
mass_kg = 0.2
[start]
rate_rad_per_s = 6.0
";

/// Under smooth loads, in every model, where the step resolves what moves. Steel bars that stretch and are damped have axial modes that
/// no step here resolves: the default scene's order is 2.9 from 1e-4 s on, and its error there 3e-11 rad.
#[test]
fn order_of_esdirk_is_four_in_every_model() {
    let oscillator = "[oscillator]\nmasses_kg = [1.0, 2.0]\nsprings = [[1, 2, 300.0], [2, 0, 500.0]]\nstart_m = [1.0, 0.0]\n";
    let first: fn(&Observation) -> f64 = |seen| seen.links[0].nodes[0].position_m[0];
    for (name, scene, keys, coarsest_s, of) in [
        ("rigid", "crank-slider", &[RIGID][..], 4e-3, chord as fn(&Observation) -> f64),
        ("modal", "crank-slider", &[MODAL, "crank.axial=false", "rod.axial=false"], 2.5e-4, chord),
        ("modal that stretches", SOFT, &[MODAL], 5e-4, chord),
        ("finite-element", SOFT, &[FINITE], 2.5e-4, chord),
        ("mass-spring", oscillator, &[], 1e-2, first),
    ] {
        let order = order_of(scene, keys, coarsest_s, of);
        println!("{name}: order {order:.3}");
        assert!((order - 4.0).abs() < 0.2, "{name}: order {order:.3}");
    }
}

/// Rectangular pulses that begin and end inside steps, at other places of the step each time it is halved: the error falls as h⁴
/// through three halvings, where a load spread over its step left it at h². A part of a step dropped would leave h¹.
#[test]
fn order_of_the_fourth_is_kept_by_pulses_that_end_inside_steps() {
    for (name, keys, coarsest_s) in
        [("rigid", &[RIGID][..], 4e-3), ("modal", &[MODAL, "crank.axial=false", "rod.axial=false"], 4e-4)]
    {
        let run = |step_s: f64| {
            let step = format!("solver.step_s={step_s}");
            let pulses = "pulse=[{start_s = 0.0, torque_nm = 30.0, duration_s = 0.0317}, {start_s = 0.1013, torque_nm = -20.0, duration_s = 0.0271}]";
            let keys = [keys, &["solver.integrator=esdirk", "solver.tolerance=1e-12", &step, pulses]].concat();
            let mut run = simulation("crank-slider", &keys);
            run_to(&mut run, 0.2);
            chord(look(&mut run))
        };
        let exact = run(coarsest_s / 64.0);
        let [first, .., last] = [1.0, 0.5, 0.25, 0.125].map(|part| (run(part * coarsest_s) - exact).abs());
        let order = (first / last).log2() / 3.0;
        println!("{name}: {first:.1e} to {last:.1e} rad, order {order:.2}");
        assert!(order > 3.4 && last < 1e-8, "{name}: {first:.1e} to {last:.1e} rad, order {order:.2}");
    }
}

/// Crank angles of the default scene every 0.02 s to 2 s.
fn default_angles(keys: &[&str]) -> Vec<f64> {
    let mut run = simulation("crank-slider", keys);
    let at = |k: u32| {
        run_to(&mut run, 0.02 * f64::from(k));
        chord(look(&mut run))
    };
    (1..=100).map(at).collect()
}

/// The default scene against the same modes by generalised-α, extrapolated from 4e-5 and 2e-5 s.
#[test]
fn val_time_steps_of_the_default_scene() {
    let by_alpha = |step: &str| default_angles(&["solver.integrator=generalized-alpha", step, "solver.tolerance=1e-10"]);
    let [coarse, fine] = [by_alpha("solver.step_s=4e-5"), by_alpha("solver.step_s=2e-5")];
    let exact: Vec<f64> = coarse.iter().zip(&fine).map(|(coarse, fine)| fine + (fine - coarse) / 3.0).collect();
    for (step, bound) in [("solver.step_s=2e-3", 2e-5), ("solver.step_s=1e-3", 5e-6), ("solver.step_s=5e-4", 2e-7)] {
        let error = apart(&default_angles(&["solver.integrator=esdirk", step]), &exact);
        println!("{step}: {error:e} rad");
        assert!(error < bound, "{step}: {error:e} rad");
    }
}
