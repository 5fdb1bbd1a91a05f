//! Steps whose motion a run with half of them does not reproduce.

use std::fs;

use crate::{Tried, checked};

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

/// A step of half the period in which its rod bends: `sound`, with an error of 65 % of the rod's deflection.
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
    let (out, said) = checked(path, &["solver.step_s=0.002"], &[])?;
    assert!(out.contains("fast.toml: valid, but its result depends on the step\n"), "{out}");
    let warning =
        "warning: with half the step, the rod's deflection differs by up to 65 % of its peak in this run: shorten the step";
    assert!(said.contains(warning), "{said}");
    let (out, said) = checked(path, &["solver.step_s=2e-5"], &[])?;
    assert!(out.contains("fast.toml: sound\n") && !said.contains("with half the step"), "{out}{said}");
    Ok(())
}
