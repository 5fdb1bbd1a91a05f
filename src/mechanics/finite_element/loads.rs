//! Loads that depend on the state: what stands at the chain's end and between ground and the first link.

use nalgebra::Vector2;

use super::strain::left;
use crate::mechanics::resistance::resistance;
use crate::scene::{End, Resistance};

/// Slider or tip.
#[derive(Debug, Clone)]
pub(super) struct EndLoad {
    /// Point mass there.
    pub(super) mass_kg: f64,
    /// Viscous friction along x.
    pub(super) friction_n_s_per_m: f64,
    /// Resistance against a slider.
    pub(super) resistance: Option<Resistance>,
}

impl EndLoad {
    /// From the scene.
    pub(super) fn new(end: &End) -> Self {
        match end {
            End::Free { tip_mass_kg } => Self { mass_kg: *tip_mass_kg, friction_n_s_per_m: 0.0, resistance: None },
            End::Slider(slider) => Self {
                mass_kg: slider.mass_kg,
                friction_n_s_per_m: slider.friction_n_s_per_m,
                resistance: Some(slider.resistance.clone()),
            },
        }
    }

    /// Whether resistance or friction acts.
    pub(super) fn is_loaded(&self) -> bool {
        let free = matches!(self.resistance, None | Some(Resistance::Constant(0.0)));
        self.friction_n_s_per_m != 0.0 || !free
    }

    /// Whether resistance depends on the crank's angle.
    pub(super) fn tabulated(&self) -> bool {
        matches!(self.resistance, Some(Resistance::Table(_)))
    }

    /// Resistance along −x, and its derivative by the crank pin's position.
    pub(super) fn resistance(&self, pin: &Vector2<f64>) -> (f64, Vector2<f64>) {
        match &self.resistance {
            None => (0.0, Vector2::zeros()),
            Some(Resistance::Constant(force_n)) => (*force_n, Vector2::zeros()),
            Some(table) => {
                let [force_n, slope] = resistance(table, pin.y.atan2(pin.x));
                (force_n, left(pin) * (slope / pin.norm_squared()))
            }
        }
    }
}
