//! Steps whose motion a run with half of them does not reproduce.

use std::fs;

use crate::{TUMBLES, Tried, checked};

/// A pump whose rod's modulus is in MPa: at 0.1 ms it runs to its end, and at 0.05 ms it diverges after 79 ms.
const PUMP: &str = r#"
[crank]
length_m = 0.015
mass_kg = 0.6
centre_of_mass_m = 0.0
inertia_kg_m2 = 2.0e-3
rigid = true
[rod]
length_m = 0.15
section = { shape = "round", diameter_m = 0.005 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.1e5
elements = 8
modes = 3
damping_s = 1.0e-5
[slider]
mass_kg = 0.15
resistance_table = [[0.0, 0.0], [0.4, -30.0], [2.9, -30.0], [3.3, 0.0], [4.2, 200.0], [5.9, 200.0]]
[base]
damper_nm_s_per_rad = 0.06
[torque]
constant_nm = 6.5
[solver]
step_s = 0.0001
"#;

#[test]
fn regress_a_step_is_not_suggested_if_half_of_it_diverges() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("pump.toml");
    fs::write(&file, PUMP)?;
    let file = file.to_string_lossy();
    let (printed, said) = checked(&file, &[], &[])?;
    assert!(printed.contains("valid, but with half the step it diverges"), "{printed}");
    assert!(printed.contains("step error   not known: the run with half the step diverges at t = 0.0789"), "{printed}");
    assert!(said.contains("warning: with half the step, the run diverges at t = 0.0789"), "{said}");
    let (printed, _) = checked(&file, &[], &["--json"])?;
    let found: serde_json::Value = serde_json::from_str(&printed)?;
    assert!(found["step_error_rad"].is_null() && found["half_step_diverges_s"].is_f64(), "{printed}");
    assert_ne!(found["suggested_step_s"], 1e-4, "{printed}");
    Ok(())
}

/// A straight beam without weight that turns steadily does not bend: its deflection of 1e-19 m was compared, and no step was short enough.
#[test]
fn regress_rounding_is_no_deflection() -> Tried<()> {
    let arm = "[beam]\nlength_m = 0.5\nsection = { shape = \"tube\", outer_m = 0.02, inner_m = 0.016 }\ndensity_kg_per_m3 = 2700\n\
               youngs_modulus_pa = 7e10\nelements = 8\nmodes = 3\ndamping_s = 2e-4\n[tip]\nmass_kg = 0.8\n[drive]\nspeed_rad_per_s = 9\n";
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("arm.toml");
    fs::write(&path, arm)?;
    let (out, _) = checked(path.to_str().ok_or("no path")?, &[], &[])?;
    assert!(out.contains("  step error   none: the motion is prescribed, and no link bends\n"), "{out}");
    assert!(out.contains(" bends by 0 m: set beam.axial = true\n") && !out.contains("no step from"), "{out}");
    Ok(())
}

/// A step of half the period in which its rod bends: `sound`, with an error of 63 % of the rod's deflection.
#[test]
fn regress_a_deflection_that_depends_on_the_step_is_not_sound() -> Tried<()> {
    let rod = "[rod]\nlength_m = 0.3\nsection = { shape = \"rectangle\", width_m = 0.01, height_m = 0.01 }\ndensity_kg_per_m3 = 7850.0\n\
               youngs_modulus_pa = 2.1e11\nelements = 8\nmodes = 3\n";
    let turned =
        "[crank]\nlength_m = 0.05\nmass_kg = 0.2\nrigid = true\n[slider]\nmass_kg = 0.2\n[drive]\nspeed_rad_per_s = 500\n";
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("fast.toml");
    fs::write(&path, format!("{rod}{turned}"))?;
    let path = path.to_str().ok_or("no path")?;
    let (out, said) = checked(path, &["solver.step_s=0.002".to_owned()], &[])?;
    assert!(out.contains("fast.toml: valid, but its result depends on the step\n"), "{out}");
    let warning =
        "warning: with half the step, the rod's deflection differs by up to 63 % of its peak in this run: a shorter step";
    assert!(said.contains(warning), "{said}");
    let (out, said) = checked(path, &["solver.step_s=2e-5".to_owned()], &[])?;
    assert!(out.contains("fast.toml: sound\n") && !said.contains("with half the step"), "{out}{said}");
    Ok(())
}

/// However short the step, its error grows until the motion is another one.
#[test]
fn prop_a_chaotic_motion_has_a_step_suggested_that_keeps_the_balance() -> Tried<()> {
    let chaotic = [
        "solver.model=rigid",
        "solver.step_s=0.01",
        "base.damper_nm_s_per_rad=0",
        "pulse=[]",
        "start.angle_rad=1.5",
        "start.rate_rad_per_s=3",
    ];
    let (out, _) = checked(TUMBLES, &chaotic.map(str::to_owned), &["--until", "20"])?;
    let none = "; no step from 0.01 s down to 0.0005 s has a step error of at most 0.01 rad\n";
    let found = out.contains(": valid, but its result depends on the step\n") && out.contains(none);
    assert!(found && out.contains("\n  suggested    0.01 s: at least 12 steps"), "{out}");
    Ok(())
}

/// `sound`, with a balance of 3e-16 and no step error: its masses erred by up to 95 % of their motion. Numbers of NumPy: the trapezoidal rule, and
/// the exact solution by eigenvectors.
#[test]
fn val_the_error_of_an_oscillators_step_is_that_of_its_exact_solution() -> Tried<()> {
    let masses = "[oscillator]\nmasses_kg = [1.0, 0.5, 2.0]\nsprings = [[1, 0, 100.0], [1, 2, 50.0], [2, 3, 80.0]]\n\
                  forces_n = [0.0, 1.0, 0.0]\nstart_m = [0.01, 0.0, -0.02]\n";
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("masses.toml");
    fs::write(&path, masses)?;
    let path = path.to_str().ok_or("no path")?;
    let long = ["solver.step_s=0.2".to_owned()];
    let (printed, _) = checked(path, &long, &["--until", "5", "--json"])?;
    let found: serde_json::Value = serde_json::from_str(&printed)?;
    let error = found["step_error_of_mass"].as_f64().ok_or("no error")?;
    assert!((error / 0.95493 - 1.0).abs() < 1e-4 && found["finding"] == "valid, but its result depends on the step", "{printed}");
    let (printed, said) = checked(path, &long, &["--until", "5"])?;
    assert!(
        printed.contains("  step error   2.3e-2 m of mass 1 from the exact solution, 9.5e-1 of its peak, until "),
        "{printed}"
    );
    assert!(said.contains("warning: mass 1 errs by up to 95 % of its peak in this run: a shorter step mends that"), "{said}");
    let suggested_s = found["suggested_step_s"].as_f64().ok_or("no step")?;
    let (printed, _) = checked(path, &[format!("solver.step_s={suggested_s}")], &["--until", "5", "--json"])?;
    let found: serde_json::Value = serde_json::from_str(&printed)?;
    assert!(found["step_error_of_mass"].as_f64().is_some_and(|error| error <= 0.01), "{printed}");
    Ok(())
}

/// By symmetry, the mass in the middle stays: its rounding was an error of all of its peak. 190 Hz is 10 Hz at the default rate.
#[test]
fn regress_a_mass_that_stays_has_no_error() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("three.toml");
    let springs = "springs = [[1, 0, 100.0], [1, 2, 50.0], [2, 3, 50.0], [3, 0, 100.0]]\nstart_m = [0.01, 0.0, -0.01]\n";
    fs::write(&path, format!("[oscillator]\nmasses_kg = [1.0, 1.0, 1.0]\n{springs}"))?;
    let (out, said) = checked(path.to_str().ok_or("no path")?, &["solver.step_s=1e-3".to_owned()], &[])?;
    assert!(out.contains(": sound\n") && !out.contains("of mass 2") && said.is_empty(), "{out}{said}");
    // The motion, and not the place, is what an error is compared with.
    fs::write(&path, "[oscillator]\nmasses_kg = [1.0, 1.0]\nsprings = [[1, 2, 100.0]]\nstart_m = [1000.01, 999.99]\n")?;
    let (out, _) = checked(path.to_str().ok_or("no path")?, &["solver.step_s=0.2".to_owned()], &[])?;
    assert!(out.contains(": valid, but its result depends on the step\n"), "{out}");
    fs::write(&path, "[oscillator]\nmasses_kg = [10.0]\nsprings = [[1, 0, 1.42517e7]]\nstart_m = [0.001]\n")?;
    let (out, _) = checked(path.to_str().ok_or("no path")?, &["solver.step_s=2e-5".to_owned()], &[])?;
    assert!(out.contains("  published    200 times a second; vibration at 190 Hz shows with --publish-hz "), "{out}");
    Ok(())
}
