//! Errors of re-simulation.

use std::path::{Path, PathBuf};

use crate::recording::RecordingError;
use crate::scene::SceneError;
use crate::shown::{shown_s, shown_sentence};
use crate::simulation::{BuildError, PulseRefused};

/// A recording could not be re-simulated.
#[derive(Debug, thiserror::Error)]
pub enum ResimulationError {
    /// The recording cannot be read, or the new one cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recorded scene is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The recorded scene is refused, and another build recorded it.
    #[error("{refused} (recorded by another build: {})", shown_sentence(build))]
    OtherBuild {
        /// Why the scene is refused.
        refused: Box<SceneError>,
        /// Differences between that build and this one.
        build: String,
    },
    /// The changed scene is refused.
    #[error("{}", .0.in_full())]
    Change(SceneError),
    /// An added pulse is refused.
    #[error("the pulse added at t = {at_s} s is refused: {why}")]
    Pulse {
        /// Its start, simulated s since the session began.
        at_s: f64,
        /// Why it is refused.
        why: PulseRefused,
    },
    /// The recorded scene cannot be computed.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The recording has no checkpoint left.
    #[error("{}: the recording has no checkpoint to resume from", .0.display())]
    NothingToResume(PathBuf),
    /// The recording does not cover the instant.
    #[error("{}: {}", path.display(), outside(path, *at_s, *last_s))]
    Outside {
        /// The recording.
        path: PathBuf,
        /// The requested time, s.
        at_s: f64,
        /// Time of the last message, s, if known.
        last_s: Option<f64>,
    },
    /// The recording begins after the instant.
    #[error(
        "{}: t = {at_s} s is not in the recording, which begins at {} s: choose a later instant",
        path.display(),
        shown_s(*first_s)
    )]
    Before {
        /// The recording.
        path: PathBuf,
        /// The requested time, s.
        at_s: f64,
        /// Time of the first message, s.
        first_s: f64,
    },
    /// The scene does not reproduce the recording.
    #[error("{}: the recording cannot be re-simulated: {}", path.display(), shown_sentence(what))]
    Unlike {
        /// The recording.
        path: PathBuf,
        /// Where re-simulation fails.
        what: String,
    },
    /// The changed session refuses a torque or a change that the recorded one accepted.
    #[error("{}: the change does not suit the recorded session: at t = {at_s:.3} s, {}", path.display(), shown_sentence(what))]
    Unsuited {
        /// The recording.
        path: PathBuf,
        /// Time of the refusal, simulated s since the session began.
        at_s: f64,
        /// The refusal, with its reason.
        what: String,
    },
    /// The recording does not state when its session began.
    #[error("{}: the recording does not state when its session began", .0.display())]
    NoStart(PathBuf),
}

impl ResimulationError {
    /// Names a file by its final name, which it has not yet.
    pub(super) fn of_file(self, unfinished: &Path, name: &Path) -> Self {
        match self {
            ResimulationError::Recording(RecordingError::File { path, cause }) if path == unfinished => {
                ResimulationError::Recording(RecordingError::File { path: name.to_owned(), cause })
            }
            other => other,
        }
    }

    /// Whether the request is at fault, not the recording.
    pub fn is_usage(&self) -> bool {
        use ResimulationError::{Before, Change, Outside, Pulse, Unsuited};
        matches!(self, Before { .. } | Change(_) | Outside { .. } | Pulse { .. } | Unsuited { .. })
    }
}

/// Instants that are nearer to each other than this are one, s.
const SAME_S: f64 = 1e-6;

/// Why a recording does not cover an instant.
fn outside(path: &Path, at_s: f64, last_s: Option<f64>) -> String {
    match last_s {
        Some(last_s) if (at_s - last_s).abs() < SAME_S => {
            format!("nothing is recorded after t = {at_s} s: choose an earlier instant")
        }
        Some(last_s) if at_s > last_s => {
            let end = shown_s(last_s);
            match RecordingError::cut_chunk_hint(path) {
                Some(way) => {
                    format!(
                        "t = {at_s} s is not in the whole chunks of the recording, which end at {end} s: choose an earlier instant, or {way}"
                    )
                }
                None => format!("t = {at_s} s is not in the recording, which ends at {end} s: choose an earlier instant"),
            }
        }
        _ => format!("t = {at_s} s is not in the recording, or is lost to damage"),
    }
}
