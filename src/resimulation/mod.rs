//! Recordings computed again: verified to the bit, taken up where they ended, or changed to see what would have been.

mod course;
mod difference;
mod error;
mod event;
mod finding;
mod holes;
mod parting;
mod physics;
mod recheck;
mod resume;
mod source;
mod survey;
mod verify;
mod what_if;

pub use difference::{Difference, Field};
pub use error::ResimulationError;
pub use finding::{Finding, Why};
pub use parting::Parting;
pub use physics::Physics;
pub use recheck::Recomputed;
pub use resume::{Resumed, resume};
pub use source::Source;
pub use verify::{Verification, verify};
pub use what_if::{AddedPulse, Change, Outcome, what_if};
