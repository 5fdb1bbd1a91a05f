//! The maps of damping and of resolution against step: the scene as it stands, by every model and every integrator that it may
//! name.
//!
//! A reference owes a cell nothing but its mechanism: the same model and resolution by another scheme at another step, so that the
//! scheme is judged, not the model. (The incremental model has one scheme; its reference is that of the extremes.) Steps go down
//! to 1 µs, and fine ones end before the time is over: see [`MOST_STEPS`].

use super::maps::{Builder, Extent, decades, set};
use super::methods::Method;
use super::plan::{Axis, Cell, Measure, Spacing};
use super::quantity::{self, Quantity};
use crate::scene::ModelKind;

/// Step limit of a cell, however fine its steps: 20 ms of the motion at 1 µs, all of it from 13 µs on.
const MOST_STEPS: u64 = 20_000;
/// Step limit divided by the number of modes.
const MOST_MODE_STEPS: u64 = 100_000;
/// Step limit divided by the number of elements.
const MOST_ELEMENT_STEPS: u64 = 200_000;
/// Step of references, s; no column has this step.
const REFERENCE_STEP_S: f64 = 2e-5;
/// A reference takes so many steps at least while a cell lasts: from rest, the first few of a scheme of second order err by per cent of
/// the way.
const LEAST_REFERENCE_STEPS: f64 = 128.0;
/// Elements of the reference mesh; its error is below 1e-4 of the bound.
const REFERENCE_ELEMENTS: usize = 20;

/// A scene key that a map varies.
struct Varied {
    map: &'static str,
    axis: Quantity,
    values: Vec<f64>,
    keys: &'static [&'static str],
    suits: fn(ModelKind) -> bool,
}

fn varied() -> [Varied; 3] {
    let from_nothing = |low: i32, high: i32| [vec![0.0], decades(low, high, 1)].concat();
    [
        Varied {
            map: "damping",
            axis: quantity::DAMPING,
            values: from_nothing(-6, 0),
            keys: &["crank.damping_s", "rod.damping_s"],
            suits: |model| model != ModelKind::Rigid,
        },
        Varied {
            map: "base-damper",
            axis: quantity::DAMPER,
            values: from_nothing(-3, 5),
            keys: &["base.damper_nm_s_per_rad"],
            suits: |_| true,
        },
        Varied {
            map: "friction",
            axis: quantity::FRICTION,
            values: from_nothing(-2, 6),
            keys: &["slider.friction_n_s_per_m"],
            suits: |_| true,
        },
    ]
}

impl Builder<'_> {
    /// `damping_s` of both links, the damper at the base, the slider's friction.
    pub(super) fn damping(&mut self) {
        for Varied { map, axis, values, keys, suits } in varied() {
            let axis = Axis { spacing: Spacing::Listed, ..self.axis(axis, values) };
            for method in Method::all().filter(|method| suits(method.model)) {
                self.against_fine_steps(map, &axis, |value| Row {
                    method,
                    reference: method,
                    given: keys.iter().map(|key| set(key, value)).collect(),
                    most_steps: MOST_STEPS,
                });
            }
        }
    }

    /// Modes of both links.
    pub(super) fn modes(&mut self) {
        let modes = Axis { spacing: Spacing::Listed, ..self.axis(quantity::MODES, [1, 2, 4, 8, 12, 20].map(f64::from).to_vec()) };
        for method in Method::all().filter(|method| method.model == ModelKind::Modal) {
            self.against_fine_steps("modes", &modes, |count| Row {
                method,
                reference: method,
                given: ["crank", "rod"].map(|link| format!("{link}.modes={count}")).to_vec(),
                most_steps: MOST_STEPS.min(MOST_MODE_STEPS / count as u64),
            });
        }
    }

    /// Elements of both links.
    pub(super) fn fine_meshes(&mut self) {
        let counts = [1, 2, 5, 10, 20, 50, 100, 200].map(f64::from).to_vec();
        let counts = Axis { spacing: Spacing::Listed, ..self.axis(quantity::ELEMENTS, counts) };
        for method in Method::all().filter(|method| method.model == ModelKind::FiniteElement) {
            self.against_fine_steps("mesh", &counts, |count| Row {
                method: method.meshed(count as usize),
                reference: method.meshed((count as usize).min(REFERENCE_ELEMENTS)),
                given: Vec::new(),
                most_steps: MOST_STEPS.min(MOST_ELEMENT_STEPS / count as u64),
            });
        }
    }

    fn against_fine_steps(&mut self, map: &str, y: &Axis, row: impl Fn(f64) -> Row) {
        let x = Axis { spacing: Spacing::Log, ..self.axis(quantity::STEP, decades(-6, -2, 2)) };
        let (mut cells, mut named) = (Vec::new(), None);
        for &value in &y.values {
            let Row { method, reference: resolved, given, most_steps } = row(value);
            for &step_s in &x.values {
                let overrides = [method.overrides(), given.clone(), vec![set("solver.step_s", step_s)]].concat();
                let steps = self.thinned(self.count(step_s)).min(most_steps);
                let (reference, measure) = if method.model == ModelKind::Incremental {
                    (self.reference(&method, &given), Measure::Length)
                } else {
                    (self.other_scheme(resolved, &given, steps as f64 * step_s), Measure::Travel)
                };
                cells.push(Cell { overrides, steps, reference: Some(reference), measure, switch: None });
            }
            named = Some(method);
        }
        if let Some(method) = named {
            self.add(map, &method, &x, y, cells);
        }
    }

    /// The same mechanism, model and resolution by another scheme, for a cell that lasts `lasts_s`.
    fn other_scheme(&mut self, method: Method, given: &[String], lasts_s: f64) -> usize {
        let usual_s = if self.extent == Extent::Whole { REFERENCE_STEP_S } else { 2.0 * REFERENCE_STEP_S };
        let step_s = usual_s.min(lasts_s / LEAST_REFERENCE_STEPS);
        let steps = if step_s < usual_s { LEAST_REFERENCE_STEPS as u64 + 1 } else { self.count(step_s) };
        let overrides = [method.other_scheme().overrides(), given.to_vec(), vec![set("solver.step_s", step_s)]].concat();
        self.plan.reference(overrides, steps)
    }
}

/// One row of a map, and its reference.
struct Row {
    method: Method,
    reference: Method,
    given: Vec<String>,
    most_steps: u64,
}
