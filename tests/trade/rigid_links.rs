//! Links that are rigid, by the scene or by the choice.

use flexcrank::study::trade::NoExcitation;

use super::*;

/// A finer model that gains nothing is a reason to stop trying links as rigid, not to leave out what was asked for.
#[test]
fn regress_links_that_the_scene_makes_rigid_end_no_search() {
    let overrides = ["crank.rigid=true", "rod.section.height_m=0.03", "rod.axial=false", "pulse.0.duration_s=0.5"];
    let source = open("crank-slider", &overrides);
    let asked = [IntegratorKind::GeneralizedAlpha, IntegratorKind::Esdirk];
    let modal =
        Selection { models: vec![ModelKind::Modal], integrators: asked.to_vec(), modes: vec![2, 3, 4], ..Selection::default() };
    let study = answer(&source, &Question { until_s: Some(1.0), ..ask(modal, &OutputGroup::DEFAULT, 20.0) });
    for integrator in asked {
        for modes in [2, 3, 4] {
            let of = |family: &Family| family.integrator == integrator && family.resolution == modes;
            assert!(study.rows.iter().any(|row| of(&row.configuration.family)), "{integrator:?} {modes}");
        }
    }
}

#[test]
fn val_links_that_may_be_rigid_are() {
    let source = open("thesis-crank-slider", &[]);
    let selection = Selection { models: vec![ModelKind::Rigid, ModelKind::Modal], modes: vec![1], ..Selection::default() };
    let question = Question { enough: Some(2.5e-4), ..ask(selection, &[OutputGroup::Angle, OutputGroup::Slider], 10.0) };
    let told = answer(&source, &question);
    let demands = Demands { tolerance: 1e-3, real_time_factor: 0.1 };
    let chosen = choose(&source.scene, &told, &demands, 10.0, &mut |_| {}).unwrap();
    assert_eq!(chosen.row.configuration.family.model, ModelKind::Rigid);
}

/// Fourteen rigid settings that seem to hold fail where they are verified; the dearest setting holds.
#[test]
fn regress_no_number_of_settings_that_fail_their_verification_hides_one_that_holds() {
    let source = open("ref-r2s", &[]);
    let selection = Selection {
        models: vec![ModelKind::Rigid, ModelKind::Modal],
        integrators: vec![IntegratorKind::RungeKutta, IntegratorKind::Esdirk],
        modes: vec![3],
        steps_s: vec![1e-3, 5e-4, 2.5e-4, 2e-4, 1.25e-4, 1e-4, 5e-5],
        ..Selection::default()
    };
    let asked = ask(selection, &[OutputGroup::Angle], 20.0);
    let mut study = answer(&source, &Question { until_s: Some(0.5), ..asked });
    let is_rigid = |configuration: &Configuration| configuration.family.model == ModelKind::Rigid;
    let [mut rigid, mut finest] = [f64::INFINITY; 2];
    for row in &mut study.rows {
        let Ok(measured) = &mut row.outcome else { continue };
        if is_rigid(&row.configuration) {
            rigid = rigid.min(std::mem::take(&mut measured.error));
        } else if row.configuration.step_s == 5e-5 && finest.is_infinite() {
            finest = measured.error;
        } else {
            measured.error = 1.0;
        }
    }
    assert!(rigid > 10.0 * finest, "{rigid:e} {finest:e}");
    let demands = Demands { tolerance: (rigid * finest).sqrt(), real_time_factor: 1e-9 };
    let chosen = choose(&source.scene, &study, &demands, 20.0, &mut |_| {}).unwrap();
    assert!(!is_rigid(&chosen.row.configuration) && chosen.passed_over == 14, "{chosen:?}");
}

/// Links that `rigid` reads without a section cannot bend: there was no reference. Where they were written as rigid, the reference was
/// called `crank rigid`, with ever more elements.
#[test]
fn regress_links_without_a_section_are_rigid_in_every_model() {
    let selection = Selection { integrators: vec![IntegratorKind::Esdirk], steps_s: vec![5e-4, 2.5e-4], ..Selection::default() };
    let question = ask(selection, &OutputGroup::DEFAULT, 5.0);
    let source = open("thesis-compressor", &[]);
    let [told, written] = [source.clone(), open("thesis-compressor", &["crank.rigid=true", "rod.rigid=true"])]
        .map(|source| answer(&source, &question));
    assert_eq!(timeless(&told), timeless(&written));
    let names: Vec<String> = told.measured().map(|(row, _)| row.configuration.to_string()).collect();
    assert_eq!(names, ["rigid, esdirk, step 5e-4 s", "rigid, esdirk, step 2.5e-4 s"]);
    let reference = told.reference.configuration.to_string();
    assert!(reference.starts_with("finite-element, esdirk, rigid links, step "), "{reference}");
    assert_eq!(LostModes::new(&source.scene, &told, 1e-3).unwrap_err(), NoExcitation::Rigid);
}

/// A crank without a section, and a rod that can bend, as `rigid` reads them.
const HALF_RIGID: &str = r#"
[crank]
length_m = 0.1
mass_kg = 0.5

[rod]
length_m = 0.4
section = { shape = "round", diameter_m = 0.01 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.1e11
damping_s = 1e-4

[slider]
mass_kg = 0.2

[start]
angle_rad = 0.8

[[pulse]]
start_s = 0.0
torque_nm = 1.0
duration_s = 0.05
shape = "raised-cosine"

[solver]
model = "rigid"
step_s = 0.001
"#;

/// A flexible model reads a link without a section only if `rigid = true` is written.
#[test]
fn regress_settings_of_a_link_without_a_section_are_a_scene_that_reads() {
    let source = SceneSource::parse("half.toml", HALF_RIGID, &[]).unwrap();
    let selection = Selection {
        integrators: vec![IntegratorKind::Esdirk],
        modes: vec![1],
        elements: vec![2],
        steps_s: vec![1e-3],
        ..Selection::default()
    };
    let told = answer(&source, &Question { until_s: Some(0.2), ..ask(selection, &OutputGroup::DEFAULT, 5.0) });
    let names: Vec<String> = told.measured().map(|(row, _)| row.configuration.family.to_string()).collect();
    assert_eq!(names, ["rigid, esdirk", "modal, esdirk, 1 mode, crank rigid", "finite-element, esdirk, 2 elements, crank rigid"]);
    for (row, _) in told.measured() {
        let copy = source.with(&row.configuration.keys(&source.scene)).unwrap().scene;
        let is_flexible = copy.solver.model != ModelKind::Rigid;
        let rigid: Vec<bool> = copy.chain().unwrap().links.iter().map(|link| link.rigid).collect();
        assert_eq!(rigid, [is_flexible, false], "{}", row.configuration);
        assert!(Simulation::new(&copy).is_ok(), "{}", row.configuration);
    }
}
