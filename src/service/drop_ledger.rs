//! What recording_full queues kept out, until it can be told.

use std::collections::BTreeMap;

use crate::simulation::Stamp;
use crate::wire::{self, Gap, TopicDrops};

/// DropLedger that were not told of yet, one a topic, epoch and kind.
#[derive(Debug, Default)]
pub(super) struct DropLedger {
    pending: BTreeMap<(String, u64, bool), Gap>,
    totals: BTreeMap<String, TopicDrops>,
}

impl DropLedger {
    /// A message that was published, where it is of a topic that is, but could not be recorded.
    pub(super) fn count_unrecorded(&mut self, topic: &str, stamp: &Stamp) {
        let stamped = Some(wire::stamp(stamp));
        self.add(Gap { stamp: stamped, topic: topic.to_owned(), count: 1, first_step: stamp.step, published: true });
    }

    /// Puts a gap with those that it goes on from.
    pub(super) fn add(&mut self, gap: Gap) {
        let fresh = || TopicDrops { topic: gap.topic.clone(), ..TopicDrops::default() };
        let total = self.totals.entry(gap.topic.clone()).or_insert_with(fresh);
        *(if gap.published { &mut total.unrecorded } else { &mut total.unpublished }) += gap.count;
        self.merge(gap);
    }

    /// Everything so far, by topic.
    pub(super) fn totals(&self) -> Vec<TopicDrops> {
        self.totals.values().cloned().collect()
    }

    /// Puts back one that was taken and could not be told.
    pub(super) fn merge(&mut self, gap: Gap) {
        let epoch = gap.stamp.as_ref().map_or(0, |stamp| stamp.epoch);
        self.pending
            .entry((gap.topic.clone(), epoch, gap.published))
            .and_modify(|known| {
                known.first_step = known.first_step.min(gap.first_step);
                known.count += gap.count;
                known.stamp.clone_from(&gap.stamp);
            })
            .or_insert(gap);
    }

    /// All of them, to be told.
    pub(super) fn take(&mut self) -> impl Iterator<Item = Gap> + use<> {
        std::mem::take(&mut self.pending).into_values()
    }
}
