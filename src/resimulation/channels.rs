//! The channels of a recording: each must be one of its service's topics, with consecutive sequence numbers.

use std::collections::BTreeMap;

use super::event::{schema, topic};
use super::finding::Finding;
use crate::recording::RecordedMessage;
use crate::wire::{self, ROOT, Topic};

/// Checks every message against its channel.
pub(super) struct ChannelCheck {
    /// Beginning of all topics: `flexcrank/NAME/`.
    prefix: String,
    /// Whether the recording was made by this build, so that its schemas must be equal, too.
    own_build: bool,
    tracks: BTreeMap<u16, ChannelTrack>,
    findings: Vec<Finding>,
}

struct ChannelTrack {
    topic: String,
    messages: u64,
    /// Expected sequence number of the next message.
    next: u32,
    /// Whether part of the file was lost since the last message.
    damaged: bool,
    /// The first jump of the sequence numbers: expected, found, and the number of further jumps.
    jump: Option<(u32, u32, u64)>,
}

impl ChannelCheck {
    pub(super) fn new(name: &str, own_build: bool) -> Self {
        ChannelCheck { prefix: format!("{ROOT}/{name}/"), own_build, tracks: BTreeMap::new(), findings: Vec::new() }
    }

    /// Notes that part of the file is lost.
    pub(super) fn damaged(&mut self) {
        self.tracks.values_mut().for_each(|track| track.damaged = true);
    }

    /// Adds a message. `lossy`: messages before it may be lost to damage.
    pub(super) fn take(&mut self, message: &RecordedMessage, lossy: bool) {
        if !self.tracks.contains_key(&message.channel.id) {
            self.open(message, lossy);
        }
        let Some(track) = self.tracks.get_mut(&message.channel.id) else { return };
        track.messages += 1;
        if message.sequence != track.next && !track.damaged {
            let (_, _, others) = track.jump.get_or_insert((track.next, message.sequence, 0));
            *others += 1;
        }
        (track.next, track.damaged) = (message.sequence.wrapping_add(1), false);
    }

    fn open(&mut self, message: &RecordedMessage, damaged: bool) {
        let channel = &message.channel;
        let known = channel.topic.strip_prefix(&self.prefix).and_then(Topic::of_chunk);
        let expected = known.map(Topic::schema);
        let what = match expected {
            None => Some("no topic of this service".to_owned()),
            Some(_) if channel.message_encoding != "protobuf" => Some(format!("the encoding is {}", channel.message_encoding)),
            Some(expected) if schema(message) != expected => {
                Some(format!("its messages are {}, not {expected}", schema(message)))
            }
            Some(expected) if self.own_build && !has_own_schema(message, expected) => {
                Some(format!("its schema is not that of {expected} in this build"))
            }
            Some(_) if self.tracks.values().any(|track| track.topic == channel.topic) => {
                Some("a second channel of the same topic".to_owned())
            }
            Some(_) => None,
        };
        self.findings.extend(what.map(|what| Finding::Channel { topic: channel.topic.clone(), what }));
        let track = ChannelTrack { topic: channel.topic.clone(), messages: 0, next: 0, damaged, jump: None };
        self.tracks.insert(channel.id, track);
    }

    /// Number of messages by topic.
    pub(super) fn counts(&self) -> BTreeMap<String, u64> {
        self.tracks.values().map(|track| (track.topic.clone(), track.messages)).collect()
    }

    /// Returns the findings. Lost messages of a recovered recording are counted elsewhere.
    pub(super) fn into_findings(mut self, recovered: bool) -> Vec<Finding> {
        let jumps = self.tracks.into_values().filter(|_| !recovered).filter_map(|ChannelTrack { topic, jump, .. }| {
            let (expected, found, count) = jump?;
            Some(Finding::Sequence { topic, expected, found, others: count - 1 })
        });
        self.findings.extend(jumps);
        self.findings
    }
}

fn has_own_schema(message: &RecordedMessage, name: &str) -> bool {
    let own = wire::descriptor_set(name);
    message.channel.schema.as_ref().is_some_and(|schema| schema.encoding == "protobuf" && schema.data.as_ref() == own)
}

/// Last chunk of a message's topic, as the catalogue has it.
pub(super) fn chunk(message: &RecordedMessage) -> &'static str {
    Topic::of_chunk(topic(message)).map_or("unknown", Topic::chunk)
}
