//! Subscriptions of the view.

use crate::bus::{BusError, Name, Session, Topic, client};
use crate::wire::{Angles, Displacements, Energies, Loads, Shadow, Status};

/// Subscriptions to everything shown.
pub(super) struct Subscribers {
    angles: client::TopicSubscriber,
    displacements: client::TopicSubscriber,
    loads: client::TopicSubscriber,
    energies: client::TopicSubscriber,
    shadow: client::TopicSubscriber,
    status: client::TopicSubscriber,
}

impl Subscribers {
    pub(super) fn subscribe(session: &Session, name: &Name) -> Result<Self, BusError> {
        let subscribe = |topic| client::subscribe(session, name, topic);
        Ok(Subscribers {
            angles: subscribe(Topic::Angles)?,
            displacements: subscribe(Topic::Displacements)?,
            loads: subscribe(Topic::Loads)?,
            energies: subscribe(Topic::Energies)?,
            shadow: subscribe(Topic::Shadow)?,
            status: subscribe(Topic::Status)?,
        })
    }

    pub(super) fn angles(&self) -> impl Iterator<Item = Angles> {
        client::new_messages(&self.angles)
    }

    pub(super) fn displacements(&self) -> impl Iterator<Item = Displacements> {
        client::new_messages(&self.displacements)
    }

    pub(super) fn loads(&self) -> impl Iterator<Item = Loads> {
        client::new_messages(&self.loads)
    }

    pub(super) fn energies(&self) -> impl Iterator<Item = Energies> {
        client::new_messages(&self.energies)
    }

    pub(super) fn shadows(&self) -> impl Iterator<Item = Shadow> {
        client::new_messages(&self.shadow)
    }

    pub(super) fn statuses(&self) -> impl Iterator<Item = Status> {
        client::new_messages(&self.status)
    }
}
