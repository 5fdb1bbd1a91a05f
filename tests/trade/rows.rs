//! Rows of ever shorter steps.

use std::ops::ControlFlow;
use std::time::Instant;

use flexcrank::simulation::EnergyVerdict;
use flexcrank::study::trade::Progress;

use super::*;

/// A small compressor: the rod vibrates at 2 kHz and more, and rings under the gas force that is there at the start.
const COMPRESSOR: &str = r#"
[crank]
length_m = 0.03
rigid = true
mass_kg = 1.5
centre_of_mass_m = 0.0
inertia_kg_m2 = 4e-3

[rod]
length_m = 0.13
section = { shape = "rectangle", width_m = 0.008, height_m = 0.012 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7.0e10
axial = true
damping_s = 2e-6

[slider]
mass_kg = 0.25
friction_n_s_per_m = 3.0
resistance_table = [[0.0, 300.0], [0.5, 0.0], [3.1416, 0.0], [5.5, 300.0], [6.2, 300.0]]

[start]
angle_rad = 0.6
rate_rad_per_s = 150.0

[torque]
constant_nm = 4.5

[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.00005
"#;

/// Errors of forces jump about as long as the step does not resolve the rod: that is no end.
#[test]
fn regress_a_row_goes_on_until_its_steps_resolve_bending() {
    let source = SceneSource::parse("compressor.toml", COMPRESSOR, &[]).unwrap();
    let selection = Selection {
        models: vec![ModelKind::Modal],
        integrators: vec![IntegratorKind::Esdirk],
        modes: vec![1],
        ..Selection::default()
    };
    let outputs = [OutputGroup::Deflection, OutputGroup::Forces];
    let study = answer(&source, &Question { until_s: Some(0.3), enough: Some(2e-2), ..ask(selection, &outputs, 60.0) });
    let least = study.measured().map(|(_, measured)| measured.error).fold(f64::INFINITY, f64::min);
    assert!(least < 0.1, "{least}");
}

/// A ruler on a stiff spring under rectangular pulses, whose ringing long steps damp away with its energy.
const RULER: &str = r#"
[beam]
length_m = 0.4
section = { shape = "rectangle", width_m = 0.025, height_m = 0.001 }
density_kg_per_m3 = 7850
youngs_modulus_pa = 2.05e11
damping_s = 3e-4

[base]
torsion_spring_nm_per_rad = 200.0

[[pulse]]
start_s = 0.2
torque_nm = 2.0
duration_s = 0.04

[[pulse]]
start_s = 0.395
torque_nm = 2.0
duration_s = 0.04

[[pulse]]
start_s = 0.59
torque_nm = 2.0
duration_s = 0.04
"#;

/// The cheapest within the tolerance was chosen without a word, and `run` called it not to be trusted.
#[test]
fn regress_a_choice_keeps_its_energy_balance() {
    let source = SceneSource::parse("ruler.toml", RULER, &[]).unwrap();
    let selection =
        Selection { models: vec![ModelKind::Modal], integrators: vec![IntegratorKind::Esdirk], ..Selection::default() };
    let question = Question { enough: Some(2.5e-3), ..ask(selection, &OutputGroup::DEFAULT, 20.0) };
    let study = answer(&source, &question);
    let demands = Demands { tolerance: 1e-2, real_time_factor: 1e-9 };
    let chosen = choose(&source.scene, &study, &demands, 20.0, &mut |_| {}).unwrap();
    let measured = |row: &flexcrank::study::trade::Row| row.outcome.clone().unwrap();
    let cost = |measured: &flexcrank::study::trade::Measured| measured.counted_s_per_s;
    let of_choice = measured(&chosen.row);
    let is_cheaper =
        |other: &flexcrank::study::trade::Measured| cost(other) < cost(&of_choice) && other.error <= demands.tolerance;
    let is_chosen_without_it = study.measured().any(|(_, other)| is_cheaper(other) && !other.balance_kept);
    assert!(is_chosen_without_it, "a cheaper one is not to be trusted");
    let mut simulation = Simulation::new(&chosen.row.configuration.scene(&source.scene)).unwrap();
    while simulation.time_s() < study.grid.until_s() {
        simulation.step().unwrap();
    }
    let verdict = simulation.energy_verdict();
    assert!(
        of_choice.balance_kept && !matches!(verdict, EnergyVerdict::Unbalanced { .. }),
        "{}: {verdict:?}",
        chosen.row.configuration
    );
}

/// All that the budget left out was called finer.
#[test]
fn regress_families_that_were_not_begun_are_told_from_finer_configurations() {
    let selection = Selection {
        models: vec![ModelKind::Modal],
        integrators: vec![IntegratorKind::GeneralizedAlpha],
        modes: vec![1, 2, 3],
        steps_s: vec![2e-3, 1e-3],
        ..Selection::default()
    };
    let question = Question { until_s: Some(0.3), ..ask(selection, &[OutputGroup::Angle], 2.0) };
    let begin = Instant::now();
    // The first configuration takes the rest of the budget.
    let mut take_all = |progress: Progress<'_>| {
        while !progress.reference && begin.elapsed().as_secs_f64() <= question.budget_s {
            std::thread::yield_now();
        }
        ControlFlow::Continue(())
    };
    let told = study(&open("ref-r2s", &[]).scene, &question, &mut take_all).unwrap();
    let of_modes: Vec<usize> = told.not_begun.iter().map(|family| family.resolution).collect();
    assert_eq!((told.rows.len(), told.left_out), (1, 1 + 2 * told.not_begun.len()));
    assert!(of_modes.contains(&2) && of_modes.contains(&3) && !told.not_begun.contains(&told.rows[0].configuration.family));
}
