//! The samples of one instant, gathered from the messages of all topics.

use super::signals::Signals;
use crate::wire::{Angles, Displacements, Energies, Loads, Message, Stamp};

/// The samples of one instant: the message of each topic that has one there, since topics have rates of their own.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Samples {
    /// `None` without samples.
    pub stamp: Option<Stamp>,
    pub displacements: Option<Displacements>,
    pub angles: Option<Angles>,
    pub loads: Option<Loads>,
    pub energies: Option<Energies>,
}

impl Samples {
    fn add(&mut self, message: Message) {
        match message {
            Message::Displacements(message) => self.displacements = Some(*message),
            Message::Angles(message) => self.angles = Some(*message),
            Message::Loads(message) => self.loads = Some(*message),
            Message::Energies(message) => self.energies = Some(*message),
            _ => {}
        }
    }

    /// Number of topics that have a message.
    fn count(&self) -> usize {
        let there = [self.displacements.is_some(), self.angles.is_some(), self.loads.is_some(), self.energies.is_some()];
        there.into_iter().filter(|there| *there).count()
    }

    /// All their numbers by name.
    pub fn signals(&self) -> Signals {
        let mut signals = Signals::default();
        // Loads first, because they show whether there is a slider.
        self.loads.iter().for_each(|loads| signals.loads(loads));
        self.energies.iter().for_each(|energies| signals.energies(energies));
        self.angles.iter().for_each(|angles| signals.angles(angles));
        self.displacements.iter().for_each(|displacements| signals.displacements(displacements));
        signals
    }
}

/// Finds the instant with samples of the most topics since the last look, and the newest of these.
#[derive(Debug, Default)]
pub(super) struct FullestInstant {
    /// The instant whose messages are arriving.
    newest: Samples,
    /// The fullest of the instants before it; after a look, the one that was returned.
    fullest: Samples,
    looked: bool,
}

impl FullestInstant {
    /// Adds a message in the order of publishing: those of one instant come one after the other.
    pub fn add(&mut self, message: Message) {
        let stamp = message.stamp();
        if stamp != self.newest.stamp {
            let before = std::mem::replace(&mut self.newest, Samples { stamp, ..Samples::default() });
            if before.stamp != self.fullest.stamp && (self.looked || before.count() >= self.fullest.count()) {
                (self.fullest, self.looked) = (before, false);
            }
        }
        self.newest.add(message);
    }

    /// Drops the samples of earlier epochs: after a reset of a paused service, nothing is published until its next step.
    pub fn begin_epoch(&mut self, epoch: u64) {
        if self.newest.stamp.is_some_and(|stamp| stamp.epoch < epoch) {
            *self = Self::default();
        }
    }

    /// Returns the fullest instant since the last look; the newest one if none was completed since.
    pub fn look(&mut self) -> &Samples {
        if self.looked || self.newest.count() >= self.fullest.count() {
            self.fullest = self.newest.clone();
        }
        self.looked = true;
        &self.fullest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(step: u64, epoch: u64) -> Option<Stamp> {
        Some(Stamp { step, epoch, ..Stamp::default() })
    }

    fn angles(step: u64) -> Message {
        Message::Angles(Box::new(Angles { stamp: stamp(step, 0), ..Angles::default() }))
    }

    fn loads(step: u64) -> Message {
        Message::Loads(Box::new(Loads { stamp: stamp(step, 0), ..Loads::default() }))
    }

    fn energies(step: u64) -> Message {
        Message::Energies(Box::new(Energies { stamp: stamp(step, 0), ..Energies::default() }))
    }

    /// Step and number of topics of the instant that a look finds.
    fn look(instants: &mut FullestInstant) -> (u64, usize) {
        let found = instants.look();
        (found.stamp.map_or(0, |stamp| stamp.step), found.count())
    }

    #[test]
    fn val_the_newest_of_the_fullest_instants_is_found() {
        let mut instants = FullestInstant::default();
        assert_eq!(look(&mut instants), (0, 0));
        for step in 1..=25 {
            instants.add(angles(step));
            instants.add(loads(step));
            if step % 10 == 0 {
                instants.add(energies(step));
            }
        }
        assert_eq!(look(&mut instants), (20, 3));
        assert_eq!(look(&mut instants), (25, 2), "the service is paused");
        assert_eq!(look(&mut instants), (25, 2));
        [angles(26), loads(26), angles(27)].into_iter().for_each(|message| instants.add(message));
        assert_eq!(look(&mut instants), (26, 2), "the loads of step 27 are on their way");
        // A replay goes back.
        [loads(27), angles(3), loads(3)].into_iter().for_each(|message| instants.add(message));
        assert_eq!(look(&mut instants), (3, 2));
    }

    #[test]
    fn prop_samples_before_a_reset_are_dropped() {
        let mut instants = FullestInstant::default();
        instants.add(angles(5));
        instants.begin_epoch(0);
        assert_eq!(look(&mut instants), (5, 1));
        instants.begin_epoch(1);
        assert_eq!(instants.look(), &Samples::default());
        instants.add(Message::Angles(Box::new(Angles { stamp: stamp(1, 1), ..Angles::default() })));
        assert_eq!(look(&mut instants), (1, 1));
    }
}
