//! The newest message of every topic, for the snapshot. Telemetry is made into messages only when a snapshot is asked for.

use std::collections::BTreeMap;
use std::sync::Arc;

use zenoh::bytes::ZBytes;

use super::keys::Topic;
use crate::simulation::Sample;
use crate::wire::{Snapshot, Telemetry};

/// What the snapshot keeps of a message.
#[derive(Debug, Default)]
pub enum SnapshotEntry {
    /// That there was one.
    #[default]
    Number,
    /// Its bytes.
    Bytes(ZBytes),
    /// What it is made of.
    Sample(Arc<Telemetry>, Arc<Sample>),
}

impl<B: Into<ZBytes>> From<B> for SnapshotEntry {
    fn from(bytes: B) -> Self {
        SnapshotEntry::Bytes(bytes.into())
    }
}

/// The newest of every topic, and its number.
#[derive(Debug, Default)]
pub(super) struct SnapshotCache {
    messages: BTreeMap<Topic, (u64, SnapshotEntry)>,
}

impl SnapshotCache {
    /// Keeps a message; its number, which counts from 1, and what was kept of the one before.
    pub(super) fn keep(&mut self, topic: Topic, newest: SnapshotEntry) -> (u64, SnapshotEntry) {
        let (number, kept) = self.messages.entry(topic).or_default();
        *number += 1;
        (*number, std::mem::replace(kept, newest))
    }

    pub(super) fn snapshot(&self) -> Snapshot {
        Snapshot {
            displacements: self.newest(Topic::Displacements, Telemetry::displacements),
            angles: self.newest(Topic::Angles, Telemetry::angles),
            loads: self.newest(Topic::Loads, Telemetry::loads),
            energies: self.newest(Topic::Energies, Telemetry::energies),
            status: self.newest(Topic::Status, |_, _| Default::default()),
            sequences: self.messages.iter().map(|(topic, (number, _))| (topic.chunk().to_owned(), *number)).collect(),
        }
    }

    fn newest<M: prost::Message + Default>(&self, topic: Topic, make: impl Fn(&Telemetry, &Sample) -> M) -> Option<M> {
        match self.messages.get(&topic).map(|(_, kept)| kept)? {
            SnapshotEntry::Number => None,
            SnapshotEntry::Bytes(bytes) => M::decode(&*bytes.to_bytes()).ok(),
            SnapshotEntry::Sample(telemetry, sample) => Some(make(telemetry, sample)),
        }
    }
}
