//! Why a simulation could not be built, or stopped.

use std::borrow::Cow;

use crate::integrate::StepError;
use crate::shown::{shown_j, shown_s};

/// The scene asks for what its model cannot compute.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the {model} model cannot compute this scene: {why}")]
pub struct BuildError {
    /// The key of the scene that the refusal is about.
    pub key: &'static str,
    /// The model asked for.
    pub model: &'static str,
    /// The reason.
    pub why: Cow<'static, str>,
}

/// The parts of the energy in play.
const IN_PLAY: &str = "there at the start, fallen in gravity, or put in";

/// Cause that stops a simulation.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Cause {
    /// A step could not be taken, nor in parts.
    #[error("{0}")]
    Step(#[from] StepError),
    /// There is more energy than was ever put in.
    #[error(
        "kinetic and strain energy is {} J, over {factor} times the {} J in play ({IN_PLAY})",
        shown_j(*energy_j),
        shown_j(*accounted_j)
    )]
    EnergyGrew {
        /// Kinetic and strain energy now, J.
        energy_j: f64,
        /// Energy at the start, put in, or fallen in gravity, J.
        accounted_j: f64,
        /// Factor above which growth is divergence.
        factor: f64,
    },
    /// A step's balance moved by a large part of the energy in play.
    #[error(
        "the energy balance moved by {} J in this step, with {} J in play ({IN_PLAY})",
        shown_j(*moved_j),
        shown_j(*accounted_j)
    )]
    BalanceMoved {
        /// Change of the balance in the step, J.
        moved_j: f64,
        /// Energy at the start, put in, or fallen in gravity, J.
        accounted_j: f64,
    },
    /// A step dissipated more than there was.
    #[error("this step dissipated {} J, with {} J in play ({IN_PLAY})", shown_j(*dissipated_j), shown_j(*accounted_j))]
    Dissipated {
        /// Dissipation in the step, J.
        dissipated_j: f64,
        /// Energy at the start, put in, or fallen in gravity, J.
        accounted_j: f64,
    },
}

/// The simulation stopped; its last good state is still there.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "diverged in step {step} at t = {} s (kinetic and strain energy {} J before it): {cause}",
    shown_s(*sim_time_s),
    shown_j(*energy_j)
)]
pub struct Diverged {
    /// The step that failed.
    pub step: u64,
    /// Simulated time at which it began, s.
    pub sim_time_s: f64,
    /// Kinetic and strain energy in the last good state, J.
    pub energy_j: f64,
    /// The cause.
    pub cause: Cause,
}

/// A torque pulse or a setpoint was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PulseRefused {
    /// A number is NaN or infinite.
    #[error("torque, duration and delay must be finite numbers")]
    NotFinite,
    /// Too short, too long, or negative.
    #[error("duration_s = {0} is not allowed: above 0, at most 3600 s")]
    Duration(f64),
    /// Negative or too far off.
    #[error("delay_s = {0} is not allowed: 0 to 3600 s")]
    Delay(f64),
    /// A number of a setpoint is NaN or infinite.
    #[error("torque and hold must be finite numbers")]
    SetpointNotFinite,
    /// The hold of a setpoint is too short or too long.
    #[error("hold_s = {0} is not allowed: 1e-6 to 60 s")]
    Hold(f64),
    /// Over the scene's limit.
    #[error(
        "|torque_nm| = {} is over the scene's limit of {limit_nm} N·m (commands.torque_limit_nm)",
        exactly(.torque_nm.abs())
    )]
    Torque {
        /// The requested mean torque, N·m.
        torque_nm: f64,
        /// The limit, N·m.
        limit_nm: f64,
    },
    /// As many pulses wait or act as this limit allows.
    #[error("commands.pending_limit = {0} is reached: it counts the pulses that wait or act")]
    Pending(usize),
    /// The scene is an oscillator.
    #[error("the scene is an [oscillator]: it has no pivot for a torque to act on")]
    NoPivot,
    /// The scene prescribes the motion.
    #[error("the scene prescribes the crank's motion ([drive]): torque has no effect")]
    MotionPrescribed,
}

/// A number with all its digits, as a power of ten where it would be long.
fn exactly(value: f64) -> String {
    if value < 1e15 { value.to_string() } else { format!("{value:e}") }
}
