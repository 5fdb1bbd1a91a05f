//! Loads on the chain's end and pivot.

use crate::mechanics::resistance::resistance;
use crate::scene::{Base, End, Resistance};

/// The mass and the loads at the last pin.
#[derive(Debug, Clone)]
pub(super) struct Tip {
    pub(super) mass_kg: f64,
    /// Whether it slides on `y = 0`.
    pub(super) slides: bool,
    pub(super) friction_n_s_per_m: f64,
    resistance: Resistance,
}

impl Tip {
    pub(super) fn new(end: &End) -> Self {
        match end {
            End::Free { tip_mass_kg } => {
                Self { mass_kg: *tip_mass_kg, slides: false, friction_n_s_per_m: 0.0, resistance: Resistance::Constant(0.0) }
            }
            End::Slider(slider) => Self {
                mass_kg: slider.mass_kg,
                slides: true,
                friction_n_s_per_m: slider.friction_n_s_per_m,
                resistance: slider.resistance.clone(),
            },
        }
    }

    /// Whether resistance or friction acts.
    pub(super) fn is_loaded(&self) -> bool {
        self.friction_n_s_per_m != 0.0 || self.resistance != Resistance::Constant(0.0)
    }

    /// Resistance along −x and its derivative with respect to the crank's chord angle, N and N/rad.
    pub(super) fn resistance(&self, angle_rad: f64) -> [f64; 2] {
        resistance(&self.resistance, angle_rad)
    }
}

/// Torque of the base's spring and damper against an angle and a rate, N·m.
pub(super) fn base_torque_nm(base: Base, angle_rad: f64, rate_rad_per_s: f64) -> f64 {
    base.torsion_spring_nm_per_rad * angle_rad + base.damper_nm_s_per_rad * rate_rad_per_s
}
