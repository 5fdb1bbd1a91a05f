//! Order of the frequencies in the mesh.

use super::*;

/// `(kℓ)⁶/50400`, as the element's equation says.
#[test]
fn order_of_frequencies_in_the_mesh_is_six() -> Outcome {
    for count in [4, 8, 16] {
        let mesh = ["solver.model=finite-element".to_owned(), format!("rod.elements={count}")];
        let rod = subject("crank-slider", &[&PINNED[..], &mesh.each_ref().map(String::as_str)].concat(), Some(Crank::Held))?;
        let found = bending(&rod, &rod.at_rest(0.0)?, 2)?;
        for (n, (found, exact)) in found.iter().zip(pinned_rod(2)).enumerate() {
            let phase = PI * (n + 1) as f64 / f64::from(count);
            let expected = -phase.powi(6) / 50400.0;
            let error = found / exact - 1.0;
            assert!(
                (error / expected - 1.0).abs() < 0.1 * phase * phase + 0.02,
                "{count} elements: {error:e}, expected {expected:e}"
            );
        }
    }
    Ok(())
}

/// A mass at the end takes the load from the consistent mass of the elements, and with it the sixth order: each half of the elements
/// leaves a sixteenth of the error.
#[test]
fn order_of_frequencies_with_a_mass_at_the_end_is_four() -> Outcome {
    let exact: Vec<f64> = roots(tipped, 0.05, 2).iter().map(|x| omega(*x, LENGTH_M)).collect();
    let errors = |count: usize| -> Result<Vec<f64>, Box<dyn Error>> {
        let (mesh, tip) = (format!("beam.elements={count}"), tip_mass());
        let overrides = [&SLENDER[..], &["solver.model=finite-element", &mesh, &tip]].concat();
        let beam = subject("thesis-beam", &overrides, Some(Crank::Held))?;
        let found = bending(&beam, &beam.at_rest(0.0)?, 2)?;
        Ok(found.iter().zip(&exact).map(|(found, exact)| found / exact - 1.0).collect())
    };
    let (coarse, fine) = (errors(8)?, errors(16)?);
    for (coarse, fine) in coarse.iter().zip(fine) {
        let order = (coarse / fine).log2();
        assert!((order - 4.0).abs() < 0.1, "order {order}: {coarse:e} with 8 elements, {fine:e} with 16");
    }
    Ok(())
}
