//! Phases of a frequency response, without jumps of whole turns.

/// A change this close to half a turn, degrees, may go either way.
const EITHER_WAY_DEG: f64 = 5.0;

/// Adds whole turns until no phase is over half a turn from the one before. Where a change is about half a turn, as it is without damping,
/// it goes down at a resonance and up where the magnitude is least, as with a little damping.
pub(super) fn unwrap(phases_deg: &mut [f64], magnitudes: &[f64]) {
    let known: Vec<usize> = (0..phases_deg.len()).filter(|&k| phases_deg[k].is_finite()).collect();
    for place in 1..known.len() {
        let [before, here] = [known[place - 1], known[place]];
        let change = phases_deg[here] - phases_deg[before];
        let mut turned = change - 360.0 * (change / 360.0).round();
        if turned.abs() > 180.0 - EITHER_WAY_DEG {
            let outside = [known.get(place.wrapping_sub(2)), known.get(place + 1)].into_iter().flatten();
            let outside = outside.map(|&k| magnitudes[k]).fold(0.0, f64::max);
            let is_resonance = magnitudes[before].max(magnitudes[here]) > outside;
            let wanted = if is_resonance { -1.0 } else { 1.0 };
            if turned * wanted < 0.0 {
                turned += 360.0 * wanted;
            }
        }
        phases_deg[here] = phases_deg[before] + turned;
    }
}

/// The same phase from −179° to 180°, in whole degrees.
pub(super) fn within_half_a_turn(phase_deg: f64) -> f64 {
    let within = (phase_deg - 360.0 * (phase_deg / 360.0).round()).round();
    // Adding 0 makes −0 a 0.
    if within <= -180.0 { 180.0 } else { within + 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `1/(1 − ω²)`, `(4 − ω²)/(1 − ω²)` and the first with a little damping, whose imaginary parts have the sign of rounding.
    #[test]
    fn val_phases_fall_at_a_resonance_and_rise_where_there_is_no_response() {
        let frequencies: Vec<f64> = (1..400).map(|k| 0.01 * f64::from(k) + 0.003).collect();
        for rounding in [1e-9_f64, -1e-9] {
            let response = |value: &dyn Fn(f64) -> f64| {
                let values: Vec<f64> = frequencies.iter().map(|omega| value(*omega)).collect();
                let mut phases: Vec<f64> = values.iter().map(|value| rounding.atan2(*value).to_degrees()).collect();
                let magnitudes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
                unwrap(&mut phases, &magnitudes);
                [50, 150, 350].map(|at: usize| (phases[at] - phases[0]).round())
            };
            assert_eq!(response(&|omega| 1.0 / (1.0 - omega * omega)), [0.0, -180.0, -180.0]);
            assert_eq!(response(&|omega| (4.0 - omega * omega) / (1.0 - omega * omega)), [0.0, -180.0, 0.0]);
        }
        let mut damped: Vec<f64> =
            frequencies.iter().map(|omega| (-0.1 * omega).atan2(1.0 - omega * omega).to_degrees()).collect();
        let as_they_are = damped.clone();
        unwrap(&mut damped, &vec![1.0; frequencies.len()]);
        assert_eq!(damped, as_they_are);
    }

    #[test]
    fn val_a_phase_has_one_value_however_often_it_has_turned() {
        assert_eq!(
            [631.0, 271.0, -89.2, -720.0, -0.2, 180.0, -180.0].map(within_half_a_turn),
            [-89.0, -89.0, -89.0, 0.0, 0.0, 180.0, 180.0]
        );
    }
}
