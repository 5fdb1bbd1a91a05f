//! Loads that depend on the state: what stands at the chain's end and between ground and the first link.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::strain::left;
use crate::scene::{End, Resistance};

/// Slider or tip.
#[derive(Debug, Clone)]
pub(super) struct EndLoad {
    /// Point mass there.
    pub(super) mass_kg: f64,
    /// Viscous friction along x.
    pub(super) friction_n_s_per_m: f64,
    /// Of a slider.
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

    /// Whether resistance depends on the crank's angle.
    pub(super) fn tabulated(&self) -> bool {
        matches!(self.resistance, Some(Resistance::Table(_)))
    }

    /// Resistance along −x, and its derivative by the crank pin's position.
    pub(super) fn resistance(&self, pin: &Vector2<f64>) -> (f64, Vector2<f64>) {
        match &self.resistance {
            None => (0.0, Vector2::zeros()),
            Some(Resistance::Constant(force_n)) => (*force_n, Vector2::zeros()),
            Some(Resistance::Table(table)) => {
                let (force_n, slope) = periodic(table, pin.y.atan2(pin.x).rem_euclid(TAU));
                (force_n, left(pin) * (slope / pin.norm_squared()))
            }
        }
    }
}

/// Value and slope at `angle` in [0, 2π) of a piecewise linear, periodic table.
fn periodic(table: &[[f64; 2]], angle: f64) -> (f64, f64) {
    let (Some(first), Some(last)) = (table.first(), table.last()) else { return (0.0, 0.0) };
    let after = table.partition_point(|point| point[0] <= angle);
    let from = if after == 0 { [last[0] - TAU, last[1]] } else { table[after - 1] };
    let to = table.get(after).copied().unwrap_or([first[0] + TAU, first[1]]);
    let slope = (to[1] - from[1]) / (to[0] - from[0]);
    (from[1] + slope * (angle - from[0]), slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_table_is_periodic_and_continuous() {
        let table = [[1.0, 10.0], [3.0, 20.0]];
        assert_eq!(periodic(&table, 2.0), (15.0, 5.0));
        let before = periodic(&table, TAU - 1e-9).0;
        let after = periodic(&table, 0.0).0;
        assert!((before - after).abs() < 1e-7 && after > 10.0 && after < 20.0);
        assert_eq!(periodic(&[[2.0, 7.0]], 5.0), (7.0, 0.0));
    }
}
