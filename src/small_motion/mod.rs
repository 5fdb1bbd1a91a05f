//! Small motion about a state: natural frequencies, damping and shapes of the modes, state-space matrices, and the multipliers of
//! periodic motion.
//!
//! Everything rests on the exact derivatives of the models' residual, [`Linearised`]: at rest, in steady rotation, or at an instant of
//! a run ([`Point`]).

mod band;
mod beyond_shapes;
pub mod error;
#[cfg(test)]
mod examples;
mod factors;
pub mod floquet;
mod free_motion;
pub mod growth;
#[cfg(test)]
mod growth_tests;
mod hold;
mod inputs;
mod lap;
mod linear;
mod linearised;
mod loaded;
mod masses_at_rest;
#[cfg(test)]
mod mechanisms;
mod modal_equation;
mod mode;
mod motion_search;
mod normal_modes;
pub mod orbit;
mod outputs;
mod parts;
pub mod periodic;
mod periodic_modes;
mod point;
mod recorded;
mod report;
mod response;
mod rounding;
pub mod scheme;
mod scheme_motion;
mod shape;
mod spectrum;
#[cfg(test)]
mod spectrum_tests;
mod state_space;
#[cfg(test)]
mod state_space_tests;
mod steady_state;
mod step_map;
mod subject;
mod sweep;
mod tension;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tip_force_tests;
#[cfg(test)]
mod turning_tests;
pub mod variation;
mod vibrations;

pub use band::{Band, BandLu};
pub use beyond_shapes::{BeyondShapes, beyond_shapes};
pub use free_motion::FreeMotions;
pub use linearised::Linearised;
pub use modal_equation::ModalEquation;
pub use mode::{Kind, Mode, Share, modes};
pub use normal_modes::{Amplitude, NormalMode, NormalModes};
pub use parts::Part;
pub use periodic_modes::{PeriodicMode, PeriodicModes, SchemeStep};
pub use point::Point;
pub use report::{LiveModes, ModeReport};
pub use scheme_motion::SchemeMotion;
pub use shape::{JointForces, LinkShape, likeness};
pub use spectrum::{Eigenpair, lowest};
pub use state_space::StateSpace;
pub use step_map::multiplier_of_vibration;
pub use subject::{Crank, Subject};
pub use sweep::{Branch, Crossing, OtherKind, crossings, follow, is_uncertain, other_kinds};
pub use vibrations::Vibrations;

use crate::shown::figure;

/// No modes can be told.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoModes {
    /// Rigid links whose crank is held.
    #[error("nothing can move: the links are rigid, and the crank is held")]
    NothingMoves,
    /// A model without a tangent.
    #[error("solver.model = \"{0}\" has no linearisation; modal, finite-element and rigid have")]
    NotSuited(&'static str),
    /// Torque or prescribed motion has no pivot to act on.
    #[error("the scene has no crank: its modes have neither angle nor speed")]
    NoCrank,
    /// A rotation that is periodic.
    #[error("only one link without weight turns steadily; other chains turn periodically: ask for --periodic")]
    NotSteady,
    /// The second of two links hangs free.
    #[error("a second link that hangs free turns neither steadily nor periodically; give an instant of a recording instead")]
    FreeSecondLink,
    /// A free crank on a base spring, with what depends on its angle.
    #[error(
        "a base spring winds up as a free crank turns, so that the motion does not repeat; give an instant of a recording instead"
    )]
    BaseSpring,
    /// One link with weight on a base spring.
    #[error(
        "one link on a base spring turns steadily only without weight (the spring counts as one that turns along): leave [gravity] out, \
         or ask `modes` for --periodic with --crank held"
    )]
    WeightOnSpring,
    /// No speed was given for a motion that turns.
    #[error("a mechanism that turns needs a speed that is not 0")]
    NoSpeed,
    /// No periodic motion, or no multipliers of it.
    #[error(transparent)]
    NotPeriodic(#[from] error::FloquetError),
    /// A singular position.
    #[error(
        "the position is singular: the rod stands across the guide, a link has no mass, or constant loads bend a link too far (does it buckle?)"
    )]
    Singular,
    /// Weight and loads cannot be balanced.
    #[error("no static equilibrium was found with the crank at {}°", figure(*angle_deg))]
    NoEquilibrium {
        /// The crank's angle, degrees.
        angle_deg: f64,
    },
    /// No steady rotation.
    #[error(
        "no steady rotation at {} rad/s was found with the crank at {}°: a critical speed is near, or the position is singular",
        figure(*speed_rad_per_s),
        figure(*angle_deg)
    )]
    NoSteadyRotation {
        /// The crank's speed, rad/s.
        speed_rad_per_s: f64,
        /// Its angle, degrees.
        angle_deg: f64,
    },
    /// The eigenvalue iteration failed.
    #[error("the eigenvalues were not found")]
    NotFound,
    /// It failed for the lowest eigenvalues of a mechanism.
    #[error("the eigenvalues were not found: fewer modes, fewer elements or less damping make them easier to find")]
    NoEigenvalues,
}
