//! Forces on a free end beside closed forms, and reciprocity.

use std::error::Error;
use std::f64::consts::{FRAC_PI_6, TAU};

use super::scheme::Scheme;
use super::{Crank, StateSpace, Subject};
use crate::scene::SceneSource;

type Outcome = Result<(), Box<dyn Error>>;

/// A steel ruler, clamped.
const RULER: &str = "[beam]\nlength_m = 0.6\nsection = { shape = \"rectangle\", width_m = 0.03, height_m = 0.003 }\n\
                     density_kg_per_m3 = 7850\nyoungs_modulus_pa = 2.06e11\nelements = 16\naxial = true\n\
                     [drive]\nspeed_rad_per_s = 0.0\n\
                     [solver]\nmodel = \"finite-element\"\nintegrator = \"esdirk\"\nstep_s = 1e-3\n";
const LENGTH_M: f64 = 0.6;
const AREA_M2: f64 = 0.03 * 0.003;
const MODULUS_PA: f64 = 2.06e11;
const BENDING_N_M2: f64 = MODULUS_PA * AREA_M2 * 0.003 * 0.003 / 12.0;

/// An arm of two links on a spring, with a load at its tip.
const ARM: &str = "[crank]\nlength_m = 0.4\nsection = { shape = \"rectangle\", width_m = 0.03, height_m = 0.006 }\n\
                   density_kg_per_m3 = 2700\nyoungs_modulus_pa = 7e10\ndamping_s = 2e-4\n\
                   [rod]\nlength_m = 0.3\nsection = { shape = \"tube\", outer_m = 0.012, inner_m = 0.01 }\n\
                   density_kg_per_m3 = 1600\nyoungs_modulus_pa = 1.2e11\ndamping_s = 1e-4\n\
                   [tip]\nmass_kg = 0.03\n[base]\ntorsion_spring_nm_per_rad = 50\ndamper_nm_s_per_rad = 0.02\n\
                   [gravity]\nx_m_per_s2 = 7\ny_m_per_s2 = -7\n";

/// A scene's state space at rest at an angle.
fn at_rest(text: &str, overrides: &[String], angle_rad: f64) -> Result<StateSpace, Box<dyn Error>> {
    let subject = Subject::new(&SceneSource::parse("scene.toml", text, overrides)?.scene, None)?;
    Ok(StateSpace::new(&subject, &subject.at_rest(angle_rad)?)?)
}

fn place(names: &[String], name: &str) -> Result<usize, String> {
    names.iter().position(|other| other == name).ok_or_else(|| format!("no {name} among {names:?}"))
}

/// Size of an output under an input at a frequency, with its sign if both are in phase.
fn response(space: &StateSpace, [output, input]: [&str; 2], frequency_hz: f64) -> Result<[f64; 2], Box<dyn Error>> {
    let found = space.frequency_response(place(&space.inputs, input)?, frequency_hz)?[place(&space.outputs, output)?];
    Ok([found.re, found.im])
}

/// A cantilever under a force at its end: `w = F L³ / 3 E J`, `u = F L / E A`; the clamp carries force and moment.
#[test]
fn val_a_cantilever_yields_to_a_force_at_its_tip() -> Outcome {
    let space = at_rest(RULER, &[], 0.0)?;
    for (output, input, exact) in [
        ("tip_y_m", "tip_force_y_n", LENGTH_M.powi(3) / (3.0 * BENDING_N_M2)),
        ("tip_x_m", "tip_force_x_n", LENGTH_M / (MODULUS_PA * AREA_M2)),
        // From the chord, `F L³ (5/48 − 1/6) / E J`.
        ("beam_deflection_m", "tip_force_y_n", -LENGTH_M.powi(3) / (16.0 * BENDING_N_M2)),
        ("motion_torque_nm", "tip_force_y_n", -LENGTH_M),
        ("pivot_y_n", "tip_force_y_n", -1.0),
        ("pivot_x_n", "tip_force_x_n", -1.0),
        ("pivot_x_n", "tip_force_y_n", 0.0),
    ] {
        let [found, _] = response(&space, [output, input], 0.0)?;
        assert!((found - exact).abs() < 1e-8 * exact.abs().max(1e-3), "{output} by {input}: {found:e} for {exact:e}");
    }
    Ok(())
}

/// The clamp carries the whole force, and its moment, whatever the model reads its forces from.
#[test]
fn val_the_clamp_carries_the_force_in_every_model() -> Outcome {
    for model in ["modal", "finite-element"] {
        let space = at_rest(RULER, &[format!("solver.model={model}")], 0.0)?;
        for (output, input, exact) in [
            ("pivot_x_n", "tip_force_x_n", -1.0),
            ("pivot_y_n", "tip_force_y_n", -1.0),
            ("motion_torque_nm", "tip_force_y_n", -LENGTH_M),
        ] {
            let [found, _] = response(&space, [output, input], 0.0)?;
            assert!((found - exact).abs() < 1e-8, "{model}, {output} by {input}: {found:e} for {exact:e}");
        }
    }
    Ok(())
}

/// The exact beam: `w / F = (cosh b sin b − sinh b cos b) / (E J β³ (1 + cos b cosh b))`, `b = β L`, `β⁴ = ρ A ω² / E J`
/// (Meirovitch, Fundamentals of Vibrations, section 8.4). The clamped end is turned by 30°.
#[test]
fn val_a_cantilever_vibrates_as_the_exact_beam() -> Outcome {
    let space = at_rest(RULER, &["beam.elements=32".to_owned()], FRAC_PI_6)?;
    for frequency_hz in [1.0, 10.0, 30.0, 60.0, 120.0] {
        let beta = (7850.0 * AREA_M2 * (TAU * frequency_hz).powi(2) / BENDING_N_M2).powf(0.25);
        let b = beta * LENGTH_M;
        let across = (b.cosh() * b.sin() - b.sinh() * b.cos()) / (BENDING_N_M2 * beta.powi(3) * (1.0 + b.cos() * b.cosh()));
        // Stretching is quasi-static: its lowest frequency is 2135 Hz.
        let k = TAU * frequency_hz * (7850.0 / MODULUS_PA).sqrt();
        let along = (k * LENGTH_M).tan() / (MODULUS_PA * AREA_M2 * k);
        let (sin, cos) = FRAC_PI_6.sin_cos();
        for (pair, exact) in [
            (["tip_y_m", "tip_force_y_n"], across * cos * cos + along * sin * sin),
            (["tip_x_m", "tip_force_x_n"], across * sin * sin + along * cos * cos),
            (["tip_x_m", "tip_force_y_n"], (along - across) * sin * cos),
        ] {
            let [found, quadrature] = response(&space, pair, frequency_hz)?;
            let error = (found - exact).hypot(quadrature) / exact.abs();
            assert!(error < 1e-5, "{pair:?} at {frequency_hz} Hz: {found:e} for {exact:e}, {error:e}");
        }
    }
    Ok(())
}

/// Maxwell and Betti: what one input does at the place of another, that does at the place of the one. The stiffness of weight is symmetric, too.
#[test]
fn prop_inputs_and_their_places_are_reciprocal() -> Outcome {
    for model in ["modal", "finite-element", "rigid"] {
        let space = at_rest(ARM, &[format!("solver.model={model}")], -FRAC_PI_6)?;
        for frequency_hz in [0.3, 2.0, 15.0] {
            for [one, other] in [
                [["tip_x_m", "tip_force_y_n"], ["tip_y_m", "tip_force_x_n"]],
                [["tip_x_m", "torque_nm"], ["crank_angle_rad", "tip_force_x_n"]],
                [["tip_y_m", "torque_nm"], ["crank_angle_rad", "tip_force_y_n"]],
            ] {
                let [there, back] = [response(&space, one, frequency_hz)?, response(&space, other, frequency_hz)?];
                let off = (there[0] - back[0]).hypot(there[1] - back[1]) / there[0].hypot(there[1]);
                assert!(off < 1e-8, "{model}, {one:?} at {frequency_hz} Hz: {there:?} and {back:?}, {off:e}");
            }
        }
    }
    Ok(())
}

/// A rigid arm turns as `J φ̈ = τ + L F`, whatever its load; while it turns steadily, along axes that turn along.
#[test]
fn val_a_force_at_the_tip_of_a_rigid_arm_has_its_length_for_a_lever() -> Outcome {
    for (tip_kg, speed_rad_per_s) in [("0", 0.0), ("1000", 0.0), ("1e6", 0.0), ("0.05", 20.0)] {
        let overrides = [format!("tip.mass_kg={tip_kg}"), "solver.model=rigid".to_owned(), "solver.integrator=esdirk".to_owned()];
        let subject = Subject::new(&SceneSource::parse("scene.toml", RULER, &overrides)?.scene, Some(Crank::Free))?;
        let point = match speed_rad_per_s {
            0.0 => subject.at_rest(0.3)?,
            speed => subject.turning(0.3, speed)?,
        };
        let space = StateSpace::new(&subject, &point)?;
        let of = |name: &str| Ok::<f64, String>(space.b[(1, place(&space.inputs, name)?)]);
        let (torque, [x, y]) = (of("torque_nm")?, [of("tip_force_x_n")?, of("tip_force_y_n")?]);
        for (found, lever_m) in [(x, -LENGTH_M * 0.3_f64.sin()), (y, LENGTH_M * 0.3_f64.cos())] {
            let error = (found / torque - lever_m).abs() / LENGTH_M;
            assert!(error < 1e-12, "{tip_kg} kg at {speed_rad_per_s} rad/s: {found:e} of {torque:e}, {error:e}");
        }
    }
    Ok(())
}

/// The map of the scene's steps has the same forces: slow ones bend the beam alike, but for the time in which a step holds its input.
#[test]
fn val_steps_of_the_scheme_answer_a_force_at_the_tip() -> Outcome {
    let scene = SceneSource::parse("scene.toml", RULER, &[])?.scene;
    let subject = Subject::new(&scene, None)?;
    let point = subject.at_rest(0.0)?;
    let space = StateSpace::new(&subject, &point)?;
    let pair = ["tip_y_m", "tip_force_y_n"];
    let [exact, _] = response(&space, pair, 0.5)?;
    for integrator in ["esdirk", "generalized-alpha"] {
        let solver = SceneSource::parse("scene.toml", RULER, &[format!("solver.integrator={integrator}")])?.scene.solver;
        let map = space.stepped_by(Scheme::of(&solver), 1e-3)?;
        let [found, quadrature] = response(&map, pair, 0.5)?;
        let error = found.hypot(quadrature) / exact - 1.0;
        assert!(error.abs() < 1e-4, "{integrator}: {error:e}");
    }
    Ok(())
}
