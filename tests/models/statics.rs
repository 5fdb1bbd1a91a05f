//! Static equilibrium at the start, against closed forms and against rest.

use crate::bench::{FINITE, MODAL, largest, look, run_to, simulation};
use crate::chains::{Kind, Shape};

const EJ_NM2: f64 = 2.1e11 * 8.333e-10;
/// A cantilever under its weight, its root held.
const CANTILEVER: &str = "
[beam]
length_m = 0.5
area_m2 = 1e-4
second_moment_m4 = 8.333e-10
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e11
elements = 4
modes = 8
[gravity]
y_m_per_s2 = -9.81
[start]
static_equilibrium = true
[drive]
speed_rad_per_s = 0.0
";

#[test]
fn val_a_cantilever_under_its_weight() {
    let (weight, length) = (0.77 * 9.81, 0.5_f64);
    for model in [MODAL, FINITE] {
        let mut run = simulation(CANTILEVER, &[model]);
        let seen = look(&mut run);
        let beam = &seen.links[0];
        let tip = beam.nodes[4].position_m[1] / (-weight * length.powi(4) / (8.0 * EJ_NM2)) - 1.0;
        let (force, torque) = (seen.pivot_n.unwrap()[1], seen.motion_torque_nm.unwrap());
        assert!(tip.abs() < 1e-5, "{model}: tip {tip:e}");
        assert!((force / (weight * length) - 1.0).abs() < 1e-9, "{model}: {force} N");
        assert!((torque / (weight * length * length / 2.0) - 1.0).abs() < 1e-5, "{model}: {torque} N m");
        for (k, element) in beam.elements.iter().enumerate() {
            let [from, to] = [0.5, 0.375].map(|beyond| beyond - 0.125 * k as f64);
            let errors = [
                element.moment_start_nm + weight * from * from / 2.0,
                element.moment_end_nm + weight * to * to / 2.0,
                0.1 * (element.shear_n + weight * (from + to) / 2.0),
            ];
            assert!(largest(errors) < 1e-5, "{model}, element {k}: {errors:?}");
        }
    }
}

/// A tip load `P` with `P L²/EJ = 1` on a cantilever: the tip comes to (0.94357, −0.30172) L (Mattiasson, Int. J. Numer. Methods
/// Eng. 17, 1981).
#[test]
fn val_large_deflection_of_a_cantilever() {
    let load = ["beam.density_kg_per_m3=1e-6", "beam.second_moment_m4=8.333e-12", "beam.elements=16"];
    let tip = format!("tip.mass_kg={}", EJ_NM2 / 100.0 / 0.25 / 9.81);
    let mut run = simulation(CANTILEVER, &[FINITE, &tip, load[0], load[1], load[2]]);
    let [x, y] = look(&mut run).links[0].nodes[16].position_m;
    assert!((x / 0.5 - 0.94357).abs() < 1e-5 && (y / 0.5 + 0.30172).abs() < 1e-5, "{x} {y}");
}

#[test]
fn prop_static_equilibrium_stays_at_rest() {
    let still = ["drive={ speed_rad_per_s = 0.0 }", "start.rate_rad_per_s=0.0", "start.static_equilibrium=true"];
    for shape in [Shape::Slider, Shape::Beam] {
        for rigid in [[false, false], [true, false], [false, true]] {
            let text = Kind { driven: true, rigid, ..Kind::plain(shape) }.toml();
            for model in [MODAL, FINITE] {
                let mut run = simulation(&text, &[&[model][..], &still[..]].concat());
                let before = look(&mut run).clone();
                let bent =
                    before.links.iter().flat_map(|link| &link.nodes).any(|node| node.deflection_m.unwrap_or(0.0).abs() > 1e-5);
                assert!(bent || (shape == Shape::Beam && rigid[0]), "{shape:?} {rigid:?}, {model}: bent by its weight");
                run_to(&mut run, 0.2);
                let after = look(&mut run);
                let [a, b] = [&before, after].map(|seen| seen.links.last().unwrap().nodes[2].position_m);
                let moved = (a[0] - b[0]).hypot(a[1] - b[1]);
                assert!(moved < 1e-10, "{shape:?} {rigid:?}, {model}: {moved:e} m");
            }
        }
    }
}
