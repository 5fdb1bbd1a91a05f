//! An overview of a recording: its topics with counts, sizes and times.

use std::collections::BTreeMap;
use std::path::Path;

use super::end::RecordingEnd;
use super::error::{RecordingError, begins_as_mcap};
use super::format::RecordedMessage;
use super::walk::{Damage, WalkFlow, WalkItem, walk_to_the_cut};

/// The messages of a topic.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TopicOverview {
    /// Name of the message type; empty if the topic has no schema.
    pub schema: String,
    /// Encoding of the messages.
    pub encoding: String,
    /// Number of messages.
    pub messages: u64,
    /// Size of all messages before compression, bytes.
    pub bytes: u64,
    /// Log time of the earliest and of the latest message, ns.
    pub span_ns: (u64, u64),
    /// The last message.
    pub last: Vec<u8>,
}

/// The contents of a recording, as far as it can be read.
#[derive(Debug, Default)]
pub struct Overview {
    /// Topics by name.
    pub topics: BTreeMap<String, TopicOverview>,
    /// The damaged places.
    pub damage: Vec<Damage>,
    /// Position at which the file ends early; `None` if it was closed properly.
    pub cut_off: Option<u64>,
    /// Number of the messages from the chunk in which the file ends: no checksum covers them.
    pub unchecked: u64,
    /// The end, as the file states it; `None` if it does not.
    pub end: Option<RecordingEnd>,
}

impl Overview {
    /// Reads all messages of a recording, and of one that ends early also those that its last chunk still holds.
    ///
    /// # Errors
    /// [`RecordingError`] if the file cannot be opened, or is not an MCAP file.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut overview = Overview::default();
        let structure = walk_to_the_cut(path, |item, _| {
            match item {
                WalkItem::Message(message) => overview.add(message),
                WalkItem::Metadata(name, entries) => overview.end = RecordingEnd::of(name, entries).or(overview.end.take()),
                _ => {}
            }
            WalkFlow::Continue(())
        })?;
        if overview.topics.is_empty() && !begins_as_mcap(path) {
            return Err(RecordingError::NotMcap(path.to_owned()));
        }
        let unchecked = overview.messages().saturating_sub(structure.messages);
        Ok(Overview { damage: structure.damage, cut_off: structure.cut_off, unchecked, ..overview })
    }

    fn add(&mut self, RecordedMessage { channel, log_time, data, .. }: &RecordedMessage) {
        let topic = self.topics.entry(channel.topic.clone()).or_insert_with(|| TopicOverview {
            schema: channel.schema.as_ref().map_or(String::new(), |schema| schema.name.clone()),
            encoding: channel.message_encoding.clone(),
            span_ns: (*log_time, *log_time),
            ..TopicOverview::default()
        });
        topic.messages += 1;
        topic.bytes += data.len() as u64;
        topic.span_ns = (topic.span_ns.0.min(*log_time), topic.span_ns.1.max(*log_time));
        topic.last.clear();
        topic.last.extend_from_slice(data);
    }

    /// Number of messages of all topics.
    pub fn messages(&self) -> u64 {
        self.topics.values().map(|topic| topic.messages).sum()
    }

    /// Log time of the earliest and of the latest message, ns.
    pub fn span_ns(&self) -> (u64, u64) {
        let spans = || self.topics.values().map(|topic| topic.span_ns);
        (spans().map(|span| span.0).min().unwrap_or(0), spans().map(|span| span.1).max().unwrap_or(0))
    }
}
