//! The newest message of every topic, for snapshot queries. Telemetry is encoded only when a snapshot is queried.

use std::collections::BTreeMap;
use std::sync::Arc;

use zenoh::bytes::ZBytes;

use crate::simulation::{Sample, SampleContext};
use crate::wire::{Snapshot, Topic};

/// The snapshot's entry for one topic.
#[derive(Debug, Default)]
pub enum SnapshotEntry {
    /// Only the sequence number.
    #[default]
    Number,
    /// An encoded message.
    Bytes(ZBytes),
    /// The sample to encode when the snapshot is queried.
    Sample(Arc<SampleContext>, Arc<Sample>),
}

impl<B: Into<ZBytes>> From<B> for SnapshotEntry {
    fn from(bytes: B) -> Self {
        SnapshotEntry::Bytes(bytes.into())
    }
}

/// The newest entry of every topic, with its sequence number.
#[derive(Debug, Default)]
pub(super) struct SnapshotCache {
    messages: BTreeMap<Topic, (u64, SnapshotEntry)>,
}

impl SnapshotCache {
    /// Stores a message. Returns its sequence number, which counts from 1, and the previous entry.
    pub(super) fn keep(&mut self, topic: Topic, newest: SnapshotEntry) -> (u64, SnapshotEntry) {
        let (number, kept) = self.messages.entry(topic).or_default();
        *number += 1;
        (*number, std::mem::replace(kept, newest))
    }

    pub(super) fn snapshot(&self) -> Snapshot {
        Snapshot {
            displacements: self.newest(Topic::Displacements, SampleContext::displacements),
            angles: self.newest(Topic::Angles, SampleContext::angles),
            loads: self.newest(Topic::Loads, SampleContext::loads),
            energies: self.newest(Topic::Energies, SampleContext::energies),
            status: self.newest(Topic::Status, |_, _| Default::default()),
            sequences: self.messages.iter().map(|(topic, (number, _))| (topic.chunk().to_owned(), *number)).collect(),
        }
    }

    fn newest<M: prost::Message + Default>(&self, topic: Topic, make: impl Fn(&SampleContext, &Sample) -> M) -> Option<M> {
        match self.messages.get(&topic).map(|(_, kept)| kept)? {
            SnapshotEntry::Number => None,
            SnapshotEntry::Bytes(bytes) => M::decode(&*bytes.to_bytes()).ok(),
            SnapshotEntry::Sample(context, sample) => Some(make(context, sample)),
        }
    }
}
