//! Re-simulation of recordings: verified to the bit, resumed, or changed to see what would have been.

mod best_level;
mod change;
mod channels;
mod deviation;
mod difference;
mod error;
mod event;
mod finding;
mod missing_steps;
mod physics;
mod recheck;
mod recorded_session;
mod recorded_torque;
mod resimulator;
mod resume;
mod run_counts;
mod run_track;
mod shared_places;
mod source_losses;
mod survey;
mod timeline;
mod verify;
mod what_if;

pub use best_level::{BestLevelRun, LostTrack};
pub use change::{AddedPulse, Change};
pub use deviation::{Deviation, LargestDifference};
pub use difference::{Difference, Field};
pub use error::ResimulationError;
pub use finding::{Finding, LossReason};
pub use physics::PhysicsCheck;
pub use recheck::Recomputed;
pub use recorded_session::RecordedSession;
pub use resume::{Resumed, resume};
pub use shared_places::UnlikeMeshes;
pub use verify::{Verification, verify};
pub use what_if::{WhatIfOutcome, what_if};
