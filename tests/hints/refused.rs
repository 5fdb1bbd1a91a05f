//! Refusals whose cause is a number in another unit.

use super::{SAMPLE, flexcrank};

/// The refusal alone did not lead to the unit.
#[test]
fn regress_a_what_if_that_is_refused_for_a_number_warns_of_its_unit() -> Result<(), Box<dyn std::error::Error>> {
    let changes = ["--set", "solver.integrator=runge-kutta", "--set", "rod.density_kg_per_m3=2.78"];
    let (code, said) = flexcrank(&[&["what-if", SAMPLE][..], &changes].concat())?;
    let warned = said.contains("warning: rod.density_kg_per_m3 = 2.78 is lighter");
    assert!(code == Some(2) && warned && said.contains("beyond the stability limit"), "{said}");
    Ok(())
}
