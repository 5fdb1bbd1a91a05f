//! A flexible pendulum: its swing is far slower than its bending.

use crate::{Tried, checked};

const PENDULUM: &str = r#"
[beam]
length_m = 0.6
section = { shape = "rectangle", width_m = 0.025, height_m = 0.0008 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.05e11
elements = 8
modes = 4
damping_s = 2e-5
[tip]
mass_kg = 0.05
[gravity]
y_m_per_s2 = -9.81
[start]
angle_rad = -1.3
[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.001
"#;

fn pendulum(step_s: &str) -> Tried<(String, String)> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("pendulum.toml");
    std::fs::write(&path, PENDULUM)?;
    checked(path.to_str().ok_or("no text")?, &[format!("solver.step_s={step_s}")], &[])
}

/// Weight stretches it: "shortens" was said of tension. By hand, 1.018 N at 15° are `1.018 · 0.6/(2.05e11 · 2e-5)` m.
#[test]
fn regress_a_link_that_hangs_stretches() -> Tried {
    let (told, _) = pendulum("0.001")?;
    assert!(told.contains("  shortening   beam: stretches by 1.4"), "{told}");
    Ok(())
}

/// It bends with a period of 0.159 s. Only the period of its swing, 1.42 s, was looked at.
#[test]
fn regress_a_step_longer_than_the_bending_of_what_swings_is_warned_of() -> Tried {
    for (step_s, is_warned_of) in [("0.001", false), ("0.05", false), ("0.2", true), ("0.5", true)] {
        let (_, said) = pendulum(step_s)?;
        let warning = "does not resolve the period of the lowest bending frequency, 0.159";
        assert_eq!(said.contains(warning), is_warned_of, "{step_s}: {said}");
    }
    Ok(())
}
