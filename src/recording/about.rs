//! What a recording says about its session, before its first message.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

use super::session_info::{METADATA, SCENE, sum};
use super::walk::{Found, Going, walk};
use super::{RecordingError, build};

/// What a recording says about its session.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct About {
    /// The entries of its own metadata record.
    pub facts: BTreeMap<String, String>,
    /// The scene, TOML.
    pub scene: Option<String>,
}

impl About {
    /// Reads a recording as far as is needed.
    ///
    /// # Errors
    /// [`RecordingError`] when it cannot be read, or is none of ours: it must have our metadata and a scene.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut about = About::default();
        walk(path, |found, _| {
            match found {
                Found::Metadata(METADATA, facts) => about.facts.clone_from(facts),
                Found::Attachment(SCENE, bytes) => about.scene = Some(String::from_utf8_lossy(bytes).into_owned()),
                _ => {}
            }
            if about.scene.is_some() && !about.facts.is_empty() { Going::Break(()) } else { Going::Continue(()) }
        })?;
        if about.scene.is_none() || about.facts.is_empty() {
            return Err(RecordingError::Anonymous { path: path.to_owned() });
        }
        Ok(about)
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
        build::FACTS.into_iter().filter_map(differs).collect()
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
