//! Errors of a turn.

use crate::scene::SceneError;

/// A turn that cannot be computed as asked.
#[derive(Debug, thiserror::Error)]
pub enum CycleError {
    /// The scene is something else than a crank-slider.
    #[error("{0} is not a crank-slider: `cycle` needs [crank], [rod] and [slider]")]
    NotCrankSlider(String),
    /// Crank, rod and slider have no mass at all.
    #[error("{0} has no mass: there is no centre of mass to speak of")]
    Massless(String),
    /// A ratio is out of range.
    #[error("a crank-to-rod ratio must be above 0 and below 1, or the crank cannot turn; {0} is not")]
    Ratio(f64),
    /// The scene refuses the crank's length.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A number is not finite.
    #[error("{name} must be a finite number, not {value}")]
    NotFinite {
        /// Name of the option.
        name: &'static str,
        /// The number.
        value: f64,
    },
    /// Too few or too many angles.
    #[error("from 3 to 1000000 points in a turn, not {0}")]
    Points(usize),
    /// The crank stands still before its turn is over.
    #[error(
        "at {acceleration} rad/s² a crank at {speed} rad/s stops before its turn is over: it needs more than {least:.3} rad/s"
    )]
    Stops {
        /// Speed at the beginning, rad/s.
        speed: f64,
        /// Acceleration, rad/s².
        acceleration: f64,
        /// The speed that would just do, rad/s.
        least: f64,
    },
    /// The normalisation divides by zero.
    #[error("dimensionless values divide by {0}, which is 0 here")]
    DividesByZero(&'static str),
    /// Counterweights that do not exist.
    #[error("no counterweight balances this: {0}")]
    Counterweight(String),
}
