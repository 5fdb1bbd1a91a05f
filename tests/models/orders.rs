//! Orders of convergence on R2s.

use crate::bench::{FINITE, MIDPOINT, MODAL, chord, largest, look, run_to, simulation};

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

/// The projection onto the ledger's energy, which every step ends with, takes nothing of the order; it is 4.30, 4.03 at 0.5 and
/// 0.25 ms.
#[test]
fn order_of_the_esdirk_rule_is_at_least_four() {
    let run = |step_s: f64| angles(&[MODAL, "solver.integrator=esdirk"], step_s);
    let [coarse, middle, fine] = [5e-4, 2.5e-4, 1.25e-4].map(run);
    let order = (apart(&coarse, &middle) / apart(&middle, &fine)).log2();
    assert!(order > 3.85, "order {order:.3}");
}
