//! Models of the chain of links: pure functions and small structs; no clock, no I/O, no integrator.

mod beam;
mod chain_line;
pub(crate) mod crank_slider;
mod equilibrium;
mod finite_element;
mod incremental;
mod joints;
mod last_state;
mod lu;
mod mechanism;
mod modal;
mod observation;
mod oscillator;
mod resistance;
mod rigid;
mod rigid_bar;
mod short_loads;
mod transfer;

pub use chain_line::{LinkShape, Place, PlacePoint, ShapePoint};
pub use finite_element::FiniteElement;
pub use incremental::{Incremental, IncrementalState};
pub use mechanism::{ChainModel, Coordinate, Input, Measure, Mechanism, NoEquilibrium, ROTATIONS, Singular, Weights};
pub use modal::Modal;
pub use observation::{ElementForces, Energy, LinkObservation, NodeObservation, Observation};
pub use oscillator::Oscillator;
#[cfg(feature = "service")]
pub(crate) use resistance::resistance_n;
pub use rigid::{Block, CarriedTurn, Course, Passage, Rigid, RigidChain};
pub(crate) use short_loads::{FEW_STEPS, loads_rad, passes};
pub use transfer::{CannotTransfer, Present, Transfer};
