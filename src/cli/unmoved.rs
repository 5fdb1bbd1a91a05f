//! Outputs that an input does not move in small motion: a torque on the crank does not move a slider in its dead centre.

use crate::small_motion::StateSpace;

/// A response below this part of the largest response of its kind, to any input, is rounding.
const ROUNDING: f64 = 1e-13;
/// Frequencies that are looked at.
const LOOKS: usize = 12;

/// The kind of a quantity: only outputs of one kind are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Displacement,
    Speed,
    Force,
}

/// The kind of an output by the unit in its name, and the factor that makes it one of a point at the end of a chain of this length.
fn kind(output: &str, length_m: f64) -> Option<(Kind, f64)> {
    let ends = |unit: &str| output.ends_with(unit);
    Some(match () {
        () if ends("_rad_per_s") => (Kind::Speed, length_m),
        () if ends("_m_per_s") => (Kind::Speed, 1.0),
        () if ends("_rad") => (Kind::Displacement, length_m),
        () if ends("_nm") => (Kind::Force, 1.0 / length_m),
        () if ends("_m") => (Kind::Displacement, 1.0),
        () if ends("_n") => (Kind::Force, 1.0),
        () => return None,
    })
}

/// Whether each of these outputs moves with the input, by more than rounding beside all outputs of its kind and all inputs. A torque
/// counts as the force at the end of the chain, of this length, that makes it. Without a chain, what is not 0 moves: far from a force,
/// masses move by tiny parts of what others do.
pub(super) fn moves(
    space: &StateSpace,
    (input, outputs): (usize, &[usize]),
    frequencies_hz: &[f64],
    length_m: Option<f64>,
) -> Vec<bool> {
    let kinds: Vec<Option<(Kind, f64)>> = space.outputs.iter().map(|output| kind(output, length_m?)).collect();
    let every = frequencies_hz.len().div_ceil(LOOKS).max(1);
    let mut moves = vec![false; outputs.len()];
    for hz in frequencies_hz.iter().step_by(every) {
        let of_input = |input: usize| {
            let arm_m = if space.inputs[input].ends_with("_nm") { length_m.unwrap_or(1.0) } else { 1.0 };
            let response = space.frequency_response(input, *hz).ok()?;
            let compared = |(size, kind): (f64, &Option<(Kind, f64)>)| kind.map_or(size, |(_, factor)| size * factor * arm_m);
            Some(response.iter().map(|entry| entry.norm()).zip(&kinds).map(compared).collect::<Vec<f64>>())
        };
        let all: Vec<Option<Vec<f64>>> = (0..space.inputs.len()).map(of_input).collect();
        let Some(Some(own)) = all.get(input) else { continue };
        for (output, moves) in outputs.iter().zip(&mut moves) {
            let is_like = |other: &usize| match (kinds[*output], kinds[*other]) {
                (Some((kind, _)), Some((other, _))) => kind == other,
                _ => false,
            };
            let like: Vec<usize> = (0..kinds.len()).filter(is_like).collect();
            let largest = all.iter().flatten().flat_map(|sizes| like.iter().map(|other| sizes[*other])).fold(0.0, f64::max);
            *moves |= own[*output] > ROUNDING * largest;
        }
    }
    moves
}

#[cfg(test)]
mod tests {
    use super::{Kind, kind};

    #[test]
    fn val_outputs_are_compared_by_their_units() {
        let kinds =
            ["crank_angle_rad", "slider_speed_m_per_s", "motion_torque_nm", "slider_m", "guide_n"].map(|name| kind(name, 2.0));
        let expected =
            [(Kind::Displacement, 2.0), (Kind::Speed, 1.0), (Kind::Force, 0.5), (Kind::Displacement, 1.0), (Kind::Force, 1.0)];
        assert_eq!(kinds, expected.map(Some));
    }
}
