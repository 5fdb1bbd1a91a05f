//! Recordings computed again: verified to the bit, taken up where they ended, or changed to see what would have been.

mod deviation;
mod difference;
mod error;
mod event;
mod finding;
mod missing_steps;
mod physics;
mod recheck;
mod recorded_session;
mod resimulator;
mod resume;
mod survey;
mod verify;
mod what_if;

pub use deviation::Deviation;
pub use difference::{Difference, Field};
pub use error::ResimulationError;
pub use finding::{Finding, LossReason};
pub use physics::Physics;
pub use recheck::Recomputed;
pub use recorded_session::RecordedSession;
pub use resume::{Resumed, resume};
pub use verify::{Verification, verify};
pub use what_if::{AddedPulse, Change, WhatIfOutcome, what_if};
