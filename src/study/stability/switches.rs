//! The maps of switches: a run that goes on as another model, where the links bend strongly, where the crank is fast, and next to
//! the dead centres.

use std::f64::consts::{FRAC_PI_2, PI};

use super::maps::{Builder, decades, set};
use super::methods::{FINITE_ELEMENT, MODAL_ESDIRK, Method, RIGID};
use super::plan::{Axis, Cell, Map, Measure, Spacing, Switch};
use super::quantity;

/// The models that runs switch between.
const METHODS: [Method; 3] = [RIGID, MODAL_ESDIRK, FINITE_ELEMENT];
const STEP_S: f64 = 1e-3;

impl Builder<'_> {
    /// Every model to every other one, under a pulse and at a speed.
    pub(super) fn switches(&mut self) {
        for from in METHODS {
            for to in METHODS.into_iter().filter(|to| to.name() != from.name()) {
                self.switches_under_load(from, to);
                self.switches_at_dead_centres(from, to);
            }
        }
    }

    /// The torque of a pulse that bends the links against the time of the switch.
    fn switches_under_load(&mut self, from: Method, to: Method) {
        let torques = self.axis(quantity::TORQUE, decades(0, 3, 2));
        let times = self.axis(quantity::SWITCH_TIME, vec![1e-3, 0.01, 0.02, 0.03, 0.045]);
        let times = Axis { spacing: Spacing::Listed, ..times };
        let pulse = |torque: f64| format!("pulse=[{{ start_s = 0.0, torque_nm = {torque:?}, duration_s = 0.03 }}]");
        let cell = |builder: &mut Self, torque, at_s| builder.switch(from, to, vec![pulse(torque)], at_s);
        let cells = self.cells(&times, &torques, cell);
        self.add_switches("switch-loaded", from, to, &torques, &times, cells);
    }

    /// The speed of the crank against its angle, as the run begins: the switch follows the third step.
    fn switches_at_dead_centres(&mut self, from: Method, to: Method) {
        let rates = Axis { spacing: Spacing::Listed, ..self.axis(quantity::START_RATE, vec![0.0, 1.0, 10.0, 100.0]) };
        let angles = vec![-1e-3, -1e-9, 0.0, 1e-3, FRAC_PI_2, PI - 1e-9, PI, PI + 1e-3];
        let angles = Axis { spacing: Spacing::Listed, ..self.axis(quantity::START_ANGLE, angles) };
        let cell = |builder: &mut Self, rate, angle| {
            let start = vec![set("start.angle_rad", angle), set("start.rate_rad_per_s", rate)];
            builder.switch(from, to, start, 3.0 * STEP_S)
        };
        let cells = self.cells(&angles, &rates, cell);
        self.add_switches("switch-starting", from, to, &rates, &angles, cells);
    }

    /// Cells row by row.
    fn cells(&mut self, y: &Axis, x: &Axis, cell: impl Fn(&mut Self, f64, f64) -> Cell) -> Vec<Cell> {
        let places = y.values.iter().flat_map(|&y| x.values.iter().map(move |&x| (x, y)));
        places.map(|(x, y)| cell(self, x, y)).collect()
    }

    fn switch(&mut self, from: Method, to: Method, given: Vec<String>, at_s: f64) -> Cell {
        let reference = Some(self.reference(&from, &given));
        let overrides = [from.overrides(), given, vec![set("solver.step_s", STEP_S)]].concat();
        // Half a step early: times of steps are rounded.
        let switch = Some(Switch { at_s: at_s - 0.5 * STEP_S, changes: to.overrides() });
        Cell { overrides, steps: self.thinned(self.count(STEP_S)), reference, measure: Measure::Length, switch }
    }

    fn add_switches(&mut self, name: &str, from: Method, to: Method, x: &Axis, y: &Axis, cells: Vec<Cell>) {
        let name = format!("{name}-{}-to-{}", from.name(), to.name());
        let title = format!("{} and {}: {}, to {}", y.of.words, x.of.words, from.title(), to.title());
        self.plan.maps.push(Map { name, title, x: x.clone(), y: y.clone(), cells });
    }
}
