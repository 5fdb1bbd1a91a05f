//! Errors below the uncertainty of the reference, or not ten times as large: how they are refused and tabulated.

use flexcrank::study::trade::{CHANNELS, ERROR_IS_BOUND, Errors, Excess, FinerBudget, REFERENCE_ERROR};

use super::*;

/// Errors in the crank angle and in the deflections.
fn errors([angle, deflection]: [f64; 2]) -> Errors {
    let mut relative = [0.0; CHANNELS.len()];
    (relative[0], relative[2]) = (angle, deflection);
    Errors { rms: relative, max: relative, relative, energy: 0.0 }
}

/// A study of three steps with these errors, the longest step first. Its reference is refined twice and known to `estimate`; one
/// more refinement needs a budget of a minute.
fn study_of(source: &SceneSource, estimate: [f64; 2], of_rows: [[f64; 2]; 3]) -> Study {
    let selection = Selection {
        models: vec![ModelKind::Rigid],
        integrators: vec![IntegratorKind::RungeKutta],
        steps_s: vec![1e-3, 5e-4, 1e-4],
        ..Selection::default()
    };
    let outputs = [OutputGroup::Angle, OutputGroup::Deflection];
    let mut study = answer(source, &Question { until_s: Some(0.02), ..ask(selection, &outputs, 5.0) });
    study.reference.estimate = errors(estimate);
    study.reference.refined = 2;
    study.reference.finer_budget_s = Some(60.0);
    study.reference.gain = Some(10.0);
    assert_eq!(study.rows.len(), of_rows.len());
    for (row, of_row) in study.rows.iter_mut().zip(of_rows) {
        let measured = row.outcome.as_mut().unwrap();
        measured.errors = errors(of_row);
        measured.error = study.reference.bounded_error(&measured.errors, &study.outputs);
    }
    study
}

/// A setting whose angle is surely wrong was named the best, because the bound of all deflections was larger.
#[test]
fn regress_the_best_has_the_least_error_that_is_certain() {
    let source = open("ref-r2s", &[]);
    let demands = Demands { tolerance: 5e-3, real_time_factor: 1e-9 };
    let refined = Excess::AtMost { sufficient_budget: Some(FinerBudget { budget_s: 240.0, is_likely: true }) };
    // A refusal named the angle alone: a looser tolerance for that failed in deflection.
    let deflection = Some("deflection");
    for (of_rows, step_s, output, times, excess, larger) in [
        ([[4.4e-2, 6e-2], [1e-3, 1.6e-1], [5e-5, 7e-2]], 1e-4, OutputGroup::Deflection, 15.0, refined, None),
        ([[4.4e-2, 6e-2], [3e-2, 7e-2], [9e-2, 5e-2]], 5e-4, OutputGroup::Angle, 6.0, Excess::Measured, deflection),
        ([[4.4e-2, 2e-1], [5e-5, 1e-1], [5e-5, 3e-1]], 5e-4, OutputGroup::Deflection, 5.0, Excess::AtLeast, deflection),
    ] {
        let study = study_of(&source, [1.1e-4, 7.5e-2], of_rows);
        let refusal = choose(&source.scene, &study, &demands, 5.0, &mut |_| {}).unwrap_err();
        let Refusal::Tolerance { best, times: found_times, output: found_output, excess: found_excess, perhaps, .. } = &refusal
        else {
            panic!("{refusal}")
        };
        assert_eq!((best.step_s, *found_output, *found_excess), (step_s, output, excess), "{refusal}");
        assert!((found_times / times - 1.0).abs() < 1e-9, "{refusal}");
        assert_eq!(perhaps.map(|(word, _)| word), larger, "{refusal}");
    }
}

/// Each refinement is expected to gain a factor of 8, and costs four times as much. Where the last one gained less, or there was but one,
/// no budget is known to suffice.
#[test]
fn prop_the_budget_of_a_refusal_refines_the_reference_to_the_tolerance() {
    let source = open("ref-r2s", &[]);
    let mut study = study_of(&source, [0.0, 1e-1], [[0.0; 2]; 3]);
    for (gain, tolerance, budget_s) in [
        (Some(10.0), 9e-2, Some(60.0)),
        (Some(10.0), 2e-2, Some(60.0)),
        (Some(10.0), 1e-2, Some(240.0)),
        (Some(10.0), 1e-5, None),
        (None, 1e-2, Some(240.0)),
        (Some(0.7), 1e-2, Some(60.0)),
    ] {
        study.reference.gain = gain;
        let demands = Demands { tolerance, real_time_factor: 1e-9 };
        let refusal = choose(&source.scene, &study, &demands, 5.0, &mut |_| {}).unwrap_err();
        let is_likely = gain == Some(10.0);
        let expected = Excess::AtMost { sufficient_budget: budget_s.map(|budget_s| FinerBudget { budget_s, is_likely }) };
        assert!(matches!(refusal, Refusal::Tolerance { excess, .. } if excess == expected), "{tolerance}: {refusal}");
    }
}

#[test]
fn regress_a_refusal_because_of_the_reference_names_the_budget() {
    let best = Configuration {
        family: Family {
            model: ModelKind::FiniteElement,
            integrator: IntegratorKind::Esdirk,
            resolution: 8,
            rigid: vec![false, false],
            axial: vec![true; 2],
        },
        step_s: 1e-3,
    };
    let at_most = |sufficient_budget| Excess::AtMost { sufficient_budget };
    let budget = |is_likely| Some(FinerBudget { budget_s: 601.0, is_likely });
    let unknown = ": the reference itself is not known well enough to judge (see its estimate); ";
    let [fails, not_known] = ["the tolerance fails", "no configuration is known to hold the tolerance"];
    for (excess, start, part, reason) in [
        (at_most(budget(true)), not_known, "up to ", format!("{unknown}--budget 11min should refine it so far")),
        (at_most(budget(false)), not_known, "up to ", format!("{unknown}--budget 11min refines it further, perhaps so far")),
        (at_most(None), not_known, "up to ", format!("{unknown}no --budget refines it so far")),
        (Excess::AtLeast, fails, "at least ", String::new()),
        (Excess::Measured, fails, "", String::new()),
    ] {
        let refusal = Refusal::Tolerance {
            best: Box::new(best.clone()),
            times: 2.078,
            output: OutputGroup::Deflection,
            word: "deflection",
            excess,
            perhaps: None,
            left_out: 0,
        };
        let expected = format!("{start}: the best, {best}, is {part}2.078 times over it in deflection{reason}");
        assert_eq!(refusal.to_string(), expected);
    }
    // A table that the budget ended is no proof.
    let (times, output, excess) = (50.0, OutputGroup::Angle, Excess::Measured);
    let (word, perhaps) = ("angle", Some(("deflection", 60.0)));
    let refusal = Refusal::Tolerance { best: Box::new(best.clone()), times, output, word, excess, perhaps, left_out: 567 };
    let expected = format!(
        "no configuration that was measured holds the tolerance: the best, {best}, is 50.000 times over it in angle, and perhaps \
         60.000 times in deflection, which the reference does not know well; with a larger --budget, more are measured (567 skipped)"
    );
    assert_eq!(refusal.to_string(), expected);
}

#[test]
fn regress_the_table_tells_bounds_from_measured_errors() {
    let source = open("ref-r2s", &[]);
    let study = study_of(&source, [1e-4, 1e-2], [[5e-1, 2e-2], [5e-5, 2e-2], [5e-5, 5e-3]]);
    let table = table(&study, None);
    assert_eq!(table.column("error").unwrap(), [5e-1, 2e-2, 1e-2]);
    assert_eq!(table.column(ERROR_IS_BOUND).unwrap(), [0.0, 0.0, 1.0]);
    assert_eq!(table.column(REFERENCE_ERROR).unwrap(), [1e-4, 1e-2, 1e-2]);
}
