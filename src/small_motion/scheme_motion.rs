//! The multipliers that a scheme gives a turning mechanism, and whether the scheme adds growth.

use nalgebra::Complex;

use super::floquet::{Floquet, Multiplier};
use super::orbit::Cycle;
use super::periodic_modes::{ALIKE, PeriodicModes, err_as_the_shift};

/// Growth in a turn that a scheme adds, beyond which it is called unstable.
const ADDED: f64 = 1e-2;

/// A scheme's periodic motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SchemeMotion {
    /// Its steps.
    pub cycle: Cycle,
    /// The multiplier of largest magnitude.
    pub largest: Multiplier,
    /// The largest magnitude among the multipliers of vibrations: all but the crank's own motion.
    pub vibration: f64,
    /// The largest multiplier of a free crank's own motion. One of these is exactly 1 in theory: the error is its distance from 1. The
    /// value is 0 if the crank is held.
    pub own: Multiplier,
    /// How exactly it repeats, as of an orbit.
    pub residual: f64,
}

impl SchemeMotion {
    /// Sorts a scheme's multipliers into those of the crank's own motion, which are given, and those of vibrations.
    pub(super) fn of(found: &Floquet, own: Vec<Complex<f64>>) -> Self {
        let none = Multiplier { value: Complex::from(0.0), error: 0.0 };
        let larger = |one: Multiplier, other: Multiplier| if other.value.norm() > one.value.norm() { other } else { one };
        let mut own: Vec<Multiplier> = own.into_iter().map(|value| Multiplier { value, error: 0.0 }).collect();
        err_as_the_shift(&mut own);
        let is_own = |value: Complex<f64>| own.iter().any(|own| own.value == value || own.value.conj() == value);
        let vibrations = found.multipliers.iter().filter(|multiplier| !is_own(multiplier.value));
        SchemeMotion {
            cycle: found.orbit.cycle,
            largest: found.multipliers.first().copied().unwrap_or(none),
            vibration: vibrations.map(|multiplier| multiplier.value.norm()).fold(0.0, f64::max),
            own: own.into_iter().fold(none, larger),
            residual: found.orbit.residual,
        }
    }
}

impl PeriodicModes {
    /// Whether the scheme lets a mode grow by a hundredth a turn more than any mode grows by itself. Smaller growth proves nothing: a crank that
    /// turns freely has a double multiplier of 1, which any error of the scheme splits in two. Nor does growth of the crank's own motion within
    /// its error, as where steps cut the corners of a resistance table: in another turn they fall elsewhere. Without damping, all growth of that
    /// motion is.
    pub fn scheme_adds_growth(&self) -> bool {
        let growing = |scheme: &SchemeMotion| {
            let own = scheme.own;
            scheme.vibration > self.most() || own.value.norm() > self.most() + own.error
        };
        self.is_known() && self.motion_by_scheme().is_some_and(growing)
    }

    /// Whether the scheme lets the crank's own motion alone grow by that much, and within its error, so that it is not judged.
    pub fn scheme_is_vague(&self) -> bool {
        let grows = self.motion_by_scheme().is_some_and(|scheme| scheme.own.value.norm() > self.most());
        self.is_known() && grows && !self.scheme_adds_growth()
    }

    fn motion_by_scheme(&self) -> Option<&SchemeMotion> {
        self.scheme.as_ref()?.as_ref().ok()
    }

    /// The magnitude above which a multiplier of the scheme is growth that it adds.
    fn most(&self) -> f64 {
        let surely = |Multiplier { value, error }: Multiplier| value.norm() - error;
        let resolved = self.modes.iter().filter(|mode| mode.is_resolved()).map(|mode| surely(mode.multiplier));
        (1.0 + ADDED) * resolved.fold(1.0, f64::max)
    }
}

/// The multipliers of a scheme that are a free crank's own motion, given each, one of a conjugate pair, with how much its shape is like the
/// velocities: the one nearest to 1 of those that are, and its other half, which is real as well and the most alike.
pub(super) fn own_motion(likenesses: &[(Complex<f64>, f64)]) -> Vec<Complex<f64>> {
    let from_one = |value: Complex<f64>| (value - 1.0).norm();
    let alike = || likenesses.iter().filter(|(_, likeness)| *likeness >= ALIKE);
    let Some((shift, _)) = alike().min_by(|one, other| from_one(one.0).total_cmp(&from_one(other.0))) else { return Vec::new() };
    let is_other_half = |value: Complex<f64>| shift.im == 0.0 && value.im == 0.0 && value.re > 0.0 && value != *shift;
    let others = alike().filter(|(value, _)| is_other_half(*value));
    let other = others.max_by(|one, other| one.1.total_cmp(&other.1)).map(|(value, _)| *value);
    std::iter::once(*shift).chain(other).collect()
}
