//! What a recording says metadata its session, before its first message.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

use super::session_info::{METADATA, SCENE, sum};
use super::walk::{WalkFlow, WalkItem, walk};
use super::{RecordingError, build_info};

/// What a recording says metadata its session.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RecordingMetadata {
    /// The entries of its own metadata record.
    pub facts: BTreeMap<String, String>,
    /// The scene, TOML.
    pub scene: Option<String>,
}

impl RecordingMetadata {
    /// Reads a recording as far as is needed.
    ///
    /// # Errors
    /// [`RecordingError`] when it cannot be read, or is none of ours: it must have our metadata and a scene.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut metadata = RecordingMetadata::default();
        walk(path, |found, _| {
            match found {
                WalkItem::Metadata(METADATA, facts) => metadata.facts.clone_from(facts),
                WalkItem::Attachment(SCENE, bytes) => metadata.scene = Some(String::from_utf8_lossy(bytes).into_owned()),
                _ => {}
            }
            if metadata.scene.is_some() && !metadata.facts.is_empty() { WalkFlow::Break(()) } else { WalkFlow::Continue(()) }
        })?;
        if metadata.scene.is_none() || metadata.facts.is_empty() {
            return Err(RecordingError::Anonymous { path: path.to_owned() });
        }
        Ok(metadata)
    }

    /// An entry, or nothing.
    pub fn fact(&self, key: &str) -> &str {
        self.facts.get(key).map_or("", String::as_str)
    }

    /// How the program that recorded it differs from this one, `name recorded, not own`; nothing when it is the same build.
    pub fn other_build(&self) -> Vec<String> {
        let differs = |(name, own): (&str, &str)| {
            let recorded = self.fact(name);
            (recorded != own).then(|| format!("{name} {recorded}, not {own}"))
        };
        build_info::FACTS.into_iter().filter_map(differs).collect()
    }

    /// Whether the scene is the one that the session was begun with, by the sum that the metadata keeps of it.
    pub fn scene_is_original(&self) -> bool {
        let sum = self.scene.as_deref().map(sum);
        self.facts.get("scene_crc32").is_none_or(|kept| Some(kept) == sum.as_ref())
    }

    /// Wall clock at the session's start: what `log_time` counts from.
    pub fn started(&self) -> Option<SystemTime> {
        SystemTime::try_from(self.fact("started").parse::<prost_types::Timestamp>().ok()?).ok()
    }
}
