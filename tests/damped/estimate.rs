//! The estimate that a run publishes, beside its true error: against the same model and mesh, converged in the step.

use flexcrank::scene::IntegratorKind::{Esdirk, GeneralizedAlpha, RungeKutta, TwoPoint};
use flexcrank::scene::{IntegratorKind, ModelKind};

use crate::{LOOKS, apart_rad, run};

/// Errors that are judged, rad.
const FROM_RAD: f64 = 1e-7;
const TO_RAD: f64 = 1e-2;
const UNTIL_S: f64 = 2.0;

/// Estimate over error, least and most, of all steps of a scene.
fn ratios(scene: &str, model: ModelKind, integrator: IntegratorKind) -> Option<[f64; 2]> {
    let at = |integrator: IntegratorKind, step_s: f64| {
        let given = [
            format!("solver.model=\"{}\"", model.as_str()),
            format!("solver.integrator=\"{}\"", integrator.as_str()),
            format!("solver.step_s={step_s:e}"),
            "crank.elements=8".to_owned(),
            "rod.elements=8".to_owned(),
        ];
        run(scene, &given, (UNTIL_S / step_s / LOOKS as f64).round() as usize).ok()
    };
    let converged = at(Esdirk, 5e-5)?;
    let mut found: Option<[f64; 2]> = None;
    for step_s in [1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4] {
        let Some(run) = at(integrator, step_s) else { continue };
        let error_rad = apart_rad(&run, &converged);
        if (FROM_RAD..=TO_RAD).contains(&error_rad) {
            let ratio = run.estimate_rad / error_rad;
            println!("{scene} {model:?} {integrator:?} {step_s:e}: {error_rad:.1e} rad, estimate {ratio:.2} of it");
            found = Some(found.map_or([ratio; 2], |[least, most]| [least.min(ratio), most.max(ratio)]));
        }
    }
    found
}

/// Between these parts of the error. Errors of finite elements with ESDIRK cancel where vibration is not resolved: see `ErrorEstimate`.
#[test]
fn val_the_estimate_is_of_the_size_of_the_error() {
    let schemes = [Esdirk, GeneralizedAlpha, TwoPoint, RungeKutta];
    for model in [ModelKind::Rigid, ModelKind::Modal, ModelKind::FiniteElement] {
        for integrator in schemes.into_iter().filter(|scheme| *scheme != RungeKutta || model == ModelKind::Rigid) {
            let most = if (model, integrator) == (ModelKind::FiniteElement, Esdirk) { 25.0 } else { 3.5 };
            for scene in ["crank-slider", "ref-r2s"] {
                let found =
                    ratios(scene, model, integrator).unwrap_or_else(|| panic!("{scene} {model:?} {integrator:?}: no step"));
                assert!(found[0] > 0.4 && found[1] < most, "{scene} {model:?} {integrator:?}: {found:?}");
            }
        }
    }
}
