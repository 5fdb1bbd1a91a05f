//! The metadata of a recording: session facts and scene, read from its beginning.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

use super::format::RecordedMessage;
use super::reader::Messages;
use super::session_info::{METADATA, SCENE, sum};
use super::walk::{WalkFlow, WalkItem, walk};
use super::{RecordingError, build_info};
use crate::wire::Topic;

/// Whether a recording has a checkpoint that can be read: a session can be resumed from it.
pub fn has_checkpoint(path: &Path) -> bool {
    let is_checkpoint = |message: &RecordedMessage| {
        message.channel.schema.as_ref().is_some_and(|schema| schema.name == Topic::Checkpoint.schema())
    };
    Messages::open(path).is_ok_and(|messages| messages.map_while(Result::ok).any(|message| is_checkpoint(&message)))
}

/// Session facts and scene of a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RecordingMetadata {
    /// Entries of flexcrank's metadata record.
    pub facts: BTreeMap<String, String>,
    /// The scene, TOML.
    pub scene: Option<String>,
}

impl RecordingMetadata {
    /// Reads a recording until metadata and scene are complete.
    ///
    /// # Errors
    /// [`RecordingError`] if the file cannot be read, or lacks flexcrank's metadata or a scene.
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
            return Err(RecordingError::anonymous(path));
        }
        Ok(metadata)
    }

    /// An entry; empty if absent.
    pub fn fact(&self, key: &str) -> &str {
        self.facts.get(key).map_or("", String::as_str)
    }

    /// Whether it is a what-if.
    pub(crate) fn is_what_if(&self) -> bool {
        !self.fact("what_if").is_empty()
    }

    /// Differences between the build that recorded and this one, as `name recorded, not own`; empty for the same build.
    pub fn other_build(&self) -> Vec<String> {
        let differs = |(name, own): (&str, &str)| {
            let recorded = self.fact(name);
            (recorded != own).then(|| format!("{name} {recorded}, not {own}"))
        };
        build_info::FACTS.into_iter().filter_map(differs).collect()
    }

    /// Whether the scene has the checksum that the metadata stores; `None` if they store none.
    pub fn scene_is_original(&self) -> Option<bool> {
        let sum = self.scene.as_deref().map(sum);
        self.facts.get("scene_crc32").map(|kept| Some(kept) == sum.as_ref())
    }

    /// Wall clock at the start of the session, the origin of `log_time`.
    pub fn started(&self) -> Option<SystemTime> {
        SystemTime::try_from(self.fact("started").parse::<prost_types::Timestamp>().ok()?).ok()
    }
}
