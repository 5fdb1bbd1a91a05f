//! Links that are rigid, by the scene or by the choice.

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
