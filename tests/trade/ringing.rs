//! A link that rings faster than the usual steps of a reference resolve: the uncertainty of the reference counts that.

use flexcrank::study::trade::{Grid, Ringing};

use super::*;

/// A balance arm of a watch. Its short rectangular pulse leaves a ringing at 2.5 kHz, which two refinements of the reference by 0.2 ms
/// and 0.05 ms left out alike: 0.30 stated, 1.76 true.
const BALANCE: &str = r#"
[beam]
length_m = 0.012
section = { shape = "rectangle", width_m = 1.2e-3, height_m = 1.5e-4 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.1e11
damping_s = 2e-6
[tip]
mass_kg = 5e-5
[base]
torsion_spring_nm_per_rad = 2.84e-6
damper_nm_s_per_rad = 1.5e-9
[[pulse]]
start_s = 1.05
torque_nm = -1e-5
duration_s = 0.005
"#;

/// Steps of the truth, 40 in a period of the ringing, by an integrator of fourth order.
const TRUE_STEP_S: f64 = 1e-5;
/// Steps of the row whose error is stated.
const STEP_S: f64 = 4e-4;

/// Deflections of the middle at the study's instants, by a loop of its own.
fn deflections_m(source: &SceneSource, step_s: f64, grid: &Grid) -> Vec<f64> {
    let keys = ["model=modal".to_owned(), "integrator=esdirk".to_owned(), format!("step_s={step_s}")];
    let keys = keys.map(|key| format!("solver.{key}")).into_iter().chain(["beam.modes=3", "beam.elements=2"].map(str::to_owned));
    let source = SceneSource::parse("balance.toml", &source.text, &keys.collect::<Vec<_>>()).unwrap();
    let mut simulation = Simulation::new(&source.scene).unwrap();
    let mut deflections_m = Vec::new();
    for _ in 0..grid.count {
        (0..grid.steps(step_s)).for_each(|_| simulation.step().unwrap());
        deflections_m.push(simulation.observe().unwrap().links[0].nodes[1].deflection_m.unwrap());
    }
    deflections_m
}

fn most(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}

/// The largest error of the first link's angle at the study's instants, by a loop of its own, rad.
fn angle_error_rad(source: &SceneSource, grid: &Grid, configuration: &Configuration, truth_rad: &dyn Fn(f64) -> f64) -> f64 {
    let mut simulation = Simulation::new(&configuration.scene(&source.scene)).unwrap();
    most((1..=grid.count).map(|instant| {
        (0..grid.steps(configuration.step_s)).for_each(|_| simulation.step().unwrap());
        simulation.observe().unwrap().links[0].chord_rad - truth_rad(instant as f64 * grid.interval_s)
    }))
}

#[test]
fn val_the_uncertainty_of_the_reference_counts_a_ringing() {
    let source = SceneSource::parse("balance.toml", BALANCE, &[]).unwrap();
    let selection = Selection {
        models: vec![ModelKind::Modal],
        integrators: vec![IntegratorKind::Esdirk],
        modes: vec![3],
        steps_s: vec![STEP_S],
        ..Selection::default()
    };
    // By the time that there is, the ringing is unknown, counted as uncertain, or resolved.
    for (budget_s, is_known, is_resolved) in [(3.0, false, false), (15.0, true, false), (40.0, true, true)] {
        let question = Question { until_s: Some(2.06), ..ask(selection.clone(), &[OutputGroup::Deflection], budget_s) };
        let study = answer(&source, &Question { enough: Some(1e-2), ..question });
        let [of_row, truth] = [STEP_S, TRUE_STEP_S].map(|step_s| deflections_m(&source, step_s, &study.grid));
        let error = most(of_row.iter().zip(&truth).map(|(row, truth)| row - truth)) / most(truth.iter().copied());
        let reference = &study.reference;
        let (_, row) = study.measured().next().unwrap();
        let [stated, uncertainty] = [&row.errors, &reference.estimate].map(|errors| errors.of(OutputGroup::Deflection));
        let seen = format!("{budget_s} s: {stated} ± {uncertainty} for {error}, {:?}", reference.left_out);
        assert_eq!(reference.left_out.is_none_or(|left_out| left_out.errors.is_some()), is_known, "{seen}");
        assert_eq!(reference.left_out.is_none(), is_resolved, "{seen}");
        let off = (stated - error).abs();
        assert!(off < 1.1 * uncertainty + 2e-3 || !is_known && uncertainty == 1.0, "{seen}");
        assert!(!is_resolved || uncertainty < 0.02, "{seen}");
        let left_out = reference.left_out.and_then(|left_out| left_out.errors);
        assert!(left_out.is_none_or(|errors| uncertainty >= errors.of(OutputGroup::Deflection)), "{seen}");
    }
}

/// Links that the usual steps resolve cost no run that looks for ringing.
#[test]
fn prop_links_that_bend_slowly_are_not_looked_at_for_ringing() {
    let source = open("crank-slider", &[]);
    let mut runs = Vec::new();
    let question = Question { until_s: Some(0.2), enough: Some(0.1), ..ask(Selection::default(), &[OutputGroup::Angle], 1.0) };
    let _ = study(&source.scene, &question, &mut |progress| {
        runs.extend(progress.reference.then_some(progress.running.family.resolution));
        if progress.reference { std::ops::ControlFlow::Continue(()) } else { std::ops::ControlFlow::Break(()) }
    });
    assert_eq!(runs[..2], [8, 16], "{runs:?}");
}

/// A smooth pulse leaves no ringing, so that the mesh is refined instead.
#[test]
fn prop_a_ringing_that_does_not_count_leaves_the_steps_as_they_are() {
    let smooth =
        BALANCE.replace("torque_nm = -1e-5\nduration_s = 0.005", "torque_nm = 1e-7\nduration_s = 0.5\nshape = \"raised-cosine\"");
    let source = SceneSource::parse("balance.toml", &smooth, &[]).unwrap();
    let selection =
        Selection { models: vec![ModelKind::Rigid], integrators: vec![IntegratorKind::TwoPoint], ..Selection::default() };
    let question = Question { until_s: Some(2.06), ..ask(selection, &[OutputGroup::Angle], 40.0) };
    let study = answer(&source, &Question { enough: Some(1e-2), ..question });
    let (reference, interval_s) = (&study.reference, study.grid.interval_s);
    let steps = interval_s / reference.configuration.step_s;
    let left_out = reference.left_out.unwrap_or_else(|| panic!("{steps} steps"));
    assert!(!left_out.counts && left_out.errors.is_some() && steps < 201.0, "{left_out:?}, {steps}");
}

/// A rigid beam on a spring rings at 2.25 kHz after a rectangular pulse, which two refinements of the reference left out alike. The truth
/// is the closed form: steps `θ = τ/k (1 − e^{−δt} (cos νt + δ/ν sin νt))` at both edges.
#[test]
fn val_the_uncertainty_of_the_reference_counts_a_ringing_of_the_base() {
    let (spring, damper, torque_nm, [from_s, to_s]) = (200.0_f64, 5e-4, 5.0, [0.0501, 0.0521]);
    let text = format!(
        "[beam]\nlength_m = 0.1\nrigid = true\nmass_kg = 3e-4\n[base]\ntorsion_spring_nm_per_rad = {spring:?}\n\
         damper_nm_s_per_rad = {damper:?}\n[[pulse]]\nstart_s = {from_s:?}\ntorque_nm = {torque_nm:?}\nduration_s = 0.002\n"
    );
    let inertia_kg_m2 = 3e-4 * 0.1_f64.powi(2) / 3.0;
    let decay = 0.5 * damper / inertia_kg_m2;
    let nu = (spring / inertia_kg_m2 - decay * decay).sqrt();
    let after = |t: f64| 1.0 - (-decay * t).exp() * ((nu * t).cos() + decay / nu * (nu * t).sin());
    let truth_rad = |t: f64| torque_nm / spring * (after((t - from_s).max(0.0)) - after((t - to_s).max(0.0)));
    let source = SceneSource::parse("spring.toml", &text, &[]).unwrap();
    let selection = Selection {
        models: vec![ModelKind::Rigid],
        integrators: vec![IntegratorKind::Esdirk],
        steps_s: vec![4e-4],
        ..Selection::default()
    };
    for (budget_s, is_resolved) in [(0.3, false), (20.0, true)] {
        let question = Question { until_s: Some(1.0), ..ask(selection.clone(), &[OutputGroup::Angle], budget_s) };
        let study = answer(&source, &Question { enough: Some(1e-2), ..question });
        let (row, measured) = study.measured().next().unwrap();
        let error = angle_error_rad(&source, &study.grid, &row.configuration, &truth_rad);
        let reference = &study.reference;
        let [stated, uncertainty] = [&measured.errors, &reference.estimate].map(|errors| errors.of(OutputGroup::Angle));
        let seen =
            format!("{budget_s} s: {stated} ± {uncertainty} for {error}, {}, {:?}", reference.configuration, reference.left_out);
        assert_eq!(reference.left_out.is_none(), is_resolved, "{seen}");
        assert!((stated - error).abs() < 1.1 * uncertainty + 1e-4 && error > 1e-3, "{seen}");
        assert!(is_resolved == (uncertainty < 1e-3), "{seen}");
    }
}

/// Where a link and the base ring, and there is no time to find out how much, the angle is unknown, too: it was stated as known to 9e-3,
/// and was off by 1.7e-2.
#[test]
fn regress_an_unknown_ringing_of_link_and_base_leaves_no_output_known() {
    let text = r#"
[crank]
length_m = 0.1
rigid = true
mass_kg = 3e-4
[rod]
length_m = 0.12
section = { shape = "rectangle", width_m = 0.002, height_m = 0.02 }
density_kg_per_m3 = 1600.0
youngs_modulus_pa = 1.25e11
[slider]
mass_kg = 1e-4
[base]
torsion_spring_nm_per_rad = 25000.0
damper_nm_s_per_rad = 0.001
[[pulse]]
start_s = 0.0501
torque_nm = 500.0
duration_s = 0.0021
"#;
    let selection = Selection {
        models: vec![ModelKind::Modal],
        integrators: vec![IntegratorKind::Esdirk],
        steps_s: vec![4e-4],
        ..Selection::default()
    };
    // The base vibrates at 3.9 kHz, the rod between its pins at 5.6 kHz; a crank without mass changes little.
    for mass in ["3e-4", "0"] {
        let source = SceneSource::parse("both.toml", text, &[format!("crank.mass_kg={mass}")]).unwrap();
        let study = answer(&source, &Question { until_s: Some(1.0), ..ask(selection.clone(), &[OutputGroup::Angle], 1.0) });
        let reference = &study.reference;
        let left_out = reference.left_out.unwrap();
        assert!(left_out.part == Ringing::Base && left_out.errors.is_none(), "{mass} kg: {left_out:?}");
        assert!((3900.0..12e3).contains(&left_out.hz), "{mass} kg: {left_out:?}");
        let is_unknown = |output: &OutputGroup| reference.estimate.of(*output) >= 1.0;
        assert!(OutputGroup::COMPARED.iter().all(is_unknown), "{mass} kg: {:?}", reference.estimate);
    }
}

/// A link whose bending is damped beyond critical does not ring, however fast it is: its deflection was said to be unknown.
#[test]
fn regress_bending_beyond_critical_damping_is_not_looked_at_for_ringing() {
    let text = r#"
[crank]
length_m = 0.015
section = { shape = "round", diameter_m = 0.012 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.1e11
damping_s = 1e-5
[rod]
length_m = 0.2
section = { shape = "round", diameter_m = 0.006 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7e10
damping_s = 1e-5
[slider]
mass_kg = 0.8
friction_n_s_per_m = 12.0
[drive]
speed_rad_per_s = 40.0
"#;
    let selection = Selection {
        models: vec![ModelKind::Rigid],
        integrators: vec![IntegratorKind::TwoPoint],
        steps_s: vec![2e-3],
        ..Selection::default()
    };
    for (damping_s, hz) in [("1e-5", 0.0), ("1e-7", 108e3)] {
        let source = SceneSource::parse("saw.toml", text, &[format!("crank.damping_s={damping_s}")]).unwrap();
        let study = answer(&source, &ask(selection.clone(), &[OutputGroup::Deflection], 5.0));
        let found_hz = study.reference.left_out.map_or(0.0, |left_out| left_out.hz);
        assert!((found_hz - hz).abs() < 1e3, "{damping_s} s: {:?}", study.reference.left_out);
    }
}

/// A rigid beam on a stiff spring. The ringing that the first steps leave out is too small to count, and the last refinements resolve it:
/// it was stated as uncertain by 5.4e-6 with any budget, and the tolerance refused. The truth is the closed form, as above.
#[test]
fn val_a_small_ringing_that_a_refinement_resolves_is_no_longer_uncertain() {
    let text = "[beam]\nlength_m = 0.5\nmass_kg = 1.0\nrigid = true\n[tip]\nmass_kg = 0.5\n[base]\ntorsion_spring_nm_per_rad = 5e5\n\
                damper_nm_s_per_rad = 1.0\n[[pulse]]\nstart_s = 0.0\ntorque_nm = 50.0\nduration_s = 0.01\n";
    let inertia_kg_m2 = 0.5_f64.powi(2) * (1.0 / 3.0 + 0.5);
    let decay = 0.5 / inertia_kg_m2;
    let nu = (5e5 / inertia_kg_m2 - decay * decay).sqrt();
    let after = |t: f64| 1.0 - (-decay * t).exp() * ((nu * t).cos() + decay / nu * (nu * t).sin());
    let truth_rad = |t: f64| 50.0 / 5e5 * (after(t) - after((t - 0.01).max(0.0)));
    let source = SceneSource::parse("stiff.toml", text, &[]).unwrap();
    let (models, integrators) = (vec![ModelKind::Rigid], vec![IntegratorKind::Esdirk]);
    let selection = Selection { models, integrators, steps_s: vec![4e-4], ..Selection::default() };
    let study = answer(&source, &Question { enough: Some(3e-6), ..ask(selection, &[OutputGroup::Angle], 10.0) });
    let (row, measured) = study.measured().next().unwrap();
    let error = angle_error_rad(&source, &study.grid, &row.configuration, &truth_rad);
    let reference = &study.reference;
    let [stated, uncertainty] = [&measured.errors, &reference.estimate].map(|errors| errors.of(OutputGroup::Angle));
    let seen = format!("{stated} ± {uncertainty} for {error}, {}, {:?}", reference.configuration, reference.left_out);
    assert!(reference.left_out.is_none() && uncertainty < 3e-7, "{seen}");
    assert!((stated - error).abs() < 1.1 * uncertainty && error > 1e-6, "{seen}");
}

/// An air pump. Its crank rings at 55 kHz, which the reference does not resolve, and its rod at 1 kHz, which the first steps do not
/// resolve, either, but the last do. What the first left out was charged to the last: a part of 0.019 of the deflection, for 3e-5, and no
/// setting was known to hold a tolerance.
#[test]
fn val_a_ringing_is_judged_by_the_steps_of_the_finest_run() {
    const PUMP: &str = "[crank]\nlength_m = 0.025\nsection = { shape = \"rectangle\", width_m = 0.008, height_m = 0.015 }\n\
                        density_kg_per_m3 = 2700\nyoungs_modulus_pa = 7e10\ndamping_s = 1.7e-6\naxial = true\n\
                        [rod]\nlength_m = 0.11\nsection = { shape = \"rectangle\", width_m = 0.01, height_m = 0.005 }\n\
                        density_kg_per_m3 = 2700\nyoungs_modulus_pa = 7e10\ndamping_s = 1.7e-6\naxial = true\n\
                        [slider]\nmass_kg = 0.15\nfriction_n_s_per_m = 4\n[base]\ndamper_nm_s_per_rad = 0.02\n\
                        [torque]\nconstant_nm = 1\n[start]\nangle_rad = 0.3\n";
    let source = SceneSource::parse("pump.toml", PUMP, &[]).unwrap();
    let (models, integrators) = (vec![ModelKind::Rigid], vec![IntegratorKind::TwoPoint]);
    let selection = Selection { models, integrators, steps_s: vec![1e-3], ..Selection::default() };
    let asked = ask(selection, &[OutputGroup::Deflection], 180.0);
    let study = answer(&source, &Question { until_s: Some(0.5), enough: Some(1e-2), ..asked });
    let (reference, grid) = (&study.reference, &study.grid);
    let rod_m = |step_s: f64| -> Vec<f64> {
        let keys = ["model=finite-element", "integrator=esdirk"].map(|key| format!("solver.{key}"));
        let keys =
            keys.into_iter().chain([format!("solver.step_s={step_s}"), "rod.elements=4".into(), "crank.elements=4".into()]);
        let source = SceneSource::parse("pump.toml", PUMP, &keys.collect::<Vec<_>>()).unwrap();
        let mut simulation = Simulation::new(&source.scene).unwrap();
        let deflection_m = |_| {
            (0..grid.steps(step_s)).for_each(|_| simulation.step().unwrap());
            simulation.observe().unwrap().links[1].nodes[2].deflection_m.unwrap()
        };
        (0..grid.count).map(deflection_m).collect()
    };
    let (found, truth) = (rod_m(reference.configuration.step_s), rod_m(2.5e-6));
    let error = most(found.iter().zip(&truth).map(|(found, truth)| found - truth)) / most(truth.iter().copied());
    let stated = reference.estimate.of(OutputGroup::Deflection);
    let seen = format!("{stated} for {error}, {}, {:?}", reference.configuration, reference.left_out);
    println!("{seen}");
    assert!(reference.left_out.is_some_and(|left_out| left_out.errors.is_some()), "{seen}");
    assert!(error <= stated && stated < 1e-2, "{seen}");
}
