//! A recording as something to be computed again: its scene, its name, its clock.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::ResimulationError;
use crate::recording::{self, RecordingMetadata};
use crate::runtime::PublishRates;
use crate::scene::SceneSource;
use crate::wire::Stamp;

/// What a recording says before its first message.
#[derive(Debug, Clone)]
pub struct RecordedSession {
    /// The file.
    pub path: PathBuf,
    /// The service's name on the bus.
    pub name: String,
    /// Wall clock at the session's start: what `log_time` counts from.
    pub started: SystemTime,
    /// The scene it was made with.
    pub scene: SceneSource,
    /// Which steps were published, if it says so.
    pub publish: Option<PublishRates>,
    /// Whether energies were published as a topic. Earlier versions published them in `status` only and recorded no rate for them.
    pub energies: bool,
    /// All that it says of itself.
    pub metadata: RecordingMetadata,
}

impl RecordedSession {
    /// Reads what a recording says of itself.
    ///
    /// # Errors
    /// [`ResimulationError`] when it cannot be read or says too little, or its scene is refused.
    pub fn open(path: &Path) -> Result<Self, ResimulationError> {
        let metadata = RecordingMetadata::read(path)?;
        let text = metadata.scene.as_deref().unwrap_or_default();
        let scene = SceneSource::parse(&format!("{}: scene.toml", path.display()), text, &[]).map_err(|refused| {
            let build = metadata.other_build().join("; ");
            if build.is_empty() { refused.into() } else { ResimulationError::OtherBuild { refused, build } }
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

    /// Whether a stamp can be that of a message with this `log_time`: its time is that of its step, and not after it.
    pub(super) fn is_timely(&self, stamp: &Stamp, log_time_ns: u64) -> bool {
        let sim_time_s = stamp.step as f64 * self.scene.scene.solver.step_s;
        stamp.sim_time_s.to_bits() == sim_time_s.to_bits() && self.log_time_ns(sim_time_s) <= log_time_ns
    }

    /// `log_time` of an instant of the session, ns.
    pub fn log_time_ns(&self, session_s: f64) -> u64 {
        recording::log_time_ns(self.started, session_s)
    }
}
