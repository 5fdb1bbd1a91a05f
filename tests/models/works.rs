//! Works of the energy account against closed forms, and against quadratures of the motion that owe the account nothing.

use std::f64::consts::{PI, TAU};

use flexcrank::mechanics::Observation;
use flexcrank::simulation::Simulation;

use crate::bench::{FINITE, MODAL, RIGID, energy_j, look, run_to, simulation};

/// A scheme with a step at which it is right to the bounds below.
type Scheme = (&'static str, f64);

const L_M: f64 = 1.5;
const EJ_NM2: f64 = 2.1e11 * 8.333e-12;
const KG_PER_M: f64 = 7700.0 * 1e-4;

/// A rod between a pin that is held and a massless slider, straight until a weight begins that it hardly feels.
fn sagging(damping_s: f64) -> String {
    format!(
        "[crank]\nlength_m = 0.5\nrigid = true\nmass_kg = 0.0\n[rod]\nlength_m = {L_M}\narea_m2 = 1e-4\nsecond_moment_m4 = 8.333e-12\n\
         density_kg_per_m3 = 7700.0\nyoungs_modulus_pa = 2.1e11\ndamping_s = {damping_s}\n[slider]\nmass_kg = 0.0\n\
         [drive]\nspeed_rad_per_s = 0.0\n[gravity]\ny_m_per_s2 = -1e-3\n"
    )
}

/// What mode k has dissipated by `time_s`: `F x − ½ M ẋ² − ½ K x²` with `x = F/K (1 − e^{−ζωt} (cos ω′t + ζω/ω′ sin ω′t))`,
/// `ζ = cω/2`, `ω′ = ω √(1 − ζ²)`; of sin kπξ, `M = ½ m L`, `K = M ω²`, `F = 2 m g L/kπ`.
fn dissipated_j(k: f64, damping_s: f64, time_s: f64) -> f64 {
    let omega = (k * PI / L_M).powi(2) * (EJ_NM2 / KG_PER_M).sqrt();
    let (mass, force) = (0.5 * KG_PER_M * L_M, 2.0 * KG_PER_M * 1e-3 * L_M / (k * PI));
    let decay = 0.5 * damping_s * omega * omega;
    let turning = (omega * omega - decay * decay).sqrt();
    let (sin, cos) = (turning * time_s).sin_cos();
    let (left, still) = ((-decay * time_s).exp(), force / (mass * omega * omega));
    let x = still * (1.0 - left * (cos + decay / turning * sin));
    let v = still * left * omega * omega / turning * sin;
    force * x - 0.5 * mass * (v * v + omega * omega * x * x)
}

/// Modes above the seventh have less than 5e-6 of it.
#[test]
fn val_material_damping_dissipates_as_in_closed_form() {
    let schemes: [Scheme; 3] = [("esdirk", 5e-3), ("two-point", 5e-4), ("generalized-alpha", 5e-4)];
    for (integrator, step_s) in schemes {
        for (model, detail, modes, bound) in
            [(MODAL, "rod.modes=1", &[1.0][..], 2e-5), (FINITE, "rod.elements=16", &[1.0, 3.0, 5.0, 7.0][..], 2e-4)]
        {
            let scheme = [format!("solver.integrator={integrator}"), format!("solver.step_s={step_s}")];
            let keys = [model, detail, &scheme[0], &scheme[1], "solver.weight=0.5", "solver.tolerance=1e-11"];
            let mut run = simulation(&sagging(5e-3), &keys);
            for time_s in [0.5, 1.0, 3.0] {
                run_to(&mut run, time_s);
                let expected: f64 = modes.iter().map(|k| dissipated_j(*k, 5e-3, time_s)).sum();
                let error = run.ledger().dissipated_j / expected - 1.0;
                println!("{integrator} {model} {time_s} s: {error:.1e} of {expected:e} J");
                assert!(error.abs() < bound, "{integrator}, {model}, {time_s} s: {error:e} of {expected:e} J");
            }
        }
    }
}

/// A rigid beam of `I = 0.2 kg·m²` with a damper `c` under a constant torque τ from rest: `ω = τ/c (1 − e^{−ct/I})`, put in `τθ`, dissipated
/// `τθ − ½ I ω²`.
#[test]
fn val_a_damper_dissipates_as_in_closed_form() {
    let text = "[beam]\nlength_m = 1.0\nrigid = true\nmass_kg = 0.4\ncentre_of_mass_m = 0.5\ninertia_kg_m2 = 0.1\n\
                [base]\ndamper_nm_s_per_rad = 0.3\n[[pulse]]\nstart_s = 0.0\ntorque_nm = 2.0\nduration_s = 100.0\n";
    for (integrator, step_s, bound) in
        [("esdirk", 2e-3, 5e-7), ("runge-kutta", 0.01, 5e-9), ("two-point", 1e-3, 1e-6), ("generalized-alpha", 1e-3, 3e-6)]
    {
        for model in [RIGID, MODAL, FINITE] {
            if integrator == "runge-kutta" && model == FINITE {
                continue;
            }
            let scheme = [format!("solver.integrator={integrator}"), format!("solver.step_s={step_s}")];
            let mut run = simulation(text, &[model, &scheme[0], &scheme[1], "solver.tolerance=1e-12"]);
            run_to(&mut run, 1.0);
            let (inertia, damper, torque) = (0.2_f64, 0.3_f64, 2.0_f64);
            let left = (-damper / inertia).exp();
            let rate = torque / damper * (1.0 - left);
            let put_in = torque * torque / damper * (1.0 - inertia / damper * (1.0 - left));
            let dissipated = put_in - 0.5 * inertia * rate * rate;
            let ledger = run.ledger();
            let errors = [ledger.work_in_j / put_in - 1.0, ledger.dissipated_j / dissipated - 1.0];
            println!("{integrator} {model}: {errors:?}");
            assert!(errors.iter().all(|error| error.abs() < bound), "{integrator}, {model}: {errors:?}");
        }
    }
}

/// A fine run of the default scene's pulse by a scheme of second order. The test itself integrates the torque over the angle of
/// the crank's tangent, and the powers of damper and friction.
struct Fine {
    put_in_j: f64,
    energy_j: f64,
    /// Dissipated by the damper at the base and the slider's friction.
    dissipated_j: f64,
}

const DAMPER_NM_S: f64 = 0.05;
const FRICTION_N_S_PER_M: f64 = 0.4;

fn torque_nm(time_s: f64) -> f64 {
    if time_s < 0.1 { 20.0 * (1.0 - (TAU * time_s / 0.1).cos()) } else { 0.0 }
}

fn tangent(seen: &Observation) -> f64 {
    seen.links[0].nodes[0].rotation_rad.unwrap()
}

fn slide(seen: &Observation) -> f64 {
    seen.links[1].nodes.last().unwrap().position_m[0]
}

fn fine(run: &mut Simulation, until_s: f64) -> Fine {
    let h = run.step_s();
    let (mut put_in_j, mut dissipated_j) = (0.0, 0.0);
    let seen = look(run);
    let (mut angle, mut place) = (tangent(seen), slide(seen));
    while run.time_s() < until_s - 0.5 * h {
        let middle_s = run.time_s() + 0.5 * h;
        run.step().unwrap();
        let seen = look(run);
        let (turned, moved) = (tangent(seen) - angle, slide(seen) - place);
        put_in_j += torque_nm(middle_s) * turned;
        dissipated_j += (DAMPER_NM_S * turned * turned + FRICTION_N_S_PER_M * moved * moved) / h;
        (angle, place) = (angle + turned, place + moved);
    }
    Fine { put_in_j, energy_j: energy_j(run.observation()), dissipated_j }
}

/// The default scene as it stands, and with damper and friction on rigid and on flexible links: the energy account of ESDIRK at
/// the scene's own step and at 1 ms.
#[test]
fn val_works_of_the_default_scene_are_those_of_a_fine_run() {
    let lossy = [
        format!("base.damper_nm_s_per_rad={DAMPER_NM_S}"),
        format!("slider.friction_n_s_per_m={FRICTION_N_S_PER_M}"),
        "crank.rigid=true".to_owned(),
        "rod.damping_s=0".to_owned(),
    ];
    let lossy = lossy.each_ref().map(String::as_str);
    for (name, model, keys, other, bound) in [
        ("as it stands", MODAL, &[][..], "generalized-alpha", 3e-5),
        ("as it stands", FINITE, &[][..], "two-point", 3e-5),
        ("damper and friction", RIGID, &lossy[..], "runge-kutta", 3e-6),
        ("damper and friction", MODAL, &lossy[..], "generalized-alpha", 3e-6),
        ("damper and friction", FINITE, &lossy[..], "two-point", 1e-5),
    ] {
        let other = format!("solver.integrator={other}");
        let mut reference =
            simulation("crank-slider", &[keys, &[model, &other, "solver.weight=0.5", "solver.step_s=2e-5"]].concat());
        let Fine { put_in_j, energy_j, dissipated_j } = fine(&mut reference, 0.3);
        // Energy that no damper and no friction dissipated was dissipated by the links.
        let dissipated_j = if keys.is_empty() { put_in_j - energy_j } else { dissipated_j };
        for step_s in ["solver.step_s=1e-3", "solver.step_s=2e-3"] {
            let mut run = simulation("crank-slider", &[keys, &[model, "solver.integrator=esdirk", step_s]].concat());
            run_to(&mut run, 0.3);
            let ledger = run.ledger();
            let errors = [ledger.work_in_j / put_in_j - 1.0, ledger.dissipated_j / dissipated_j - 1.0];
            println!("{name} {model} {step_s}: {errors:?} of {put_in_j} J, {dissipated_j} J");
            let bound = if step_s.ends_with("2e-3") { 16.0 * bound } else { bound };
            assert!(errors.iter().all(|error| error.abs() < bound), "{name}, {model}, {step_s}: {errors:?}");
        }
    }
}

/// Balance of a damped scene at its end, for steps halved from step to step.
fn balances(model: &str, integrator: &str, steps_s: [f64; 3]) -> [f64; 3] {
    steps_s.map(|step_s| {
        let scheme = [format!("solver.integrator={integrator}"), format!("solver.step_s={step_s}")];
        let keys = [
            model,
            &scheme[0],
            &scheme[1],
            "solver.weight=0.5",
            "solver.tolerance=1e-12",
            "crank.axial=false",
            "rod.axial=false",
            "rod.modes=2",
            "crank.elements=2",
            "rod.elements=2",
            "base.damper_nm_s_per_rad=0.05",
            "slider.friction_n_s_per_m=0.4",
        ];
        let mut run = simulation("crank-slider", &keys);
        run_to(&mut run, 0.4);
        run.ledger().worst_balance_j
    })
}

/// The works are integrated to the order of the motion, so that what the scheme alone gains or loses shows in the balance, with the
/// scheme's own order.
#[test]
fn order_of_the_energy_balance_is_that_of_the_scheme() {
    for (model, integrator, coarsest_s, expected, within) in [
        (RIGID, "esdirk", 1e-3, 4.0, 0.3),
        (MODAL, "esdirk", 1e-3, 4.0, 0.3),
        (RIGID, "two-point", 4e-4, 2.0, 0.1),
        (MODAL, "two-point", 2e-4, 2.0, 0.1),
        (FINITE, "two-point", 2e-4, 2.0, 0.2),
        (RIGID, "generalized-alpha", 4e-4, 2.0, 0.1),
        (MODAL, "generalized-alpha", 2e-4, 2.0, 0.1),
        (FINITE, "generalized-alpha", 2e-4, 2.0, 0.2),
    ] {
        let steps_s = [coarsest_s, 0.5 * coarsest_s, 0.25 * coarsest_s];
        let [_, coarse, fine] = balances(model, integrator, steps_s);
        let order = (coarse / fine).log2();
        println!("{integrator} {model}: {coarse:.1e} {fine:.1e} J, order {order:.2}");
        assert!((order - expected).abs() < within, "{integrator}, {model}: order {order:.2} of {coarse:e} and {fine:e} J");
    }
}

/// An oscillator of frequency 1 without damping or load: its scheme loses `½ (|R(ih)|²ⁿ − 1)`, which the balance must show.
#[test]
fn val_the_balance_error_is_the_scheme_s_loss() {
    let text = "[oscillator]\nmasses_kg = [1.0]\nsprings = [[1, 0, 1.0]]\nstart_m = [1.0]\n";
    let steps = 100;
    for (keys, h) in [
        (&["solver.integrator=two-point", "solver.weight=1.0"][..], 0.01_f64),
        (&["solver.integrator=two-point", "solver.weight=0.6"], 0.05),
        (&["solver.integrator=esdirk"], 1.0),
        (&["solver.integrator=runge-kutta"], 0.5),
    ] {
        let step = format!("solver.step_s={h}");
        let mut run = simulation(text, &[keys, &[&step]].concat());
        (0..steps).for_each(|_| run.step().unwrap());
        let expected = 0.5 * (squared_amplification(keys, h).powi(steps) - 1.0);
        let found = run.ledger().balance_error_j;
        assert!(expected < -1e-3 && (found / expected - 1.0).abs() < 1e-9, "{keys:?}: {found} J for {expected} J");
    }
}

/// `|R(ih)|²` of the schemes above.
fn squared_amplification(keys: &[&str], h: f64) -> f64 {
    let squared = |re: f64, im: f64| re * re + im * im;
    match keys {
        ["solver.integrator=esdirk"] => {
            // (1 − z/4 − z²/8 + z³/96 + 7z⁴/768)/(1 − z/4)⁵
            squared(1.0 + h * h / 8.0 + 7.0 * h.powi(4) / 768.0, -h / 4.0 - h.powi(3) / 96.0) / squared(1.0, h / 4.0).powi(5)
        }
        ["solver.integrator=runge-kutta"] => squared(1.0 - h * h / 2.0 + h.powi(4) / 24.0, h - h.powi(3) / 6.0),
        [_, weight] => {
            let weight: f64 = weight.trim_start_matches("solver.weight=").parse().unwrap();
            squared(1.0, (1.0 - weight) * h) / squared(1.0, weight * h)
        }
        other => panic!("{other:?}"),
    }
}
