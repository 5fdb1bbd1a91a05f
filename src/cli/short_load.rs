//! Steps in which the crank passes the shortest load of a resistance table: longer ones see too little of it, or nothing.

use super::aligned_table::figure;
use super::suggested_step::speed_rad_per_s;
use crate::mechanics::narrowest_load_rad;
use crate::scene::{Drive, End, Motion, Scene};

/// With fewer steps, the peak of a triangle may come out an eighth too small.
const FEW_STEPS: f64 = 4.0;
/// With so many, a twentieth.
const ENOUGH_STEPS: f64 = 10.0;

/// The shortest load of a scene's resistance table, and how fast the crank passes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShortLoad {
    width_rad: f64,
    rad_per_s: f64,
}

impl ShortLoad {
    /// Of a scene whose crank turns as fast as this; `None` without a table, or if the crank stands still.
    pub(super) fn at(scene: &Scene, rad_per_s: f64) -> Option<Self> {
        let End::Slider(slider) = &scene.chain()?.end else { return None };
        let width_rad = narrowest_load_rad(&slider.resistance)?;
        (rad_per_s > 0.0).then_some(ShortLoad { width_rad, rad_per_s })
    }

    /// Of a scene at the largest speed that it prescribes or starts with.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let rate = |rows: &[[f64; 2]]| ((rows[1][1] - rows[0][1]) / (rows[1][0] - rows[0][0])).abs();
        let rad_per_s = match &scene.drive {
            Drive::Motion(Motion::Table(rows)) => rows.windows(2).map(rate).fold(0.0, f64::max),
            _ => speed_rad_per_s(scene),
        };
        Self::at(scene, rad_per_s)
    }

    /// Time in which it is passed, s.
    fn passed_s(self) -> f64 {
        self.width_rad / self.rad_per_s
    }

    /// The longest step that shows it, s, and the reason.
    pub(super) fn longest_step_s(self) -> (f64, String) {
        let passed_s = self.passed_s();
        let reason =
            format!("at least {ENOUGH_STEPS} steps in the shortest load of slider.resistance_table ({} s)", figure(passed_s));
        (passed_s / ENOUGH_STEPS, reason)
    }

    /// The warning of a step, s, that is too long for it.
    pub(super) fn warning(self, step_s: f64) -> Option<String> {
        let steps = self.passed_s() / step_s;
        (steps < FEW_STEPS).then(|| {
            format!(
                "a step of {} s passes the shortest load of slider.resistance_table, {} rad wide at half its height, in {steps:.1} steps \
                 at {} rad/s: peaks of forces and torques come out too small, or are missed; {} s shows them",
                figure(step_s),
                figure(self.width_rad),
                figure(self.rad_per_s),
                figure(self.longest_step_s().0)
            )
        })
    }
}
