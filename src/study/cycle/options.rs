//! Options of a turn.

/// Options of a turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Crank-to-rod ratios, each with the scene's rod and the crank's length changed to suit; none for the scene's own.
    pub ratios: Vec<f64>,
    /// Crank rate at the beginning of the turn, rad/s; `None` for the scene's, see [`speed_rad_per_s`](super::speed_rad_per_s).
    pub speed_rad_per_s: Option<f64>,
    /// Crank acceleration, constant over the turn, rad/s².
    pub acceleration_rad_per_s2: f64,
    /// Constant resistance force on the slider instead of the scene's, N along −x.
    pub resistance_n: Option<f64>,
    /// Angles over the turn, its two ends included.
    pub points: usize,
    /// Whether to divide by rod length, slider mass and speed.
    pub dimensionless: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            ratios: Vec::new(),
            speed_rad_per_s: None,
            acceleration_rad_per_s2: 0.0,
            resistance_n: None,
            points: 361,
            dimensionless: false,
        }
    }
}
