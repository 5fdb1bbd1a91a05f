//! State spaces beside closed forms, the models themselves, and runs.

use std::error::Error;
use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};

use super::scheme::Scheme;
use super::{Crank, StateSpace, Subject, modes};
use crate::scene::{Scene, SceneSource};
use crate::simulation::Simulation;

type Outcome = Result<(), Box<dyn Error>>;

fn scene(name: &str, overrides: &[&str]) -> Result<Scene, Box<dyn Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    Ok(SceneSource::open(name, &overrides)?.scene)
}

/// A scene's state space at rest at an angle.
fn at_rest(name: &str, overrides: &[&str], crank: Option<Crank>, angle_deg: f64) -> Result<StateSpace, Box<dyn Error>> {
    let subject = Subject::new(&scene(name, overrides)?, crank)?;
    Ok(StateSpace::new(&subject, &subject.at_rest(angle_deg.to_radians())?)?)
}

fn place(names: &[String], name: &str) -> Result<usize, String> {
    names.iter().position(|other| other == name).ok_or_else(|| format!("no {name} among {names:?}"))
}

const TWO_MASSES: [&str; 2] = ["oscillator.masses_kg=[1.0,2.0]", "oscillator.springs=[[0,1,300.0],[1,2,200.0]]"];
const STIFF: [&str; 4] =
    ["solver.model=finite-element", "solver.integrator=generalized-alpha", "crank.elements=4", "rod.elements=8"];

const SHORT_CRANK: &str = "[crank]\nlength_m = 0.08\nsection = { shape = \"rectangle\", width_m = 0.01, height_m = 0.02 }\n\
                           density_kg_per_m3 = 7850\nyoungs_modulus_pa = 2.1e11\n\
                           [rod]\nlength_m = 0.32\nsection = { shape = \"rectangle\", width_m = 0.015, height_m = 0.004 }\n\
                           density_kg_per_m3 = 2700\nyoungs_modulus_pa = 7e10\n\
                           [slider]\nmass_kg = 0.4\nfriction_n_s_per_m = 3\n[base]\ndamper_nm_s_per_rad = 0.002\n\
                           [gravity]\ny_m_per_s2 = -9.81\n";

/// `[500 − ω², −200; −200, 200 − 2ω²]⁻¹ (1, 0)`.
#[test]
fn val_the_frequency_response_of_two_masses_is_their_closed_form() -> Outcome {
    let space = at_rest("thesis-two-masses", &TWO_MASSES, None, 0.0)?;
    assert_eq!(space.states, ["mass_1_m", "mass_2_m", "mass_1_m_per_s", "mass_2_m_per_s"]);
    assert_eq!(space.inputs, ["mass_1_force_n", "mass_2_force_n"]);
    for frequency_hz in [0.01, 0.5, 1.3, 2.9, 10.0] {
        let square = (TAU * frequency_hz).powi(2);
        let whole = (500.0 - square) * (200.0 - 2.0 * square) - 40_000.0;
        let found = space.frequency_response(0, frequency_hz)?;
        for (name, exact) in [("mass_1_m", (200.0 - 2.0 * square) / whole), ("mass_2_m", 200.0 / whole)] {
            let error = (found[place(&space.outputs, name)?] - exact).norm();
            assert!(error < 1e-12 * exact.abs(), "{name} at {frequency_hz} Hz: {error:e}");
        }
    }
    Ok(())
}

/// A hold at a hundredth of the period passes slow inputs as continuous time does, but for its delay of half a step.
#[test]
fn val_the_frequency_response_of_a_hold_is_delayed_by_half_a_step() -> Outcome {
    let space = at_rest("crank-slider", &[], None, 57.0)?;
    let (frequency_hz, step_s) = (0.5, 1e-4);
    let held = space.zero_order_hold(step_s)?.frequency_response(0, frequency_hz)?;
    let delay = Complex::new(0.0, -0.5 * TAU * frequency_hz * step_s).exp();
    for (name, (held, continuous)) in space.outputs.iter().zip(held.iter().zip(space.frequency_response(0, frequency_hz)?.iter()))
    {
        // Forces follow the torque at once.
        if name.ends_with("_rad") || name.ends_with("_m") {
            assert!((held - continuous * delay).norm() < 1e-6 * continuous.norm(), "{name}: {held} for {continuous}");
        }
    }
    Ok(())
}

/// `2ω⁴ − 1200ω² + 60000 = 0`.
#[test]
fn val_the_eigenvalues_of_two_masses_are_their_closed_form() -> Outcome {
    let root = (1200.0_f64.powi(2) - 8.0 * 60000.0).sqrt();
    let exact = [(1200.0 - root) / 4.0, (1200.0 + root) / 4.0].map(f64::sqrt);
    let found = at_rest("thesis-two-masses", &TWO_MASSES, None, 0.0)?.eigenvalues();
    for (found, exact) in found.iter().step_by(2).zip(exact) {
        assert!((found.norm() / exact - 1.0).abs() < 1e-13, "{found} for {exact}");
    }
    Ok(())
}

/// One mass on a spring, with `ωh` up to 1e4: `cos ωh`, `sin ωh/ω`, and `(1 − cos ωh)/k` by a force.
#[test]
fn val_the_hold_of_a_stiff_mass_is_its_closed_form() -> Outcome {
    for omega in [1.0, 1e3, 1e5, 1e7] {
        let stiffness = format!("oscillator.springs=[[0,1,{:e}]]", omega * omega);
        let one = ["oscillator.masses_kg=[1.0]", &stiffness, "oscillator.start_m=[0.0]", "oscillator.forces_n=[0.0]"];
        let step_s = 1e-3;
        let held = at_rest("thesis-two-masses", &one, None, 0.0)?.zero_order_hold(step_s)?;
        let (sin, cos) = (omega * step_s).sin_cos();
        let turn = [cos, sin / omega, -omega * sin, cos];
        for ((k, exact), unit) in turn.into_iter().enumerate().zip([1.0, 1.0 / omega, omega, 1.0]) {
            let error = (held.a[(k / 2, k % 2)] - exact).abs() / unit;
            assert!(error < 1e-10, "{k} of {omega}: {error:e}");
        }
        let by_force = [(1.0 - cos) / (omega * omega), sin / omega];
        for ((row, exact), unit) in by_force.into_iter().enumerate().zip([1.0 / (omega * omega), 1.0 / omega]) {
            let error = (held.b[(row, 0)] - exact).abs() / unit;
            assert!(error < 1e-10, "force {row} of {omega}: {error:e}");
        }
    }
    Ok(())
}

/// Eigenvectors, found by inverse iteration on the banded matrices, grow by `e^(λh)`; the fastest eigenvalue times h is 1e4.
#[test]
fn val_the_hold_of_stiff_finite_elements_turns_their_modes() -> Outcome {
    let subject = Subject::new(&scene("crank-slider", &STIFF)?, None)?;
    let point = subject.at_rest(57_f64.to_radians())?;
    let space = StateSpace::new(&subject, &point)?;
    let fastest = space.eigenvalues().last().map_or(0.0, |value| value.norm());
    let step_s = 1e4 / fastest;
    let held = space.zero_order_hold(step_s)?.a.map(|entry| Complex::new(entry, 0.0));
    let mut largest = 0.0_f64;
    for mode in modes(&subject, &point, 6)?.iter().filter(|mode| mode.eigenvalue.norm() > 0.0) {
        let rates = &mode.shape * mode.eigenvalue;
        let state = DVector::from_iterator(2 * mode.shape.len(), mode.shape.iter().chain(rates.iter()).copied());
        let exact = &state * (mode.eigenvalue * step_s).exp();
        let found = &held * state;
        for part in [0, mode.shape.len()] {
            let [found, exact] = [&found, &exact].map(|x| x.rows(part, mode.shape.len()));
            let size = exact.iter().fold(0.0, |most: f64, x| most.max(x.norm()));
            let off = (found - exact).iter().fold(0.0, |most: f64, x| most.max(x.norm())) / size;
            largest = largest.max(off);
        }
    }
    assert!(largest < 1e-9, "{largest:e} at a step of {step_s} s");
    Ok(())
}

/// Newton's law of the slider, `m ẍ = N + F − R`, holds between rows that are exact and rows by differences.
#[test]
fn val_rows_by_differences_obey_the_law_of_the_slider() -> Outcome {
    for overrides in [&[][..], &STIFF, &["solver.model=rigid", "solver.integrator=esdirk"]] {
        for crank in [Crank::Free, Crank::Held] {
            if crank == Crank::Held && overrides.contains(&"solver.model=rigid") {
                continue;
            }
            let space = at_rest("crank-slider", overrides, Some(crank), 57.0)?;
            let (speed, pin) = (place(&space.outputs, "slider_speed_m_per_s")?, place(&space.outputs, "slider_pin_x_n")?);
            let by_state = space.c.row(speed) * &space.a * 0.2;
            let mut by_input = space.c.row(speed) * &space.b * 0.2;
            by_input[place(&space.inputs, "slider_force_n")?] -= 1.0;
            let pairs = [(space.c.row(pin), &by_state), (space.d.row(pin), &by_input)];
            for (found, exact) in pairs {
                let (off, size) = ((found - exact).amax(), exact.amax());
                assert!(off <= 1e-11 * size, "{overrides:?} {crank:?}: {off:e} of {size:e}");
            }
        }
    }
    Ok(())
}

/// A run of the default scene from rest at 57° under a torque of 0.02 s; the samples of its slider and chord, and of the forces.
fn run(torque_nm: f64, overrides: &[&str], samples: usize) -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
    let pulse = format!("pulse=[{{start_s=0.0,torque_nm={torque_nm:e},duration_s=0.02}}]");
    let scene = scene("crank-slider", &[overrides, &["start.angle_rad=0.9948376736367679", &pulse]].concat())?;
    let mut simulation = Simulation::new(&scene)?;
    let mut seen = Vec::new();
    while seen.len() < samples {
        let links = &simulation.observe()?.links;
        let slider = links.last().and_then(|link| link.nodes.last()).ok_or("no slider")?.position_m[0];
        seen.push([slider, links[0].chord_rad, links[1].chord_rad]);
        simulation.step()?;
    }
    Ok(seen)
}

const SEEN: [&str; 3] = ["slider_m", "crank_chord_rad", "rod_chord_rad"];

/// The same samples as the state space predicts them.
fn predicted(space: &StateSpace, torque_nm: f64, step_s: f64, samples: usize) -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
    let rows = SEEN.map(|name| place(&space.outputs, name).unwrap_or_default());
    let torque = place(&space.inputs, "torque_nm")?;
    let pulse = (0.02 / step_s).round() as usize;
    let mut x = DVector::zeros(space.a.nrows());
    let mut seen = Vec::new();
    for sample in 0..samples {
        let y = &space.c * &x;
        seen.push(rows.map(|row| y[row]));
        x = &space.a * x + space.b.column(torque) * if sample < pulse { torque_nm } else { 0.0 };
    }
    Ok(seen)
}

/// Largest difference between a run and its prediction, and largest response, of each of the three.
fn error(run: &[[f64; 3]], predicted: &[[f64; 3]]) -> [[f64; 2]; 3] {
    [0, 1, 2].map(|k| {
        let moved = || run.iter().map(|sample| sample[k] - run[0][k]);
        let most = |of: &mut dyn Iterator<Item = f64>| of.fold(0.0, |most: f64, x| most.max(x.abs()));
        [most(&mut moved().zip(predicted).map(|(moved, predicted)| moved - predicted[k])), most(&mut moved())]
    })
}

/// By an exact hold and a run with fine steps, over two decades.
#[test]
fn prop_prediction_error_falls_with_the_square_of_the_disturbance() -> Outcome {
    let fine = ["solver.step_s=5e-5", "solver.tolerance=1e-12"];
    let samples = 4000;
    let held = at_rest("crank-slider", &[], None, 57.0)?.zero_order_hold(5e-5)?;
    let mut errors = Vec::new();
    for torque_nm in [1e-2, 1e-1, 1.0] {
        let run = run(torque_nm, &fine, samples)?;
        errors.push(error(&run, &predicted(&held, torque_nm, 5e-5, samples)?));
    }
    for (k, name) in SEEN.iter().enumerate() {
        for pair in errors.windows(2) {
            let slope = (pair[1][k][0] / pair[0][k][0]).log10();
            assert!((slope - 2.0).abs() < 0.05, "{name}: slope {slope}");
        }
    }
    Ok(())
}

/// The map of a scheme's step predicts a run of that scheme at the scene's own steps, from a small pulse on.
#[test]
fn val_the_map_of_a_step_predicts_a_run() -> Outcome {
    let space = at_rest("crank-slider", &[], None, 57.0)?;
    let step_s = 2e-3;
    for (scheme, integrator, more) in [
        (Scheme::GeneralizedAlpha(0.8), "solver.integrator=generalized-alpha", "solver.rho_infinity=0.8"),
        (Scheme::TwoPoint(0.5), "solver.integrator=two-point", "solver.weight=0.5"),
        (Scheme::TwoPoint(0.7), "solver.integrator=two-point", "solver.weight=0.7"),
        (Scheme::Esdirk, "solver.integrator=esdirk", "solver.step_s=2e-3"),
    ] {
        let map = space.stepped_by(scheme, step_s)?;
        let run = run(1e-4, &[integrator, more, "solver.step_s=2e-3", "solver.tolerance=1e-12"], 300)?;
        let found = error(&run, &predicted(&map, 1e-4, step_s, 300)?);
        let relative = found.map(|[off, most]| off / most);
        // ESDIRK begins its step anew where the pulse begins: from rest, that is all of the load.
        let bound = if scheme == Scheme::Esdirk { 1e-4 } else { 1e-5 };
        assert!(relative.iter().all(|off| *off < bound), "{scheme:?}: {relative:?}");
    }
    Ok(())
}

/// In a steady rotation A has the eigenvalues of the modes.
#[test]
fn val_a_steady_rotation_has_the_eigenvalues_of_its_modes() -> Outcome {
    let free = ["base.torsion_spring_nm_per_rad=0.0", "pulse=[]", "solver.model=modal", "solver.integrator=esdirk"];
    let subject = Subject::new(&scene("thesis-beam", &free)?, Some(Crank::Free))?;
    let point = subject.turning(0.3, 50.0)?;
    let found = StateSpace::new(&subject, &point)?.eigenvalues();
    for mode in modes(&subject, &point, 4)?.iter().filter(|mode| mode.eigenvalue.norm() > 0.0) {
        let off = found.iter().map(|value| (value - mode.eigenvalue).norm()).fold(f64::INFINITY, f64::min);
        assert!(off < 1e-7 * mode.eigenvalue.norm(), "{}: {off:e} of {}", mode.name(), mode.eigenvalue);
    }
    Ok(())
}

/// A light beam bears a heavy tip round: in axes that turn along, the pivot's force is `m (ÿ + 2 Ω × ẏ − Ω² y)` of the tip,
/// but for the beam's own mass, 1e-6 of the tip's.
#[test]
fn val_forces_in_axes_that_turn_along_have_coriolis_terms() -> Outcome {
    let heavy = ["beam.density_kg_per_m3=1e-3", "tip.mass_kg=2.0", "base.torsion_spring_nm_per_rad=0.0", "pulse=[]"];
    for model in [
        ["solver.model=finite-element", "solver.integrator=generalized-alpha"],
        ["solver.model=modal", "solver.integrator=esdirk"],
    ] {
        let subject = Subject::new(&scene("thesis-beam", &[&heavy[..], &model].concat())?, Some(Crank::Free))?;
        let speed = 30.0;
        let space = StateSpace::new(&subject, &subject.turning(0.4, speed)?)?;
        for frequency_hz in [0.5, 3.0, 20.0] {
            let z = Complex::new(0.0, TAU * frequency_hz);
            let found = space.frequency_response(place(&space.inputs, "torque_nm")?, frequency_hz)?;
            let at = |name: &str| place(&space.outputs, name).map(|place| found[place]);
            let [x, y] = [at("tip_x_m")?, at("tip_y_m")?];
            let own = z * z - speed * speed;
            let coriolis = z * (2.0 * speed);
            let exact = [(x * own - y * coriolis) * 2.0, (y * own + x * coriolis) * 2.0];
            for (name, exact) in ["pivot_x_n", "pivot_y_n"].into_iter().zip(exact) {
                let off = (at(name)? - exact).norm() / exact.norm();
                assert!(off < 3e-6, "{model:?}: {name} at {frequency_hz} Hz: {off:e}");
            }
        }
    }
    Ok(())
}

/// Coordinates of finite elements stand still and are turned along; those of floating frames turn along by themselves.
#[test]
fn prop_forces_in_a_steady_rotation_are_alike_in_both_models() -> Outcome {
    let own = ["base.torsion_spring_nm_per_rad=0.0", "pulse=[]", "beam.elements=2"];
    let mut found = Vec::new();
    for model in [
        ["solver.model=finite-element", "solver.integrator=generalized-alpha"],
        ["solver.model=modal", "solver.integrator=esdirk"],
    ] {
        let subject = Subject::new(&scene("thesis-beam", &[&own[..], &model].concat())?, Some(Crank::Free))?;
        let space = StateSpace::new(&subject, &subject.turning(0.4, 30.0)?)?;
        let response = space.frequency_response(place(&space.inputs, "torque_nm")?, 10.0)?;
        let at = |name: &str| place(&space.outputs, name).map(|place| response[place]);
        found.push([at("pivot_x_n")?, at("pivot_y_n")?]);
    }
    let [one, other] = [found[0], found[1]];
    for (one, other) in one.iter().zip(other) {
        assert!((one - other).norm() < 1e-4 * other.norm(), "{one} and {other}");
    }
    Ok(())
}

/// A short crank of steel with many elements: what holds the chain's swing is rounding beside the stiffness of one of them. From 36 on,
/// modes said that the chain turns freely, and the response erred by 2e-2.
#[test]
fn val_many_finite_elements_keep_the_swing_of_a_short_crank() -> Outcome {
    let swing = |model: &str, elements: usize| -> Result<(f64, Complex<f64>, f64), Box<dyn Error>> {
        let keys = [format!("solver.model={model}"), format!("crank.elements={elements}"), format!("rod.elements={elements}")];
        let subject = Subject::new(&SceneSource::parse("short.toml", SHORT_CRANK, &keys)?.scene, None)?;
        let point = subject.at_rest(-0.25 * TAU)?;
        let found = modes(&subject, &point, 8)?;
        let space = StateSpace::new(&subject, &point)?;
        let response = space.frequency_response(0, 0.3)?[place(&space.outputs, "crank_angle_rad")?];
        assert_eq!(found[0].name(), "chain swing", "{model}, {elements} elements");
        Ok((found[0].frequency_hz(), response, space.rounding_of(&found[0])))
    };
    let (expected_hz, expected, rounding) = swing("modal", 4)?;
    assert!(rounding < 1e-12, "{rounding:e}");
    for (elements, most, least_rounding) in [(8, 1e-5, 0.0), (36, 1e-3, 1e-3), (64, 5e-3, 1e-2)] {
        let (hz, response, rounding) = swing("finite-element", elements)?;
        let off = [hz / expected_hz - 1.0, (response / expected - 1.0).norm()];
        assert!(off.iter().all(|off| off.abs() < most), "{elements} elements: {off:?}");
        assert!(rounding > least_rounding, "{elements} elements: {rounding:e}");
    }
    Ok(())
}
