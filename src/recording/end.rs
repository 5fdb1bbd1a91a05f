//! The end of a recording: the last record before the index states why it ended and how many messages it holds.

use std::collections::BTreeMap;

use mcap::records::Metadata;

/// Name of the metadata record. A closed file without it lost its end, or was not written by flexcrank.
pub(super) const END: &str = "flexcrank-end";
/// Entry with the reason; every other entry is a topic with its number of messages.
const REASON: &str = "reason";

/// Why a recording ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EndReason {
    /// The run ended: its last status says how.
    #[error("the run ended")]
    RunEnded,
    /// A command stopped the recording.
    #[error("stopped by a command")]
    Stopped,
    /// The session continues in the next part.
    #[error("continued in the next part")]
    NextPart,
    /// The recording reached its size limit.
    #[error("size limit")]
    SizeLimit,
    /// The re-simulation of another recording ended.
    #[error("the re-simulation ended")]
    Resimulated,
}

/// The end of a recording, as its file states it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RecordingEnd {
    /// An [`EndReason`] in words.
    pub reason: String,
    /// Number of messages by topic.
    pub counts: BTreeMap<String, u64>,
}

impl RecordingEnd {
    /// Reads the end from a metadata record; `None` if the record is another one.
    pub fn of(name: &str, entries: &BTreeMap<String, String>) -> Option<Self> {
        let counts = entries.iter().filter(|(key, _)| *key != REASON);
        // A count that is no number differs from every count.
        let counts = counts.map(|(topic, count)| (topic.clone(), count.parse().unwrap_or(u64::MAX))).collect();
        (name == END).then(|| RecordingEnd { reason: entries.get(REASON).cloned().unwrap_or_default(), counts })
    }
}

impl From<RecordingEnd> for Metadata {
    fn from(RecordingEnd { reason, counts }: RecordingEnd) -> Self {
        let counts = counts.into_iter().map(|(topic, count)| (topic, count.to_string()));
        Metadata { name: END.to_owned(), metadata: counts.chain([(REASON.to_owned(), reason)]).collect() }
    }
}
