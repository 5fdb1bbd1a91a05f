//! Models of the chain of links: pure functions and small structs; no clock, no I/O, no integrator.

mod beam;
pub(crate) mod crank_slider;
mod finite_element;
mod incremental;
mod joints;
mod mechanism;
mod modal;
mod observation;
mod resistance;
mod rigid;

pub use finite_element::FiniteElement;
pub use incremental::{Incremental, IncrementalState};
pub use mechanism::{Input, Mechanism, Singular, Weights};
pub use modal::Modal;
pub use observation::{ElementForces, Energy, LinkObservation, NodeObservation, Observation};
pub use rigid::Rigid;
