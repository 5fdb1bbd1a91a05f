//! A state about which motion is small: at rest at an angle, turning steadily, or at an instant of a run.

use crate::mechanics::Input;
use crate::simulation::Motion;

/// A state of a model, its load included.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Torque and prescribed motion.
    pub input: Input,
    /// Coordinates, n.
    pub q: Vec<f64>,
    /// Velocities, n.
    pub v: Vec<f64>,
    /// Accelerations, n.
    pub a: Vec<f64>,
    /// Speed of the frame that turns along with a steady rotation, rad/s; 0 where the frame stands.
    pub speed_rad_per_s: f64,
}

impl From<Motion> for Point {
    /// The instant of a run. Where that moves, the point's derivatives are those of the instant, as though they stood.
    fn from(Motion { input, q, v, a }: Motion) -> Self {
        Point { input, q, v, a, speed_rad_per_s: 0.0 }
    }
}
