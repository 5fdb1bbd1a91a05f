//! Slow motion whose stiffness is rounding beside that of single elements.

use nalgebra::{Complex, DVector};

use super::linearised::Linearised;

/// What holds a motion is rounding if it is below this many times what rounding may be.
const ROUNDED: f64 = 4.0;

/// Whether what holds a motion is rounding. The decay of free motion under a damper, `λ = −φᴴ D φ`, is none.
pub(super) fn is_rounding(system: &Linearised, value: Complex<f64>, vector: &DVector<Complex<f64>>) -> bool {
    value.norm() < 2.0 * (value + damping(system, vector)).norm() && rounding(system, value, vector) > 1.0 / ROUNDED
}

/// `φᴴ D φ`.
pub(super) fn damping(system: &Linearised, vector: &DVector<Complex<f64>>) -> Complex<f64> {
    system.damping.iter().map(|(i, j, entry)| vector[i].conj() * vector[j] * entry).sum()
}

/// The part that rounding may have in the stiffness that holds a motion, `φᴴ K φ = −λ (λ + φᴴ D φ)`.
///
/// Beside the terms of that product, tension is rounded: where strain is by as much as one unit is, a stretched element has a part of its
/// stiffness across. So each coordinate counts with the largest stiffness of itself and the two beside it, too.
pub(super) fn rounding(system: &Linearised, value: Complex<f64>, vector: &DVector<Complex<f64>>) -> f64 {
    let size: Vec<f64> = vector.iter().map(|x| x.norm()).collect();
    let (mut terms, mut stiffness) = (0.0, vec![0.0; size.len()]);
    for (i, j, entry) in system.stiffness.iter() {
        terms += size[i] * size[j] * entry.abs();
        if i == j {
            stiffness[i] = entry.abs();
        }
    }
    for (i, size) in size.iter().enumerate() {
        let beside = &stiffness[i.saturating_sub(1)..(i + 2).min(stiffness.len())];
        terms += size.powi(2) * beside.iter().copied().fold(0.0, f64::max);
    }
    f64::EPSILON * terms / (value * (value + damping(system, vector))).norm()
}
