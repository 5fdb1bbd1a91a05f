//! Deviation between a recorded session and its re-simulation.

use std::collections::{BTreeMap, BTreeSet};

use super::difference::{Difference, Field};
use super::shared_places::{UnlikeMeshes, keep_shared_places};
use crate::wire::{Angles, Displacements, Energies, Loads, Message};

/// The driving torque among the quantities.
const DRIVING_TORQUE: &str = "driving torque, N·m";

/// First and largest differences between a recorded session and its re-simulation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Deviation {
    /// The first message that differs by more than the sign of zero; `None` if none does.
    pub first: Option<Difference>,
    /// Links that were compared only at the nodes that both meshes have.
    pub unlike_meshes: BTreeSet<UnlikeMeshes>,
    /// The largest difference of each quantity that was compared, by the quantity's name and unit; 0 if it is the same.
    pub largest: BTreeMap<String, LargestDifference>,
    /// Quantities of which no value could be compared, because samples are missing; by name and unit.
    pub not_compared: Vec<String>,
    /// Session time of the last message that was compared, s; 0 if none was.
    pub until_s: f64,
}

/// The largest difference of a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestDifference {
    /// Its absolute value, in the quantity's unit.
    pub value: f64,
    /// Session time, s.
    pub at_s: f64,
}

impl Deviation {
    /// Compares a recorded message with the re-simulated one, each link at the places that both have.
    pub(super) fn compare(&mut self, mut recorded: Message, mut computed: Message, session_s: f64) {
        self.until_s = session_s;
        if let (Message::Displacements(was), Message::Displacements(is)) = (&recorded, &computed) {
            self.deflections_beside_straight_links(was, is, session_s);
            self.deflections_beside_straight_links(is, was, session_s);
        }
        self.unlike_meshes.extend(keep_shared_places(&mut recorded, &mut computed));
        if self.first.is_none() {
            self.first = difference(&recorded, &computed);
        }
        match (&recorded, &computed) {
            (Message::Displacements(was), Message::Displacements(is)) => self.displacements(was, is, session_s),
            (Message::Angles(was), Message::Angles(is)) => self.angles(was, is, session_s),
            (Message::Loads(was), Message::Loads(is)) => self.loads(was, is, session_s),
            (Message::Energies(was), Message::Energies(is)) => self.energies(was, is, session_s),
            _ => {}
        }
    }

    /// Whether a deflection of this link was compared.
    pub fn compares_deflection_of(&self, link: &str) -> bool {
        self.largest.contains_key(&deflection_of(link))
    }

    /// Reports the driving torque as not compared.
    pub(super) fn leave_out_torque(&mut self) {
        self.largest.remove(DRIVING_TORQUE);
        self.not_compared.push(DRIVING_TORQUE.to_owned());
    }

    fn put(&mut self, name: &str, difference: f64, session_s: f64) {
        if !self.largest.contains_key(name) {
            self.largest.insert(name.to_owned(), LargestDifference { value: 0.0, at_s: session_s });
        }
        if let Some(largest) = self.largest.get_mut(name).filter(|largest| difference.abs() > largest.value) {
            *largest = LargestDifference { value: difference.abs(), at_s: session_s };
        }
    }

    /// Compares deflections with those of the links that are straight in the other message. A straight link deflects by zero
    /// everywhere, so every node counts, not only those that both meshes have.
    fn deflections_beside_straight_links(&mut self, bent: &Displacements, other: &Displacements, session_s: f64) {
        let straight = straight_links(other);
        for node in bent.nodes.iter().filter(|node| straight.contains(node.link.as_str())) {
            if let Some(deflection_m) = node.deflection_m.filter(|deflection_m| *deflection_m != 0.0) {
                self.put(&deflection_of(&node.link), deflection_m, session_s);
            }
        }
    }

    fn displacements(&mut self, was: &Displacements, is: &Displacements, session_s: f64) {
        for (was, is) in was.nodes.iter().zip(&is.nodes) {
            self.put("node position, m", (was.x_m - is.x_m).hypot(was.y_m - is.y_m), session_s);
            let deflections = was.deflection_m.zip(is.deflection_m);
            // A node at the end of a link never leaves its chord, and says nothing of the link.
            if let Some((was_m, is_m)) = deflections.filter(|(was_m, is_m)| *was_m != 0.0 || *is_m != 0.0) {
                self.put(&deflection_of(&was.link), was_m - is_m, session_s);
            }
        }
    }

    fn angles(&mut self, was: &Angles, is: &Angles, session_s: f64) {
        for (was, is) in was.links.iter().zip(&is.links) {
            self.put(&format!("{} angle, rad", was.link), was.chord_rad - is.chord_rad, session_s);
        }
    }

    fn loads(&mut self, was: &Loads, is: &Loads, session_s: f64) {
        self.put(DRIVING_TORQUE, was.driving_torque_nm - is.driving_torque_nm, session_s);
        for (was, is) in was.joints.iter().zip(&is.joints) {
            self.put(&format!("{} force, N", was.joint), (was.fx_n - is.fx_n).hypot(was.fy_n - is.fy_n), session_s);
        }
    }

    fn energies(&mut self, was: &Energies, is: &Energies, session_s: f64) {
        let total_j = |of: &Energies| [of.kinetic_j, of.strain_j, of.potential_j].into_iter().flatten().sum::<f64>();
        self.put("total energy, J", total_j(was) - total_j(is), session_s);
    }
}

/// The deflection of a link among the quantities.
fn deflection_of(link: &str) -> String {
    format!("{link} deflection, m")
}

/// Links of which the model computes no deflection, because they cannot bend.
fn straight_links(displacements: &Displacements) -> BTreeSet<&str> {
    let straight = displacements.nodes.iter().filter(|node| node.deflection_m.is_none());
    straight.map(|node| node.link.as_str()).collect()
}

/// The difference between two messages, if there is one in numbers: 0 and -0 are equal.
fn difference(recorded: &Message, computed: &Message) -> Option<Difference> {
    if recorded == computed {
        return None;
    }
    let (topic, stamp) = (recorded.topic(), recorded.stamp().unwrap_or_default());
    let field = Field::first_unequal(topic.schema(), &recorded.encode_to_vec(), &computed.encode_to_vec())?;
    Some(Difference {
        topic: topic.chunk().to_owned(),
        instant: (stamp.epoch, stamp.step),
        sim_time_s: stamp.sim_time_s,
        field: Some(field),
        after: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{LinkAngle, NodeState};

    fn angles(acceleration_rad_per_s2: Option<f64>) -> Message {
        let link = LinkAngle { link: "rod".to_owned(), chord_rad: 1.5, acceleration_rad_per_s2, ..LinkAngle::default() };
        Message::Angles(Box::new(Angles { links: vec![link], ..Angles::default() }))
    }

    fn compared(recorded: Option<f64>, computed: Option<f64>) -> Deviation {
        let mut deviation = Deviation::default();
        deviation.compare(angles(recorded), angles(computed), 2.0);
        deviation
    }

    #[test]
    fn regress_a_difference_of_zero_is_no_deviation() {
        for (recorded, computed) in [(Some(0.0), Some(-0.0)), (Some(-0.0), Some(0.0)), (Some(0.0), None), (None, Some(-0.0))] {
            assert_eq!(compared(recorded, computed).first, None, "{recorded:?} {computed:?}");
        }
        for (recorded, computed) in [(Some(0.0), Some(1e-300)), (Some(3.0), None), (None, Some(-3.0))] {
            let first = compared(recorded, computed).first;
            let name = first.and_then(|first| first.field).map(|field| field.name);
            assert_eq!(name.as_deref(), Some("links.rod.acceleration_rad_per_s2"), "{recorded:?} {computed:?}");
        }
    }

    fn rod(deflections_m: &[Option<f64>]) -> Message {
        let node = |(index, deflection_m): (u32, &Option<f64>)| NodeState {
            link: "rod".to_owned(),
            index,
            deflection_m: *deflection_m,
            ..NodeState::default()
        };
        let nodes = (0..).zip(deflections_m).map(node).collect();
        Message::Displacements(Box::new(Displacements { stamp: None, nodes }))
    }

    #[test]
    fn regress_a_straight_link_has_no_deflection_at_any_place() {
        let bent = rod(&[0.0, 0.01, -0.04, 0.02, 0.0].map(Some));
        for elements in [1, 2, 3, 4] {
            let straight = rod(&vec![None; elements + 1]);
            for [recorded, computed] in [[&bent, &straight], [&straight, &bent]] {
                let mut deviation = Deviation::default();
                deviation.compare(recorded.clone(), computed.clone(), 2.0);
                let expected = LargestDifference { value: 0.04, at_s: 2.0 };
                assert_eq!(deviation.largest.get("rod deflection, m"), Some(&expected), "{elements}");
            }
        }
    }

    /// A bent link of one element has no inner node, but is not straight.
    #[test]
    fn prop_deflections_of_two_flexible_links_are_compared_at_shared_nodes() {
        let mut deviation = Deviation::default();
        deviation.compare(rod(&[0.0, 0.01, 0.04, 0.02, 0.0].map(Some)), rod(&[0.0, 0.03, 0.0].map(Some)), 2.0);
        assert!((deviation.largest["rod deflection, m"].value - 0.01).abs() < 1e-15, "{deviation:?}");
        deviation = Deviation::default();
        deviation.compare(rod(&[0.0, 0.04, 0.0].map(Some)), rod(&[0.0, 0.0].map(Some)), 2.0);
        assert_eq!(deviation.largest.get("rod deflection, m"), None);
    }

    #[test]
    fn regress_quantities_of_equal_messages_are_the_same() {
        let expected = LargestDifference { value: 0.0, at_s: 2.0 };
        assert_eq!(compared(Some(1.0), Some(1.0)).largest, BTreeMap::from([("rod angle, rad".to_owned(), expected)]));
    }
}
