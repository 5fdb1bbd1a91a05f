//! Dropped messages: counted per topic for `status`, and reported as gaps on `gaps`.

use std::collections::BTreeMap;

use crate::simulation::Stamp;
use crate::wire::{self, Gap, TopicDrops};

/// Totals per topic, and the gaps that are not reported yet, one per topic, epoch and kind.
#[derive(Debug, Default)]
pub(super) struct DropLedger {
    pending: BTreeMap<(String, u64, bool), Gap>,
    totals: BTreeMap<String, TopicDrops>,
}

impl DropLedger {
    /// Counts a message that could not be recorded, though its topic is published.
    pub(super) fn count_unrecorded(&mut self, topic: &str, stamp: &Stamp) {
        let stamped = Some(wire::stamp(stamp));
        self.add(Gap { stamp: stamped, topic: topic.to_owned(), count: 1, first_step: stamp.step, published: true });
    }

    /// Adds a gap: counts its messages, and merges it with the pending gap that it continues.
    pub(super) fn add(&mut self, gap: Gap) {
        let fresh = || TopicDrops { topic: gap.topic.clone(), ..TopicDrops::default() };
        let total = self.totals.entry(gap.topic.clone()).or_insert_with(fresh);
        *(if gap.published { &mut total.unrecorded } else { &mut total.unpublished }) += gap.count;
        self.merge(gap);
    }

    /// Totals per topic.
    pub(super) fn totals(&self) -> Vec<TopicDrops> {
        self.totals.values().cloned().collect()
    }

    /// Merges a gap into the pending ones without counting it again.
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

    /// Takes all pending gaps, to report them.
    pub(super) fn take(&mut self) -> impl Iterator<Item = Gap> + use<> {
        std::mem::take(&mut self.pending).into_values()
    }
}
