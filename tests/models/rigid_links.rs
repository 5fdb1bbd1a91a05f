//! Rigid links in every model, and stiff links on their way there.

use flexcrank::mechanics::Observation;
use flexcrank::simulation::Simulation;

use crate::bench::{FINITE, MODAL, RIGID, look, run_to, simulation};
use crate::chains::{Kind, Shape};

/// All that a chain of rigid links has, in one order: angles with their rates, nodes, joint forces, energies.
fn everything(seen: &Observation) -> Vec<f64> {
    let mut all = Vec::new();
    for link in &seen.links {
        all.extend([link.chord_rad, link.rate_rad_per_s, link.acceleration_rad_per_s2.unwrap()]);
        for node in &link.nodes {
            all.extend(node.position_m);
            all.extend(node.velocity_m_per_s);
            all.extend(node.rotation_rad);
        }
    }
    let joints = [seen.pivot_n, seen.crank_pin_n, seen.slider_pin_n];
    all.extend(joints.iter().flatten().flatten());
    let energy = &seen.energy;
    all.extend([seen.guide_n, seen.resistance_n, seen.motion_torque_nm].iter().flatten());
    all.extend([energy.kinetic_j, energy.strain_j.unwrap_or(0.0), energy.potential_j.unwrap_or(0.0)]);
    all
}

/// Largest difference of two runs over half a second, relative to the larger of the number and 1.
fn apart(one: &mut Simulation, other: &mut Simulation) -> f64 {
    let mut worst = 0.0_f64;
    for step in 0..=50 {
        let time_s = 0.01 * f64::from(step);
        run_to(one, time_s);
        run_to(other, time_s);
        let (a, b) = (everything(look(one)), everything(look(other)));
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            assert!(a.is_finite() && b.is_finite());
            worst = worst.max((a - b).abs() / a.abs().max(1.0));
        }
    }
    worst
}

/// Solved to 1e-12, so that what is left of the iterations does not show.
#[test]
fn prop_a_chain_of_rigid_links_equals_rigid() {
    for shape in [Shape::Slider, Shape::Free, Shape::Beam] {
        for (driven, table) in [(false, false), (false, true), (true, false), (true, true)] {
            let text = Kind { rigid: [true; 2], driven, table, ..Kind::plain(shape) }.toml();
            for integrator in ["two-point", "generalized-alpha", "esdirk"] {
                for model in [MODAL, FINITE] {
                    let scheme = [&format!("solver.integrator={integrator}"), "solver.step_s=5e-4", "solver.tolerance=1e-12"];
                    let run = |model| simulation(&text, &[model, scheme[0], scheme[1], scheme[2]]);
                    let worst = apart(&mut run(RIGID), &mut run(model));
                    assert!(worst < 1e-9, "{shape:?}, driven {driven}, table {table}, {integrator}, {model}: {worst:e}");
                }
            }
        }
    }
}

/// Chord angles a while after a pulse.
fn angles(shape: Shape, rigid: [bool; 2], stiff: [f64; 2], [model, scheme]: [&str; 2]) -> [f64; 2] {
    let link = |name: &str, length: f64, rigid: bool, by: f64| {
        format!(
            "[{name}]\nlength_m = {length}\narea_m2 = 1e-4\nsecond_moment_m4 = 8.333e-10\ndensity_kg_per_m3 = 7700.0\n\
             youngs_modulus_pa = {}\nelements = 2\nrigid = {rigid}\n",
            2.1e11 * by
        )
    };
    let end = if shape == Shape::Slider { "[slider]\nmass_kg = 0.2\n" } else { "[tip]\nmass_kg = 0.2\n" };
    let text = link("crank", 0.5, rigid[0], stiff[0]) + &link("rod", 1.5, rigid[1], stiff[1]) + end;
    let pulse = "pulse=[{ start_s = 0.0, torque_nm = 10.0, duration_s = 0.1, shape = \"raised-cosine\" }]";
    let mut run = simulation(&text, &[model, pulse, scheme, "solver.step_s=2e-4", "solver.tolerance=1e-11"]);
    run_to(&mut run, 0.4);
    [0, 1].map(|k| look(&mut run).links[k].chord_rad)
}

/// ESDIRK loses some of its order on a membrane 10⁴ times as stiff as steel's, and comes less near.
#[test]
fn prop_a_stiffened_link_converges_to_a_rigid_one() {
    for shape in [Shape::Slider, Shape::Free] {
        for model in [MODAL, FINITE] {
            for (scheme, near) in [("solver.integrator=generalized-alpha", 5e-4), ("solver.integrator=esdirk", 1e-2)] {
                for stiffened in 0..2 {
                    let mut rigid = [false; 2];
                    rigid[stiffened] = true;
                    let limit = angles(shape, rigid, [1.0; 2], [model, scheme]);
                    let distance = |by: f64| {
                        let mut stiff = [1.0; 2];
                        stiff[stiffened] = by;
                        let found = angles(shape, [false; 2], stiff, [model, scheme]);
                        (found[0] - limit[0]).abs().max((found[1] - limit[1]).abs())
                    };
                    let [soft, stiff, stiffer] = [1.0, 1e2, 1e4].map(distance);
                    let name = format!("{shape:?}, {model}, {scheme}, link {stiffened}");
                    assert!(soft > 1e-4, "{name}: the link bends, {soft:e} rad");
                    assert!(stiff < 0.02 * soft && stiffer < near * soft, "{name}: {soft:e} {stiff:e} {stiffer:e} rad");
                }
            }
        }
    }
}
