//! The shape of a link in the frame of its chord.

use crate::mechanics::chain_line::{LinkShape, PlacePoint, ShapePoint};

/// A chord's frame.
pub(super) struct Frame {
    origin_m: [f64; 2],
    direction: [f64; 2],
    pub angle: f64,
    pub length_m: f64,
}

impl Frame {
    pub(super) fn new(pins: &[PlacePoint; 2], angle: f64) -> Self {
        let [first, last] = pins.map(|pin| pin.position_m);
        let along = [last[0] - first[0], last[1] - first[1]];
        let length_m = along[0].hypot(along[1]);
        Self { origin_m: first, direction: along.map(|x| x / length_m), angle, length_m }
    }

    fn local(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [cos, sin] = self.direction;
        [cos * x + sin * y, cos * y - sin * x]
    }

    pub(super) fn show(&self, point: &PlacePoint, shown: &mut ShapePoint) {
        let [x, y] = point.position_m;
        shown.position_m = self.local([x - self.origin_m[0], y - self.origin_m[1]]);
        shown.slope = self.local(point.slope);
    }
}

/// Rate at which the line from one pin to the other turns, rad/s.
pub(super) fn chord_rate([first, last]: &[PlacePoint; 2]) -> f64 {
    let [along, change] = [
        [0, 1].map(|axis| last.position_m[axis] - first.position_m[axis]),
        [0, 1].map(|axis| last.velocity_m_per_s[axis] - first.velocity_m_per_s[axis]),
    ];
    (along[0] * change[1] - along[1] * change[0]) / (along[0].powi(2) + along[1].powi(2))
}

/// Mean strain ε of the axis, from the length c of the chord. A tangent `(1 + ε) (cos φ, sin φ)` has `y' = (1 + ε) sin φ`, so that
/// `c/L − ∫ √(1 − y'²) dξ = ∫ (1 + ε) cos φ − √(1 − (1 + ε)² sin² φ) dξ = ∫ ε/cos φ dξ + O(ε²)`.
///
/// Unlike the length of the tangents it does not feel how well the model resolves foreshortening along the link.
pub(super) fn stretch(shape: &LinkShape, length_m: f64) -> f64 {
    if shape.samples.is_empty() {
        return 0.0;
    }
    let unstretched: f64 = shape.samples.iter().map(|s| s.weight * (1.0 - s.slope[1].powi(2)).max(0.0).sqrt()).sum();
    shape.chord_m / length_m - unstretched
}
