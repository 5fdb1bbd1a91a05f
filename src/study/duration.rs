//! The duration over which a scene is studied.

use std::f64::consts::TAU;

use crate::scene::{Drive, Motion, Scene};

/// Default duration of a scene: two seconds, a second after its last pulse, two turns of a prescribed motion after its ramp, but at
/// most 10 s of them, or to the last row of its table.
pub fn usual_until_s(scene: &Scene) -> f64 {
    match &scene.drive {
        Drive::Torque { pulses, .. } => pulses.iter().map(|pulse| pulse.start_s + pulse.duration_s + 1.0).fold(2.0, f64::max),
        Drive::Motion(Motion::Table(rows)) => rows.last().map_or(2.0, |[time_s, _]| time_s.max(1e-6)),
        Drive::Motion(Motion::Speed(rate)) => usual_turns_s(*rate),
        Drive::Motion(Motion::Ramp { to_rad_per_s, over_s }) => over_s + usual_turns_s(*to_rad_per_s),
    }
}

/// Simulated time, s, at which a drive has made two turns at its speed, or at that which its ramp reaches; `None` without one.
pub fn two_turns_s(scene: &Scene) -> Option<f64> {
    let (begin_s, rad_per_s) = match scene.drive {
        Drive::Motion(Motion::Speed(rad_per_s)) => (0.0, rad_per_s),
        Drive::Motion(Motion::Ramp { to_rad_per_s, over_s }) => (over_s, to_rad_per_s),
        Drive::Motion(Motion::Table(_)) | Drive::Torque { .. } => return None,
    };
    (rad_per_s != 0.0).then(|| begin_s + turns_s(rad_per_s))
}

fn usual_turns_s(rad_per_s: f64) -> f64 {
    if rad_per_s == 0.0 { 2.0 } else { turns_s(rad_per_s).min(10.0) }
}

/// Two turns, s.
fn turns_s(rad_per_s: f64) -> f64 {
    2.0 * TAU / rad_per_s.abs()
}
