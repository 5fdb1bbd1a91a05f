//! Vibrations by the forces that they exert at the joints.

use flexcrank::study::trade::NoExcitation;

use super::*;

/// A rod of one mode lacks the inertia of the second, and errs by about the forces of that.
#[test]
fn regress_vibrations_are_judged_by_the_forces_that_they_exert() {
    let source = open("crank-slider", &[]);
    let selection = Selection {
        models: vec![ModelKind::Modal],
        integrators: vec![IntegratorKind::Esdirk],
        modes: vec![1, 2],
        steps_s: vec![2e-3],
        ..Selection::default()
    };
    let told = answer(&source, &Question { until_s: Some(1.0), ..ask(selection, &[OutputGroup::Forces], 10.0) });
    let modes = LostModes::new(&source.scene, &told, 1e-3).unwrap();
    let second = modes.excitation.modes.iter().find(|mode| mode.name == "rod bending 2").unwrap();
    let errors: Vec<f64> = told.measured().map(|(_, measured)| measured.error).collect();
    println!("{second:?}, {errors:?}");
    assert_eq!(second.output, OutputGroup::Forces);
    assert!((0.2..2.0).contains(&(second.output_part / errors[0])), "{:.2e} for {errors:?}", second.output_part);
    let loses = |row: usize| modes.lost(row).contains(&"rod bending 2 (model)".to_owned());
    assert_eq!([loses(0), loses(1)], [true, false], "{:?} {:?}", modes.lost(0), modes.lost(1));
    let energy = Study { outputs: vec![OutputGroup::Energy], ..told };
    assert_eq!(LostModes::new(&source.scene, &energy, 1e-3).unwrap_err(), NoExcitation::NotJudged);
}
