//! R1 to R5.

use crate::bench::{FINITE, MODAL, chord, rod_middle, rows, simulation, slider, worst};

#[test]
fn val_r1_practically_rigid() {
    let reference = rows("R1.csv");
    let rigid = ["solver.model=rigid", "solver.integrator=runge-kutta"];
    let [angle, x] = worst(&mut simulation("ref-r1", &rigid), &reference, [(10, chord), (12, slider)]);
    assert!(angle < 1e-7 && x < 1e-7, "rigid: {angle:e} rad, {x:e} m");
    for model in [MODAL, FINITE] {
        let [angle] = worst(&mut simulation("ref-r1", &[model, "solver.step_s=0.0005"]), &reference, [(4, chord)]);
        println!("R1 {model} {angle:e}");
        assert!(angle < 1e-5, "{model}: {angle:e} rad");
    }
}

#[test]
fn val_r2s_smooth_pulse() {
    let reference = rows("R2s.csv");
    for (elements, bound) in [(8, 5e-4), (16, 3e-5)] {
        let mesh = [FINITE, &format!("crank.elements={elements}"), &format!("rod.elements={elements}"), "solver.step_s=2e-5"];
        let [angle, x] = worst(&mut simulation("ref-r2s", &mesh), &reference, [(4, chord), (3, slider)]);
        println!("R2s {elements} elements: {angle:e} rad, {x:e} m");
        assert!(angle < bound, "{elements} elements: {angle:e} rad");
    }
    // The issue asks for 1e-2; what the model reaches (its documentation) is kept.
    for (modes, bound) in [(2, 2.8e-3), (3, 9e-4)] {
        let modal = [MODAL, &format!("crank.modes={modes}"), &format!("rod.modes={modes}")];
        let [angle, x] = worst(&mut simulation("ref-r2s", &modal), &reference, [(4, chord), (3, slider)]);
        println!("R2s modal {modes}: {angle:e} rad, {x:e} m");
        assert!(angle < bound, "{modes} modes: {angle:e} rad");
    }
}

#[test]
fn val_r3_fast_rod() {
    let reference = rows("R3.csv");
    let step = format!("solver.step_s={}", reference[1][0] / 20.0);
    for (model, bound) in [(FINITE, 1e-5), (MODAL, 0.02 * 0.01554 * 0.3)] {
        let mut run = simulation("ref-r3", &[model, &step, "rod.elements=8"]);
        let [bow, x] = worst(&mut run, &reference, [(5, rod_middle), (4, slider)]);
        println!("R3 {model}: {bow:e} m, x {x:e} m");
        assert!(bow < bound, "{model}: {bow:e} m");
        assert!(run.observation().out_of_range.is_none(), "{model} is within its range");
    }
}

#[test]
fn val_r4m_strong_bending() {
    let reference = rows("R4m.csv");
    let [bow, x] =
        worst(&mut simulation("ref-r4m", &[FINITE, "solver.step_s=2.5e-5"]), &reference, [(5, rod_middle), (4, slider)]);
    println!("R4m: {bow:e} m, x {x:e} m");
    assert!(bow < 1e-4, "{bow:e} m");
    let mut modal = simulation("ref-r4m", &[MODAL]);
    let mut flagged = false;
    while modal.time_s() < 1.0 && !flagged {
        modal.step().unwrap();
        flagged = modal.observe().unwrap().out_of_range.is_some();
    }
    assert!(flagged, "modal says that it is out of its range");
}

#[test]
fn val_r5_hinged_beam() {
    for (scene, file) in [("ref-r5", "R5_mtip0.csv"), ("ref-r5-tip", "R5_mtip100.csv")] {
        let reference = rows(file);
        for model in [MODAL, FINITE] {
            let [angle] = worst(&mut simulation(scene, &[model]), &reference, [(3, chord)]);
            println!("{scene} {model}: {angle:e} rad");
            assert!(angle < 1e-6, "{scene} {model}: {angle:e} rad");
        }
    }
}

#[test]
fn val_r2_no_step_fails_under_a_step_torque() {
    for (elements, step_s) in [(4, 1e-3), (8, 1e-3), (16, 1e-3), (32, 1e-3), (64, 1e-3), (4, 1e-4), (16, 1e-4), (64, 1e-4)] {
        let mesh = [format!("crank.elements={elements}"), format!("rod.elements={elements}"), format!("solver.step_s={step_s}")];
        let mesh: Vec<&str> = mesh.iter().map(String::as_str).collect();
        let mut run = simulation("ref-r2", &mesh);
        while run.time_s() < 2.0 {
            run.step().unwrap_or_else(|error| panic!("{elements} elements, {step_s} s: {error}"));
        }
    }
}

/// A step torque rings every mode, so that no order shows; refined together, mesh and step still bring the error down.
#[test]
fn val_r2_step_torque_converges() {
    let reference = rows("R2.csv");
    let errors = [(8, 1e-4), (32, 1e-5)].map(|(elements, step_s)| {
        let mesh = [format!("crank.elements={elements}"), format!("rod.elements={elements}"), format!("solver.step_s={step_s}")];
        let mesh: Vec<&str> = mesh.iter().map(String::as_str).collect();
        worst(&mut simulation("ref-r2", &mesh), &reference, [(4, chord), (3, slider)])
    });
    let [[coarse, _], [angle, x]] = errors;
    assert!(angle < 5e-4 && x < 2e-4 && angle < 0.5 * coarse, "{errors:?}");
}
