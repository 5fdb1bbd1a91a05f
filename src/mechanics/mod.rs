//! Models of the chain of links: pure functions and small structs; no clock, no I/O, no integrator.

mod beam;
pub(crate) mod crank_slider;
mod incremental;
mod joints;
mod mechanism;
mod observation;
mod resistance;
mod rigid;

pub use incremental::{Incremental, IncrementalState};
pub use mechanism::{Input, Mechanism, Singular, Weights};
pub use observation::{ElementForces, Energy, LinkObservation, NodeObservation, Observation};
pub use rigid::Rigid;
