//! Loads of a resistance table that a torque drives the crank through, and the fewest steps in which it passed one.

use super::Simulation;
use crate::mechanics::{FEW_STEPS, loads_rad, passes};
use crate::scene::{Drive, End, Scene};

impl Simulation {
    /// The load of a resistance table that a crank under a torque passed in the fewest steps since the simulation was made; `None` if in none
    /// of fewer than four.
    pub fn passed_load(&self) -> Option<PassedLoad> {
        self.passed.fewest
    }

    /// Looks at what the crank passed on its way to where it is.
    pub(super) fn follow_crank(&mut self) {
        if !self.passed.loads_rad.is_empty()
            && let Some([[angle_rad, _], _]) = self.engine.rotations()
        {
            self.passed.step_to(angle_rad, self.grid.step_s);
        }
    }
}

/// A load that the crank passed in few steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassedLoad {
    /// Its width at half its height, rad.
    pub width_rad: f64,
    /// Steps in it.
    pub steps: f64,
    /// Mean speed in the longest of them, rad/s.
    pub rad_per_s: f64,
}

/// The loads of a scene whose crank a torque turns: how fast it passes them shows in the run. A prescribed motion is known before.
#[derive(Debug, Clone, Default)]
pub(super) struct PassedLoads {
    /// From angle to angle, the shortest first.
    loads_rad: Vec<[f64; 2]>,
    /// Where the crank stood at the end of the last step.
    at_rad: Option<f64>,
    fewest: Option<PassedLoad>,
}

impl PassedLoads {
    pub(super) fn new(scene: &Scene) -> Self {
        let slider = scene.chain().map(|chain| &chain.end).filter(|_| matches!(scene.drive, Drive::Torque { .. }));
        let mut loads_rad = match slider {
            Some(End::Slider(slider)) => loads_rad(&slider.resistance),
            _ => Vec::new(),
        };
        loads_rad.sort_by(|one, other| width_rad(one).total_cmp(&width_rad(other)));
        PassedLoads { loads_rad, at_rad: None, fewest: None }
    }

    /// Begins anew at some other place; what was seen stays.
    pub(super) fn restart(&mut self) {
        self.at_rad = None;
    }

    /// Goes on with another scene.
    pub(super) fn go_on_from(&mut self, other: &Self) {
        (self.at_rad, self.fewest) = (None, other.fewest);
    }

    /// Follows the crank to the angle at the end of a step, rad, of this size, s.
    fn step_to(&mut self, angle_rad: f64, step_s: f64) {
        let Some(from_rad) = self.at_rad.replace(angle_rad) else { return };
        let turned_rad = (angle_rad - from_rad).abs();
        let steps = |load: &[f64; 2]| width_rad(load) / turned_rad;
        let few = self.loads_rad.iter().take_while(|load| steps(load) < FEW_STEPS);
        let Some(load) = few.into_iter().find(|load| passes([from_rad, angle_rad], **load)) else { return };
        let passed = PassedLoad { width_rad: width_rad(load), steps: steps(load), rad_per_s: turned_rad / step_s };
        if self.fewest.is_none_or(|fewest| passed.steps < fewest.steps) {
            self.fewest = Some(passed);
        }
    }
}

fn width_rad([from_rad, to_rad]: &[f64; 2]) -> f64 {
    to_rad - from_rad
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// Loads 0.01 and 0.1 rad wide, at 3 and 1 rad.
    fn loads() -> PassedLoads {
        PassedLoads { loads_rad: vec![[3.0, 3.01], [1.0, 1.1]], ..PassedLoads::default() }
    }

    #[test]
    fn val_a_load_is_passed_in_its_width_over_the_angle_of_a_step() {
        let mut loads = loads();
        for (angle_rad, steps) in [
            // Where it begins, nothing is known.
            (0.9, None),
            // Five steps in the wide load.
            (0.92, None),
            (1.05, Some(0.1 / 0.13)),
            // Slower behind it.
            (1.09, Some(0.1 / 0.13)),
            // The narrow one, backwards and a turn before.
            (3.02, Some(0.1 / 1.93)),
            (3.02 - TAU, Some(0.01 / TAU)),
        ] {
            loads.step_to(angle_rad, 1e-3);
            let found = loads.fewest.map(|fewest| fewest.steps);
            assert!(
                found.zip(steps).map_or(found == steps, |(found, steps)| (found / steps - 1.0).abs() < 1e-12),
                "{angle_rad}: {found:?}"
            );
        }
    }

    /// A fast step beside a load, however near, is none through it; one into it is.
    #[test]
    fn prop_only_loads_that_are_passed_count() {
        for (from_rad, to_rad, is_passed) in [
            (3.011, 4.0, false),
            (2.0, 2.999, false),
            (3.009, 2.5, true),
            (3.0 - TAU - 0.001, 3.0 - TAU + 0.5, true),
            (3.011 + TAU, 2.9 + 2.0 * TAU, true),
            (1.2, 2.9, false),
        ] {
            let mut loads = loads();
            loads.loads_rad.truncate(if to_rad > TAU { 2 } else { 1 });
            loads.step_to(from_rad, 1e-3);
            loads.step_to(to_rad, 1e-3);
            assert_eq!(loads.fewest.is_some(), is_passed, "{from_rad} to {to_rad}");
            // A jump to another place is no step.
            loads.restart();
            let before = loads.fewest;
            loads.step_to(3.005, 1e-3);
            assert_eq!(loads.fewest, before);
        }
    }
}
