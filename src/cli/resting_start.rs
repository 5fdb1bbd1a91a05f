//! The position in which a scene starts whose links are bent by static loads.

use std::fmt;

use serde::Serialize;

use super::aligned_table::figure;
use super::formatting::degrees;
use crate::mechanics::Observation;
use crate::scene::Scene;
use crate::study::trade::STRAIGHT;

/// The first link in that position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct RestingStart {
    link: &'static str,
    /// Angle of its tangent at the pivot, rad.
    angle_rad: f64,
    /// Distance of its end from that tangent, m, positive to the left; 0 of a straight link.
    bent_m: f64,
}

impl RestingStart {
    /// The position in an observation of the start; `None` for a scene that starts otherwise.
    pub(super) fn of(scene: &Scene, seen: &Observation) -> Option<Self> {
        let chain = scene.chain().filter(|chain| chain.start.static_equilibrium)?;
        let nodes = &seen.links.first()?.nodes;
        let (pivot, end) = (nodes.first()?, nodes.last()?);
        let angle_rad = pivot.rotation_rad?;
        let [x_m, y_m] = [0, 1].map(|axis| end.position_m[axis] - pivot.position_m[axis]);
        let offset_m = angle_rad.cos() * y_m - angle_rad.sin() * x_m;
        let bent_m = if offset_m.abs() < STRAIGHT * x_m.hypot(y_m) { 0.0 } else { offset_m };
        Some(RestingStart { link: chain.links.first()?.name.as_str(), angle_rad, bent_m })
    }
}

impl fmt::Display for RestingStart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RestingStart { link, angle_rad, bent_m } = *self;
        write!(f, "{link} at {}°", figure(degrees(angle_rad)))?;
        if bent_m == 0.0 {
            return Ok(());
        }
        let side = if bent_m > 0.0 { "left" } else { "right" };
        write!(f, ", bent by {} m to the {side} at its end", figure(bent_m.abs()))
    }
}
