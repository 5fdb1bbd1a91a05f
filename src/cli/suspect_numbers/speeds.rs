//! Speeds of the crank that look like mistakes: in revolutions a minute, or reached after a time in ms.

use std::f64::consts::TAU;

use crate::scene::{Chain, Drive, End, Motion};
use crate::shown::figure;

/// Speed rarely changes for longer, s.
const LONGEST_RAMP_S: f64 = 100.0;
/// The crank pin of no engine is faster, m/s: those of racing engines reach 40 m/s.
const FASTEST_PIN_M_PER_S: f64 = 100.0;

/// A warning of a ramp that lasts long, as with its time in ms.
pub(super) fn long_ramp(drive: &Drive) -> Option<String> {
    let Drive::Motion(Motion::Ramp { over_s, .. }) = drive else { return None };
    let warning = || {
        let [given, meant] = [*over_s, 1e-3 * over_s].map(figure);
        format!("drive.ramp.over_s = {given} is long for a change of speed: times are in s, and {given} ms is {meant}")
    };
    (*over_s > LONGEST_RAMP_S).then(warning)
}

/// A warning of a speed at which the pin of a crank with a slider is faster than in any engine, as with revolutions a minute. Blades
/// and other open chains may be as fast.
pub(super) fn fast_crank(chain: &Chain, drive: &Drive) -> Option<String> {
    let ([crank, _], End::Slider(_)) = (&chain.links[..], &chain.end) else { return None };
    let start = ("start.rate_rad_per_s", chain.start.rate_rad_per_s);
    let given = match drive {
        Drive::Torque { .. } => vec![start],
        Drive::Motion(Motion::Speed(speed_rad_per_s)) => vec![("drive.speed_rad_per_s", *speed_rad_per_s)],
        Drive::Motion(Motion::Ramp { to_rad_per_s, .. }) => vec![("drive.ramp.to_rad_per_s", *to_rad_per_s), start],
        // It has angles, and no speed.
        Drive::Motion(Motion::Table(_)) => Vec::new(),
    };
    let pin_m_per_s = |rad_per_s: f64| rad_per_s.abs() * crank.length_m;
    let (key, rad_per_s) = given.into_iter().find(|(_, rad_per_s)| pin_m_per_s(*rad_per_s) > FASTEST_PIN_M_PER_S)?;
    let [given, pin, meant] = [rad_per_s, pin_m_per_s(rad_per_s), rad_per_s * TAU / 60.0].map(figure);
    Some(format!(
        "{key} = {given} moves the crank pin at {pin} m/s, faster than in any engine: speeds are in rad/s, and {given} revolutions \
         a minute are {meant}"
    ))
}
