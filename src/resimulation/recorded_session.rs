//! A recorded session to re-simulate: its scene, name and clock.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::ResimulationError;
use crate::recording::{self, RecordingMetadata};
use crate::scene::SceneSource;
use crate::simulation::PublishRates;

/// The publishing rate that a what-if with other steps states: its samples are at times of the original's, which no number describes.
pub(super) const ORIGINAL_TIMES: &str = "original";

/// The facts of a recorded session.
#[derive(Debug, Clone)]
pub struct RecordedSession {
    /// Path of the recording.
    pub path: PathBuf,
    /// The service's name on the bus.
    pub name: String,
    /// Wall clock at the start of the session, the origin of `log_time`.
    pub started: SystemTime,
    /// The recorded scene.
    pub scene: SceneSource,
    /// Publishing rates, if recorded.
    pub publish: Option<PublishRates>,
    /// Whether energies were published as a topic. Earlier versions published them in `status` only and recorded no rate for
    /// them.
    pub energies: bool,
    /// Metadata of the recording.
    pub metadata: RecordingMetadata,
}

impl RecordedSession {
    /// Opens a recording and reads its metadata and scene.
    ///
    /// # Errors
    /// [`ResimulationError`] if the recording cannot be read, its metadata is incomplete, or its scene is refused.
    pub fn open(path: &Path) -> Result<Self, ResimulationError> {
        let metadata = RecordingMetadata::read(path)?;
        let text = metadata.scene.as_deref().unwrap_or_default();
        let scene = SceneSource::parse(&format!("scene of {}", path.display()), text, &[]).map_err(|refused| {
            let build = metadata.other_build().join("; ");
            if build.is_empty() { refused.into() } else { ResimulationError::OtherBuild { refused: Box::new(refused), build } }
        })?;
        let started = metadata.started().ok_or_else(|| ResimulationError::NoStart(path.to_owned()))?;
        Ok(RecordedSession {
            path: path.to_owned(),
            name: metadata.fact("name").to_owned(),
            started,
            scene,
            publish: metadata.fact("publish_hz").parse().ok(),
            energies: metadata.fact("publish_hz").contains("energies="),
            metadata,
        })
    }

    /// Whether the recording begins where its run began, so that counts since then are known.
    pub(super) fn begins_with_run(&self) -> bool {
        matches!(self.metadata.fact("part"), "" | "1")
    }

    /// Whether it is a what-if, which leaves out commands that pause.
    pub(super) fn is_what_if(&self) -> bool {
        self.metadata.is_what_if()
    }

    /// Whether it is a what-if that has its samples at times of the original's. A what-if drops no sample.
    pub(super) fn is_sampled_as_original(&self) -> bool {
        self.is_what_if() && self.metadata.fact("publish_hz") == ORIGINAL_TIMES
    }

    /// Whether the run began paused.
    pub(super) fn is_lockstep(&self) -> bool {
        self.metadata.fact("pace") == "lockstep"
    }

    /// `log_time` of an instant of the session, ns.
    pub fn log_time_ns(&self, session_s: f64) -> u64 {
        recording::log_time_ns(self.started, session_s)
    }

    /// Why the recording has no checkpoint until `at_s`, session s. `first_ns` is the `log_time` of its first message, ns; `None`
    /// if messages before that are lost.
    pub(super) fn before_checkpoints(&self, at_s: f64, first_ns: Option<u64>) -> ResimulationError {
        let path = self.path.clone();
        match first_ns.filter(|first_ns| *first_ns > self.log_time_ns(at_s)) {
            Some(first_ns) => {
                let first_s = first_ns.saturating_sub(self.log_time_ns(0.0)) as f64 * 1e-9;
                ResimulationError::Before { path, at_s, first_s }
            }
            None => ResimulationError::Outside { path, at_s, last_s: None },
        }
    }
}
