//! Mass, damping and stiffness of small motion about a state.

use super::band::Band;
use super::point::Point;
use crate::mechanics::{Input, Mechanism, Weights};

/// A torque beside which the residual of a chain in equilibrium is rounding, N·m.
const LARGE_NM: f64 = 1_048_576.0;

/// Small motion `δq` about a state: `M δq̈ + D δq̇ + K δq = b δτ`, the exact derivatives of the model's residual there.
///
/// In a steady rotation these matrices turn, unless the coordinates turn along: with `δq = T(t) y`, `T = exp(V t)` and V the derivative
/// of the rotation's velocities by the coordinates,
///
/// ```text
/// M ÿ + (D + 2 M V) ẏ + (K + D V + M V²) y = b δτ
/// ```
///
/// which is what is given then. V is nil in coordinates that turn along by themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// M.
    pub mass: Band,
    /// D, gyroscopic terms among it.
    pub damping: Band,
    /// K, the stiffness of the present forces and accelerations among it.
    pub stiffness: Band,
    /// b, the row of the tangent at the pivot, on which torque acts; nil where motion is prescribed.
    pub torque: Vec<f64>,
}

impl Linearised {
    /// Linearises a model about a state.
    pub fn new(mechanism: &mut dyn Mechanism, point: &Point) -> Self {
        let weights = |acceleration, velocity, position| Weights { acceleration, velocity, position };
        let still = Linearised {
            mass: tangent(mechanism, point, weights(1.0, 0.0, 0.0)),
            damping: tangent(mechanism, point, weights(0.0, 1.0, 0.0)),
            stiffness: tangent(mechanism, point, weights(0.0, 0.0, 1.0)),
            torque: torque_row(mechanism, point),
        };
        if point.speed_rad_per_s == 0.0 { still } else { still.turning_along(&rotation(mechanism, point)) }
    }

    /// In coordinates that turn along, by V.
    fn turning_along(self, rotation: &Band) -> Self {
        let by = |matrix: &Band| matrix.product(rotation);
        let inertia = by(&self.mass);
        let stiffness = self.stiffness.combine(1.0, &by(&self.damping), 1.0).combine(1.0, &by(&inertia), 1.0);
        Linearised { damping: self.damping.combine(1.0, &inertia, 2.0), stiffness, ..self }
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        [&self.mass, &self.damping, &self.stiffness].iter().all(|band| band.iter().all(|(_, _, value)| value.is_finite()))
    }
}

/// One of the tangents, or a sum of them.
pub(super) fn tangent(mechanism: &mut dyn Mechanism, point: &Point, weights: Weights) -> Band {
    let Point { input, q, v, a, .. } = point;
    let mut entries = Vec::new();
    mechanism.tangent(input, q, v, a, weights, &mut |i, j, value| entries.push((i, j, value)));
    Band::new(q.len(), &entries)
}

/// V: velocities of rigid motion are affine in the coordinates, so that unit changes give it to rounding.
pub(super) fn rotation(mechanism: &mut dyn Mechanism, point: &Point) -> Band {
    let n = point.q.len();
    let mut velocities = |q: &[f64]| {
        let (mut v, mut a) = (vec![0.0; n], vec![0.0; n]);
        mechanism.rigid_motion(&point.input, point.speed_rad_per_s, q, &mut v, &mut a);
        v
    };
    let here = velocities(&vec![0.0; n]);
    let mut entries = Vec::new();
    for j in 0..n {
        let mut q = vec![0.0; n];
        q[j] = 1.0;
        let moved = velocities(&q);
        entries.extend(moved.iter().zip(&here).enumerate().map(|(i, (moved, here))| (i, j, moved - here)));
    }
    Band::new(n, &entries)
}

/// `−∂r/∂τ`, the row of the tangent at the pivot. The residual is affine in the torque, so that its change by a torque that outweighs
/// all else is exact to rounding.
pub(super) fn torque_row(mechanism: &mut dyn Mechanism, point: &Point) -> Vec<f64> {
    let Point { input, q, v, a, .. } = point;
    let (mut with, mut without) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    mechanism.residual(&Input { torque_nm: LARGE_NM, ..*input }, q, v, a, &mut with);
    mechanism.residual(&Input { torque_nm: 0.0, ..*input }, q, v, a, &mut without);
    without.iter().zip(&with).map(|(without, with)| (without - with) / LARGE_NM).collect()
}
