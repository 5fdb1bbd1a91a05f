//! The duration over which a scene is studied.

use crate::scene::{Drive, Motion, Scene};

/// Default duration of a scene: two seconds, a second after its last pulse, two turns of a prescribed motion but at most 10 s of
/// them, or to the last row of its table.
pub fn usual_until_s(scene: &Scene) -> f64 {
    let turns_s = |rate: f64| if rate == 0.0 { 2.0 } else { (2.0 * std::f64::consts::TAU / rate.abs()).min(10.0) };
    match &scene.drive {
        Drive::Torque { pulses, .. } => pulses.iter().map(|pulse| pulse.start_s + pulse.duration_s + 1.0).fold(2.0, f64::max),
        Drive::Motion(Motion::Speed(rate)) => turns_s(*rate),
        Drive::Motion(Motion::Ramp { to_rad_per_s, over_s }) => over_s + turns_s(*to_rad_per_s),
        Drive::Motion(Motion::Table(rows)) => rows.last().map_or(2.0, |[time_s, _]| time_s.max(1e-6)),
    }
}
