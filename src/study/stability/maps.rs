//! The maps of the extremes sweep: one function per kind of extreme.
//!
//! A key that is not swept has the base scene's value, but every link has two elements (one for the incremental model), so that
//! the middle of the rod is observed. References are the finite-element model with eight elements per link, or the rigid model
//! for rigid cells, at a fine step by another scheme. One reference serves every model and step of the same mechanism. `damping`
//! has the maps of the scene as it stands.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::base_scene::BaseScene;
use super::methods::{
    FINITE_ELEMENT, FINITE_ELEMENT_ESDIRK, FINITE_ELEMENT_TWO_POINT, INCREMENTAL, MODAL, MODAL_ESDIRK, MODAL_EXPLICIT,
    MODAL_TWO_POINT, Method, RIGID, RIGID_TWO_POINT,
};
use super::plan::{Axis, Cell, Map, MapPlan, Measure, Spacing};
use super::quantity::{self, Quantity};
use crate::scene::{IntegratorKind, ModelKind};
use Spacing::{Linear, Listed, Log};

/// Size of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Everything: thousands of cells.
    Whole,
    /// A few values on each axis, short runs: a fraction of a minute.
    Quick,
}

impl Extent {
    /// Time that a cell covers, s, unless it takes twenty longer steps.
    pub fn time_s(self) -> f64 {
        if self == Extent::Whole { 0.25 } else { 0.05 }
    }
}

/// Builds the maps.
pub(super) struct Builder<'a> {
    base: &'a BaseScene,
    pub(super) extent: Extent,
    pub(super) plan: MapPlan,
}

impl MapPlan {
    /// The extremes of a crank-slider.
    pub fn extremes(base: &BaseScene, extent: Extent) -> Self {
        let mut builder = Builder { base, extent, plan: MapPlan::default() };
        builder.damping();
        builder.modes();
        builder.fine_meshes();
        builder.stiffness();
        builder.crank_speed();
        builder.slenderness();
        builder.ratio();
        builder.slider_mass();
        builder.elements();
        builder.weight();
        builder.rho_infinity();
        builder.pulses();
        builder.starts();
        builder.revolutions();
        builder.switches();
        builder.plan
    }
}

impl Builder<'_> {
    fn stiffness(&mut self) {
        let moduli = self.axis(quantity::YOUNGS_MODULUS, decades(4, 15, 2));
        for method in [MODAL, MODAL_EXPLICIT, MODAL_ESDIRK, FINITE_ELEMENT, FINITE_ELEMENT_ESDIRK, INCREMENTAL] {
            self.by_step("stiffness", method, &moduli, |modulus| {
                ["crank", "rod"].map(|link| set(&format!("{link}.youngs_modulus_pa"), modulus)).to_vec()
            });
        }
    }

    /// Prescribed crank speeds, as parts of the rod's first resonance.
    fn crank_speed(&mut self) {
        let parts = vec![0.01, 0.1, 0.25, 0.5, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.25, 2.0, 4.0, 10.0, 100.0];
        let speeds = Axis { spacing: Log, ..self.axis(quantity::SPEED, parts) };
        let resonance = self.base.rod_resonance_rad_per_s;
        for method in [MODAL, MODAL_ESDIRK, FINITE_ELEMENT, FINITE_ELEMENT_ESDIRK] {
            self.by_step("crank-speed", method, &speeds, |part| {
                let speed = part * resonance;
                // In place of any drive or torque that the scene has.
                let drive = format!("drive={{ speed_rad_per_s = {speed:?} }}");
                vec!["pulse=[]".to_owned(), set("torque.constant_nm", 0.0), set("start.rate_rad_per_s", speed), drive]
            });
        }
    }

    fn slenderness(&mut self) {
        let slenderness = self.axis(quantity::SLENDERNESS, decades(0, 6, 2));
        let base = self.base;
        for method in [MODAL, MODAL_ESDIRK, FINITE_ELEMENT, FINITE_ELEMENT_ESDIRK] {
            self.by_step("slenderness", method, &slenderness, |slenderness| base.square_sections(slenderness));
        }
    }

    /// λ = l1/l2, the rod as it is.
    fn ratio(&mut self) {
        let ratios = vec![0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999, 0.9999, 1.0];
        let ratios = Axis { spacing: Listed, ..self.axis(quantity::RATIO, ratios) };
        let rod_m = self.base.lengths_m[1];
        for method in [RIGID, MODAL, FINITE_ELEMENT] {
            self.by_step("ratio", method, &ratios, |ratio| vec![set("crank.length_m", ratio * rod_m)]);
        }
    }

    fn slider_mass(&mut self) {
        let mut masses = vec![0.0];
        masses.extend(decades(-6, 6, 1));
        let masses = Axis { spacing: Listed, ..self.axis(quantity::SLIDER_MASS, masses) };
        let rod_kg = self.base.rod_mass_kg;
        for method in [MODAL, MODAL_ESDIRK, FINITE_ELEMENT, FINITE_ELEMENT_ESDIRK] {
            self.by_step("slider-mass", method, &masses, |part| vec![set("slider.mass_kg", part * rod_kg)]);
        }
    }

    fn elements(&mut self) {
        let counts: Vec<f64> = [0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000, 1001].map(f64::from).to_vec();
        let counts = Axis { spacing: Listed, ..self.axis(quantity::ELEMENTS, counts) };
        let x = self.step_axis();
        let reference = self.reference(&FINITE_ELEMENT, &[]);
        let mut cells = Vec::new();
        for &count in &counts.values {
            let given = ["crank", "rod"].map(|link| format!("{link}.elements={}", count as i64));
            for &step_s in &x.values {
                let overrides = [FINITE_ELEMENT.overrides(), given.to_vec(), vec![set("solver.step_s", step_s)]].concat();
                // The work of a cell stays the same: fewer steps of more elements.
                let steps = self.thinned(self.count(step_s)).min((20_000.0 / count.max(1.0)) as u64);
                cells.push(Cell { overrides, steps, reference: Some(reference), measure: Measure::Length, switch: None });
            }
        }
        self.add("elements", &FINITE_ELEMENT, &x, &counts, cells);
    }

    fn weight(&mut self) {
        let weights = self.axis(quantity::WEIGHT, (0..=10).map(|n| f64::from(n) / 10.0).collect());
        for method in [RIGID_TWO_POINT, INCREMENTAL, MODAL_TWO_POINT, FINITE_ELEMENT_TWO_POINT] {
            self.by_step("weight", method, &weights, |weight| vec![set("solver.weight", weight)]);
        }
    }

    fn rho_infinity(&mut self) {
        let rhos = self.axis(quantity::RHO_INFINITY, vec![0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
        for method in [MODAL, FINITE_ELEMENT] {
            self.by_step("rho-infinity", method, &rhos, |rho| vec![set("solver.rho_infinity", rho)]);
        }
    }

    /// Pulses from nothing to far beyond what the links bear, from far within a step to thousands of them.
    fn pulses(&mut self) {
        let step_s = 1e-3;
        let torques = self.axis(quantity::TORQUE, decades(-9, 9, 1));
        let lengths = self.axis(quantity::DURATION, decades(-6, 4, 1));
        for method in [RIGID, MODAL] {
            let mut cells = Vec::new();
            for &torque_nm in &torques.values {
                for &length in &lengths.values {
                    let duration_s = length * step_s;
                    let pulse = format!("pulse=[{{ start_s = 0.0, torque_nm = {torque_nm:?}, duration_s = {duration_s:?} }}]");
                    let reference = self.reference(&method, std::slice::from_ref(&pulse));
                    let overrides = [method.overrides(), vec![pulse, set("solver.step_s", step_s)]].concat();
                    let steps = self.count(step_s).max((1.1 * length) as u64);
                    cells.push(Cell {
                        overrides,
                        steps: self.thinned(steps),
                        reference: Some(reference),
                        measure: Measure::Length,
                        switch: None,
                    });
                }
            }
            self.add("pulses", &method, &lengths, &torques, cells);
        }
    }

    /// Starts at the dead centres, next to them, at the right angles, and many turns away.
    fn starts(&mut self) {
        let step_s = 1e-3;
        let near = |angle: f64| [angle - 1e-3, angle - 1e-9, angle, angle + 1e-9, angle + 1e-3];
        let mut angles = vec![-1e6, -PI, -FRAC_PI_2];
        angles.extend([0.0, FRAC_PI_2, PI].into_iter().flat_map(near));
        angles.extend([-1e-12, 1e-12, TAU, 1e6]);
        angles.sort_by(f64::total_cmp);
        let angles = Axis { spacing: Listed, ..self.axis(quantity::START_ANGLE, angles) };
        let ratios = Axis { spacing: Listed, ..self.axis(quantity::RATIO, vec![0.1, 0.3333, 0.9, 0.999, 0.9999]) };
        for method in [RIGID, MODAL, FINITE_ELEMENT, INCREMENTAL] {
            let mut cells = Vec::new();
            for &angle in &angles.values {
                for &ratio in &ratios.values {
                    let given = [set("crank.length_m", ratio * self.base.lengths_m[1]), set("start.angle_rad", angle)];
                    let reference = self.reference(&method, &given);
                    let overrides = [method.overrides(), given.to_vec(), vec![set("solver.step_s", step_s)]].concat();
                    let steps = self.thinned(self.count(step_s));
                    cells.push(Cell { overrides, steps, reference: Some(reference), measure: Measure::Length, switch: None });
                }
            }
            self.add("starts", &method, &ratios, &angles, cells);
        }
    }

    /// A million revolutions of the rigid model, rolling freely at about ten a second, without reset.
    fn revolutions(&mut self) {
        let revolutions = if self.extent == Extent::Whole { 1_000_000 } else { 1_000 };
        let ratios = Axis { spacing: Listed, ..self.axis(quantity::RATIO, vec![0.3333, 0.9]) };
        let parts = Axis::new(quantity::STEPS_PER_TURN, Log, vec![16.0, 32.0]);
        for method in [RIGID, RIGID_TWO_POINT] {
            let mut cells = Vec::new();
            for &ratio in &ratios.values {
                for &part in &parts.values {
                    let turning = [
                        "pulse=[]".to_owned(),
                        set("crank.length_m", ratio * self.base.lengths_m[1]),
                        set("start.rate_rad_per_s", 10.0 * TAU),
                        set("solver.step_s", 0.1 / part),
                    ];
                    let steps = revolutions * part as u64;
                    cells.push(Cell {
                        overrides: [method.overrides(), turning.to_vec()].concat(),
                        steps,
                        reference: None,
                        measure: Measure::Length,
                        switch: None,
                    });
                }
            }
            self.add("revolutions", &method, &parts, &ratios, cells);
        }
    }

    /// A map of step against something else.
    fn by_step(&mut self, name: &str, method: Method, y: &Axis, given: impl Fn(f64) -> Vec<String>) {
        let x = self.step_axis();
        let mut cells = Vec::new();
        for &value in &y.values {
            let given = given(value);
            let mechanism: Vec<String> = given.iter().filter(|given| !given.starts_with("solver.")).cloned().collect();
            let reference = self.reference(&method, &mechanism);
            for &step_s in &x.values {
                let overrides = [method.overrides(), given.clone(), vec![set("solver.step_s", step_s)]].concat();
                let steps = self.thinned(self.count(step_s));
                cells.push(Cell { overrides, steps, reference: Some(reference), measure: Measure::Length, switch: None });
            }
        }
        self.add(name, &method, &x, y, cells);
    }

    pub(super) fn add(&mut self, name: &str, method: &Method, x: &Axis, y: &Axis, cells: Vec<Cell>) {
        let name = format!("{name}-{}", method.name());
        let title = format!("{} and {}: {}", y.of.words, x.of.words, method.title());
        self.plan.maps.push(Map { name, title, x: x.clone(), y: y.clone(), cells });
    }

    /// The same mechanism at a fine step, by another scheme than the method's.
    pub(super) fn reference(&mut self, method: &Method, mechanism: &[String]) -> usize {
        let esdirk = method.integrator == IntegratorKind::Esdirk;
        let (fine, step_s) = if method.model == ModelKind::Rigid {
            (Method::of(ModelKind::Rigid, IntegratorKind::Esdirk), 2e-5)
        } else if esdirk {
            (FINITE_ELEMENT.meshed(8), 2e-5)
        } else {
            (FINITE_ELEMENT_ESDIRK.meshed(8), 8e-5)
        };
        let steps = self.count(step_s);
        self.plan.reference([fine.overrides(), mechanism.to_vec(), vec![set("solver.step_s", step_s)]].concat(), steps)
    }

    fn step_axis(&self) -> Axis {
        Axis { spacing: Log, ..self.axis(quantity::STEP, decades(-5, 0, 2)) }
    }

    /// All values, or a few of them, the ends included.
    pub(super) fn axis(&self, of: Quantity, values: Vec<f64>) -> Axis {
        let most = 4;
        let last = values.len() - 1;
        let values = match self.extent {
            Extent::Quick if values.len() > most => (0..most).map(|k| values[k * last / (most - 1)]).collect(),
            _ => values,
        };
        let ratios = values.windows(2).all(|pair| pair[0] > 0.0 && pair[1] > 3.0 * pair[0]);
        Axis::new(of, if ratios { Log } else { Linear }, values)
    }

    /// Steps over the time that every cell covers, or twenty of long ones.
    pub(super) fn count(&self, step_s: f64) -> u64 {
        ((self.extent.time_s() / step_s).round() as u64).max(20)
    }

    pub(super) fn thinned(&self, steps: u64) -> u64 {
        if self.extent == Extent::Whole { steps } else { steps.min(200) }
    }
}

/// From 10^`from` to 10^`to`, `parts` a decade.
pub(super) fn decades(from: i32, to: i32, parts: i32) -> Vec<f64> {
    let value = |n: i32| {
        if n % parts == 0 {
            format!("1e{}", n / parts).parse().unwrap_or(f64::NAN)
        } else {
            10.0_f64.powf(f64::from(n) / f64::from(parts))
        }
    };
    (from * parts..=to * parts).map(value).collect()
}

pub(super) fn set(key: &str, value: f64) -> String {
    format!("{key}={value:?}")
}
