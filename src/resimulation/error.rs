//! Why a recording could not be computed again.

use std::path::PathBuf;

use crate::recording::RecordingError;
use crate::scene::SceneError;
use crate::simulation::BuildError;

/// A recording could not be computed again.
#[derive(Debug, thiserror::Error)]
pub enum ResimulationError {
    /// It cannot be read, or the new one cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Its scene is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Its scene is refused, and another build recorded it.
    #[error("{refused} (recorded by another build: {build})")]
    OtherBuild {
        /// Why.
        refused: SceneError,
        /// How that build differs from this one.
        build: String,
    },
    /// The change to its scene is refused.
    #[error("{0}")]
    Change(SceneError),
    /// Its scene cannot be computed.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// No checkpoint is left of it.
    #[error("{}: the recording has no checkpoint to go on from", .0.display())]
    NothingToResume(PathBuf),
    /// An instant that is not in it.
    #[error("{}: t = {at_s} s is not in the recording, or lost to damage", path.display())]
    Outside {
        /// Which file.
        path: PathBuf,
        /// What was asked for, s.
        at_s: f64,
    },
    /// Its scene does not give what was recorded.
    #[error("{}: the recording cannot be computed again: {what}", path.display())]
    Unlike {
        /// Which file.
        path: PathBuf,
        /// Where it fails.
        what: String,
    },
    /// It does not say when its session began.
    #[error("{}: the recording does not say when its session began", .0.display())]
    NoStart(PathBuf),
}

impl ResimulationError {
    /// Whether what was asked for is at fault, not the recording.
    pub fn is_usage(&self) -> bool {
        matches!(self, ResimulationError::Change(_) | ResimulationError::Outside { .. })
    }
}
