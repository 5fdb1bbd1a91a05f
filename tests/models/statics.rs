//! Static equilibrium at the start, against closed forms and against rest.

use flexcrank::mechanics::Observation;
use flexcrank::simulation::Simulation;

use crate::bench::{FINITE, MODAL, RIGID, largest, look, run_to, scene, simulation, start};
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

#[test]
fn prop_every_model_holds_the_same_tangent() {
    let overrides = ["start.angle_rad=0.3", "start.static_equilibrium=true", "gravity.y_m_per_s2=-9.81"];
    let roots = ["modal", "finite-element"].map(|model| {
        let model = format!("solver.model={model}");
        let mut run = simulation("crank-slider", &[&[model.as_str(), "pulse=[]"], &overrides[..]].concat());
        let seen = run.observe().unwrap();
        [seen.links[0].nodes[0].rotation_rad.unwrap(), seen.links[0].chord_rad]
    });
    let [modal, finite] = roots;
    assert!((modal[0] - 0.3).abs() < 1e-12 && (finite[0] - 0.3).abs() < 1e-12, "{modal:?} {finite:?}");
    assert!((modal[1] - finite[1]).abs() < 1e-4, "{modal:?} {finite:?}");
}

#[test]
fn prop_forces_during_a_smooth_pulse_are_those_of_their_instant() {
    for model in ["solver.model=modal", "solver.model=finite-element"] {
        let [coarse, fine] = ["solver.step_s=1e-4", "solver.step_s=1e-5"].map(|step| {
            let mut run = simulation("ref-r2s", &[model, step]);
            while run.time_s() < 0.03 - 1e-9 {
                run.step().unwrap();
            }
            run.observe().unwrap().pivot_n.unwrap()[1]
        });
        assert!((coarse - fine).abs() < 1.0, "{model}: {coarse} N at 1e-4 s, {fine} N at 1e-5 s");
    }
}

/// The cantilever on a torsion spring in place of a hold.
fn sprung(overrides: &[&str]) -> Simulation {
    let text = CANTILEVER.replace("[drive]\nspeed_rad_per_s = 0.0\n", "[base]\ntorsion_spring_nm_per_rad = 3.0\n");
    simulation(&text, overrides)
}

/// The tangent at the pivot.
fn root(seen: &Observation) -> f64 {
    seen.links[0].nodes[0].rotation_rad.unwrap()
}

/// `k θ = −w (½ L² cos θ + w sin θ cos θ L⁵/(20 EJ))`, the second term as the beam's sag moves its weight; the tip stands
/// `−w cos θ L⁴/(8 EJ)` off the tangent. What is left out is of second order in sag over length, 7e-4.
#[test]
fn val_a_beam_under_its_weight_on_a_torsion_spring() {
    let (weight, length, spring) = (0.77 * 9.81, 0.5_f64, 3.0);
    let sag = |angle: f64| weight * angle.sin() * angle.cos() * length.powi(5) / (20.0 * EJ_NM2);
    let moment = |angle: f64| weight * (0.5 * length.powi(2) * angle.cos() + sag(angle));
    let angle = (0..100).fold(0.0, |angle, _| 0.5 * (angle - moment(angle) / spring));
    let off = weight * angle.cos() * length.powi(4) / (8.0 * EJ_NM2);
    let tip = [length * angle.cos() + off * angle.sin(), length * angle.sin() - off * angle.cos()];
    for model in [MODAL, FINITE] {
        let mut run = sprung(&[model]);
        let seen = look(&mut run);
        let beam = &seen.links[0];
        let [x, y] = beam.nodes[4].position_m;
        assert!((root(seen) - angle).abs() < 1e-6, "{model}: {} rad for {angle} rad", root(seen));
        assert!(largest([x - tip[0], y - tip[1]]) < 5e-7, "{model}: {x} {y} for {tip:?}");
        let errors = [beam.elements[0].moment_start_nm - spring * root(seen), seen.pivot_n.unwrap()[1] - weight * length];
        assert!(largest(errors) < 1e-8, "{model}: {errors:?}");
    }
    let mut rigid = sprung(&[RIGID]);
    let error = spring * root(look(&mut rigid)) + 0.5 * weight * length.powi(2) * root(look(&mut rigid)).cos();
    assert!(error.abs() < 1e-11, "{error:e} N m");
}

/// A metre of steel on a spring so stiff that it hardly turns: moments and forces of the first sample are those that act.
#[test]
fn regress_the_first_sample_has_the_moment_of_a_stiff_spring() {
    let (weight, spring) = (0.77 * 9.81, 1e9);
    for model in [MODAL, FINITE] {
        let mut run = sprung(&[model, "beam.length_m=1.0", "base.torsion_spring_nm_per_rad=1e9"]);
        for _ in 0..3 {
            let seen = look(&mut run);
            let errors = [seen.links[0].elements[0].moment_start_nm + 0.5 * weight, seen.pivot_n.unwrap()[1] - weight];
            assert!(largest(errors) < 1e-4, "{model}: {errors:?}");
            assert!((root(seen) * spring + 0.5 * weight).abs() < 1e-4, "{model}: {} rad", root(seen));
            run.step().unwrap();
        }
    }
}

/// Straight at rest on a stressed spring: no equilibrium, but the first sample has the spring's moment.
#[test]
fn prop_the_first_sample_has_the_moment_of_a_stressed_spring() {
    for model in [RIGID, MODAL, FINITE] {
        let mut run = sprung(&[model, "start={ angle_rad = 0.3 }"]);
        let moment = look(&mut run).links[0].elements[0].moment_start_nm;
        assert!((moment - 0.9).abs() < 1e-9, "{model}: {moment} N m");
    }
}

#[test]
fn prop_static_equilibrium_on_a_spring_stays_at_rest() {
    let still = ["pulse=[]", "start={ angle_rad = 0.6, static_equilibrium = true }", "base.damper_nm_s_per_rad=0.0"];
    for (shape, rigid, table) in [
        (Shape::Slider, [false, false], false),
        (Shape::Slider, [true, false], false),
        (Shape::Slider, [false, true], true),
        (Shape::Slider, [false, false], true),
        (Shape::Beam, [false, false], false),
        (Shape::Beam, [true, true], false),
    ] {
        let text = Kind { rigid, table, ..Kind::plain(shape) }.toml();
        for model in [RIGID, MODAL, FINITE] {
            let mut scene = scene(&text, &[&[model][..], &still[..]].concat());
            for integrator in scene.solver.model.integrators() {
                scene.solver.integrator = *integrator;
                scene.solver.step_s = if integrator.as_str() == "runge-kutta" { 1e-4 } else { 1e-3 };
                let moved = moved_in_a_second_m(&mut start(&scene));
                assert!(moved < 1e-9, "{shape:?} {rigid:?}, {model}, {}: {moved:e} m", integrator.as_str());
            }
        }
    }
}

/// Largest displacement of any node from its start, in ten observations.
fn moved_in_a_second_m(run: &mut Simulation) -> f64 {
    let positions = |seen: &Observation| seen.links.iter().flat_map(|link| &link.nodes).map(|node| node.position_m).collect();
    let before: Vec<[f64; 2]> = positions(look(run));
    let away = |look: u32| {
        run_to(run, 0.1 * f64::from(look));
        let after: Vec<[f64; 2]> = positions(self::look(run));
        largest(before.iter().zip(after).flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]]))
    };
    largest((1..=10).map(away))
}

/// All models come to rest at the same angle; stiff links where rigid ones do.
#[test]
fn prop_every_model_comes_to_rest_at_the_same_angle() {
    let still = ["pulse=[]", "start={ angle_rad = 0.6, static_equilibrium = true }"];
    for shape in [Shape::Slider, Shape::Beam] {
        let text = Kind::plain(shape).toml();
        let angle =
            |text: &str, model: &str| look(&mut simulation(text, &[&[model][..], &still[..]].concat())).links[0].chord_rad;
        let [modal, finite] = [MODAL, FINITE].map(|model| angle(&text, model));
        assert!((modal - finite).abs() < 1e-4 && (modal - 0.6).abs() > 0.1, "{shape:?}: {modal} {finite}");
        let stiff = text.replace("youngs_modulus_pa = 2.1e9", "youngs_modulus_pa = 2.1e16");
        let [rigid, modal, finite] = [RIGID, MODAL, FINITE].map(|model| angle(&stiff, model));
        assert!(largest([modal - rigid, finite - rigid]) < 1e-6, "{shape:?}: {rigid} {modal} {finite}");
    }
}

/// On a soft spring a beam may stand upside down, but not for long: a start beside that place leads down to where it can lie.
#[test]
fn prop_static_equilibrium_is_sought_downhill() {
    let half = 0.77 * 9.81 * 0.125;
    for model in [RIGID, MODAL, FINITE] {
        for (from, low, high) in [(2.02, 3.0, 4.0), (1.9, -1.5, 0.0), (20.0, 3.0, 4.0)] {
            let angle = format!("start.angle_rad={from:?}");
            let angle = root(look(&mut sprung(&[model, "base.torsion_spring_nm_per_rad=0.2", &angle])));
            assert!((low..high).contains(&angle), "{model} from {from}: {angle}");
            assert!(0.2 - half * angle.sin() > 0.0, "{model} from {from}: {angle} is unstable");
        }
    }
}

#[test]
fn prop_no_equilibrium_within_reach_is_refused() {
    for model in [RIGID, MODAL, FINITE] {
        let text = CANTILEVER.replace("[drive]\nspeed_rad_per_s = 0.0\n", "[base]\ntorsion_spring_nm_per_rad = 3.0\n");
        let far = scene(&text, &[model, "start.angle_rad=1e5"]);
        let refused = Simulation::new(&far).err().unwrap();
        assert_eq!(refused.key, "start.static_equilibrium", "{model}: {refused}");
        assert!(refused.to_string().contains("many turns from where the base spring balances"), "{model}: {refused}");
    }
}

/// A modulus in GPa and a length in mm leave a rod far too soft for its weight; a large load needs no weight for that.
#[test]
fn regress_a_link_too_soft_for_its_loads_is_named_where_no_start_is_found() {
    let rod = "Check rod.youngs_modulus_pa, rod.length_m and its section";
    for (model, given, key, remedy) in [
        (MODAL, "rod.youngs_modulus_pa=210", "start", rod),
        (FINITE, "rod.youngs_modulus_pa=210", "start.static_equilibrium", rod),
        (MODAL, "rod.length_m=420", "start.static_equilibrium", rod),
        (MODAL, "slider.resistance_n=1e4", "start.static_equilibrium", "then the loads: gravity, slider.resistance_n"),
    ] {
        let soft = scene("crank-slider", &[model, given, "gravity.y_m_per_s2=-9.81", "start.static_equilibrium=true"]);
        let refused = Simulation::new(&soft).err().unwrap();
        assert_eq!(refused.key, key, "{model}, {given}: {refused}");
        assert!(refused.to_string().contains(remedy), "{model}, {given}: {refused}");
    }
}

#[test]
fn regress_a_constant_torque_acts_from_the_first_sample_on() {
    for model in [RIGID, MODAL, FINITE] {
        let mut run = sprung(&[model, "torque.constant_nm=2.0", "base.torsion_spring_nm_per_rad=0.0", "start.angle_rad=0.0"]);
        let moment = look(&mut run).links[0].elements[0].moment_start_nm;
        assert!((moment + 2.0).abs() < 1e-9, "{model}: {moment} N m");
        assert_eq!(run.take_driving_torque_nm(), 2.0, "{model}");
    }
}

/// `k θ = τ` without a weight.
#[test]
fn val_a_spring_balances_a_constant_torque() {
    for model in [RIGID, MODAL, FINITE] {
        let mut run = sprung(&[model, "torque.constant_nm=2.0", "gravity.y_m_per_s2=0.0"]);
        let angle = root(look(&mut run));
        assert!((angle - 2.0 / 3.0).abs() < 1e-12, "{model}: {angle} rad");
        let moved = moved_in_a_second_m(&mut run);
        assert!(moved < 1e-12, "{model}: {moved:e} m");
    }
}
