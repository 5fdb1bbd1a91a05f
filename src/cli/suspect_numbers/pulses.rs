//! Warnings of a scene's torque pulses.

use crate::scene::{Drive, Scene};
use crate::shown::figure;

/// Torque that acts for longer is rarely called a pulse, s.
const LONGEST_PULSE_S: f64 = 30.0;

/// Warnings of pulses that last long, as with a duration in ms.
pub(super) fn long_pulses(drive: &Drive) -> impl Iterator<Item = String> {
    let pulses = if let Drive::Torque { pulses, .. } = drive { &pulses[..] } else { &[] };
    let long = pulses.iter().enumerate().filter(|(_, pulse)| pulse.duration_s > LONGEST_PULSE_S);
    long.map(|(index, pulse)| {
        let [given, meant] = [pulse.duration_s, 1e-3 * pulse.duration_s].map(figure);
        format!("pulse.{index}.duration_s = {given} is long for a pulse: times are in s, and {given} ms is {meant}")
    })
}

/// Warnings of pulses that a client could not send.
pub(super) fn strong_pulses(scene: &Scene) -> impl Iterator<Item = String> {
    let pulses = if let Drive::Torque { pulses, .. } = &scene.drive { &pulses[..] } else { &[] };
    let limit_nm = scene.commands.torque_limit_nm;
    let strong = pulses.iter().enumerate().filter(move |(_, pulse)| pulse.torque_nm.abs() > limit_nm);
    strong.map(move |(index, pulse)| {
        let [given, limit] = [pulse.torque_nm, limit_nm].map(figure);
        format!("pulse.{index}.torque_nm = {given} is over commands.torque_limit_nm = {limit}, which pulses from the bus keep")
    })
}
