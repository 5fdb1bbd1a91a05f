//! Vibrations by the forces that they exert at the joints, and by what rings at the start.

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

/// A rod that stretches rings at 2954 Hz as the crank starts at speed, and has done so after 30 ms. Of that, only every tenth of a second
/// was looked at.
#[test]
fn regress_ringing_at_the_start_is_looked_at_before_it_dies_away() {
    let given = [
        "pulse=[]",
        "crank={length_m=0.015, rigid=true, mass_kg=0.01}",
        "rod={length_m=0.06, section={shape=\"rectangle\", width_m=0.004, height_m=0.006}, density_kg_per_m3=2700.0, \
         youngs_modulus_pa=7e10, elements=4, modes=1, axial=true, damping_s=8e-7}",
        "slider.mass_kg=0.08",
        "start.rate_rad_per_s=94",
        "drive.ramp={to_rad_per_s=251,over_s=0.5}",
    ];
    let source = open("crank-slider", &given);
    let selection = Selection {
        models: vec![ModelKind::Modal],
        integrators: vec![IntegratorKind::Esdirk],
        modes: vec![1],
        steps_s: vec![2.5e-3],
        ..Selection::default()
    };
    let told = answer(&source, &Question { until_s: Some(0.5), ..ask(selection, &[OutputGroup::Deflection], 10.0) });
    let modes = LostModes::new(&source.scene, &told, 1e-3).unwrap();
    let ringing = modes.excitation.modes.iter().find(|mode| mode.name == "rod stretching 1").unwrap();
    println!("{ringing:?}");
    assert!((1e-2..5e-2).contains(&ringing.output_part), "{:.2e}", ringing.output_part);
}
