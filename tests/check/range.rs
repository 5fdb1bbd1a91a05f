//! Links that bend out of the range of their model.

use std::fs;

use crate::{Tried, checked};

/// A wire with a mass at its end that hangs down from a clamped start: little bent from its chord, and steep at the clamp. With `modal`,
/// its first bending is at 5.98 Hz for 4.52 Hz.
const WIRE: &str = r#"
[beam]
length_m = 0.8
section = { shape = "round", diameter_m = 0.001 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.1e11
elements = 16
modes = 4
[tip]
mass_kg = 0.5
[base]
torsion_spring_nm_per_rad = 4000.0
damper_nm_s_per_rad = 0.05
[gravity]
y_m_per_s2 = -9.81
[start]
static_equilibrium = true
[[pulse]]
start_s = 0.1
torque_nm = 0.001
duration_s = 0.05
[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.001
"#;

#[test]
fn regress_a_link_that_is_steep_at_its_end_is_out_of_range() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("wire.toml");
    fs::write(&file, WIRE)?;
    let (printed, said) = checked(&file.to_string_lossy(), &[], &[])?;
    assert!(printed.contains("valid, but a link bends out of the model's range"), "{printed}");
    assert!(said.contains("out of the model's range: a link was bent by 55.8° from its chord"), "{said}");
    Ok(())
}
