//! Loads of a resistance table that a torque drives the crank through, and the fewest steps in which it passed one.

use std::f64::consts::TAU;

use super::Simulation;
use crate::mechanics::{FEW_STEPS, loads_rad, passes};
use crate::scene::{Drive, End, Scene};

impl Simulation {
    /// The load of a resistance table that a crank under a torque passed in the fewest steps since the simulation was made; `None` if in none
    /// of fewer than four, or if the model does not tell where the crank is, as the incremental one.
    pub fn passed_load(&self) -> Option<PassedLoad> {
        self.passed.fewest
    }

    /// Looks at what the crank passed on its way to where it is.
    pub(super) fn follow_crank(&mut self) {
        if !self.passed.loads_rad.is_empty()
            && let Some(crank) = self.engine.crank()
        {
            self.passed.step_to(crank, self.grid.step_s);
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
    /// Angle, rad, and rate, rad/s, of the crank at the end of the last step.
    at: Option<[f64; 2]>,
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
        PassedLoads { loads_rad, at: None, fewest: None }
    }

    /// Begins anew at some other place; what was seen stays.
    pub(super) fn restart(&mut self) {
        self.at = None;
    }

    /// Goes on with another scene.
    pub(super) fn go_on_from(&mut self, other: &Self) {
        (self.at, self.fewest) = (None, other.fewest);
    }

    /// Follows the crank to its angle, rad, and rate, rad/s, at the end of a step of this size, s. Angles may be known up to whole turns: of these,
    /// the rates tell.
    fn step_to(&mut self, [angle_rad, rate_rad_per_s]: [f64; 2], step_s: f64) {
        let Some([from_rad, from_rad_per_s]) = self.at.replace([angle_rad, rate_rad_per_s]) else { return };
        let by_rates_rad = 0.5 * (from_rad_per_s + rate_rad_per_s) * step_s;
        let change_rad = angle_rad - from_rad + TAU * ((by_rates_rad - (angle_rad - from_rad)) / TAU).round();
        let turned_rad = change_rad.abs();
        let steps = |load: &[f64; 2]| width_rad(load) / turned_rad;
        let few = self.loads_rad.iter().take_while(|load| steps(load) < FEW_STEPS);
        let Some(load) = few.into_iter().find(|load| passes([from_rad, from_rad + change_rad], **load)) else { return };
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
    use super::*;

    /// Steps of a millisecond.
    const STEP_S: f64 = 1e-3;

    /// Loads 0.01 and 0.1 rad wide, at 3 and 1 rad.
    fn loads() -> PassedLoads {
        PassedLoads { loads_rad: vec![[3.0, 3.01], [1.0, 1.1]], ..PassedLoads::default() }
    }

    /// The way of a crank from angle to angle, at the mean speed of each step; `shown` is the angle that its model tells.
    fn follow(loads: &mut PassedLoads, angles_rad: &[f64], shown: impl Fn(f64) -> f64) -> Vec<Option<f64>> {
        let rate = |place: usize| {
            let [before, after] = [place.saturating_sub(1), (place + 1).min(angles_rad.len() - 1)];
            (angles_rad[after] - angles_rad[before]) / ((after - before) as f64 * STEP_S)
        };
        let mut followed = |(place, angle_rad): (usize, &f64)| {
            loads.step_to([shown(*angle_rad), rate(place)], STEP_S);
            loads.fewest.map(|fewest| fewest.steps)
        };
        angles_rad.iter().enumerate().map(&mut followed).collect()
    }

    fn are_near(found: &[Option<f64>], expected: &[Option<f64>]) -> bool {
        let is_near = |(found, expected): (&Option<f64>, &Option<f64>)| match (found, expected) {
            (Some(found), Some(expected)) => (found / expected - 1.0).abs() < 1e-9,
            (found, expected) => found == expected,
        };
        found.len() == expected.len() && found.iter().zip(expected).all(is_near)
    }

    /// From where it begins on; five steps in the wide load, then one; slower behind it; the narrow one backwards, in a turn before.
    #[test]
    fn val_a_load_is_passed_in_its_width_over_the_angle_of_a_step() {
        let wide = Some(0.1 / 0.13);
        let narrow = Some(0.01 / 0.4);
        let way = [0.9, 0.92, 1.05, 1.09, 0.7, 0.3, -0.1];
        let back = [-2.9, -3.2, -3.6];
        let expected = [None, None, wide, wide, Some(0.1 / 0.39), Some(0.1 / 0.39), Some(0.1 / 0.39)];
        assert!(are_near(&follow(&mut loads(), &way, |angle_rad| angle_rad), &expected));
        assert!(are_near(&follow(&mut loads(), &back, |angle_rad| angle_rad), &[None, None, narrow]));
    }

    /// Some models tell angles from -π to π: a step over π counted as a turn back.
    #[test]
    fn regress_a_step_over_half_a_turn_is_no_turn() {
        let way: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let within_a_turn = |angle_rad: f64| angle_rad - TAU * (angle_rad / TAU).round();
        for shown in [&within_a_turn as &dyn Fn(f64) -> f64, &|angle_rad| angle_rad] {
            let mut loads = loads();
            let found = follow(&mut loads, &way, shown);
            assert!(found.iter().flatten().all(|steps| (steps - 1.0).abs() < 1e-9), "{found:?}");
            assert!(loads.fewest.is_some_and(|fewest| (fewest.rad_per_s - 10.0).abs() < 1e-9));
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
            (3.02 + TAU, 2.99 + 2.0 * TAU, false),
            (1.2, 2.9, false),
        ] {
            let mut loads = PassedLoads { loads_rad: vec![[3.0, 3.01]], ..PassedLoads::default() };
            follow(&mut loads, &[from_rad, to_rad], |angle_rad| angle_rad);
            assert_eq!(loads.fewest.is_some(), is_passed, "{from_rad} to {to_rad}");
            // A jump to another place is no step.
            loads.restart();
            let before = loads.fewest;
            loads.step_to([3.005, 0.0], STEP_S);
            assert_eq!(loads.fewest, before);
        }
    }
}
