//! Messages of links with unlike meshes: the nodes at places that both meshes have.

use std::collections::BTreeMap;

use crate::mesh_places::node_at_same_place;
use crate::wire::{ElementForce, Message, NodeState};

/// A link with different numbers of elements in a recording and in its re-simulation.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct UnlikeMeshes {
    /// The link's name.
    pub link: String,
    /// Number of its elements in the recording.
    pub recorded: u64,
    /// Number of its elements in the re-simulation.
    pub computed: u64,
}

/// Removes from both messages the nodes at places that only one has, and the forces in elements of links with unlike meshes. The
/// computed nodes get the recorded indices. Returns the links whose nodes are not as many.
pub(super) fn keep_shared_places(recorded: &mut Message, computed: &mut Message) -> Vec<UnlikeMeshes> {
    match (recorded, computed) {
        (Message::Displacements(was), Message::Displacements(is)) => keep_shared_nodes(&mut was.nodes, &mut is.nodes),
        (Message::Loads(was), Message::Loads(is)) => {
            keep_like_elements(&mut was.elements, &mut is.elements);
            Vec::new()
        }
        _ => Vec::new(),
    }
}

fn keep_shared_nodes(was: &mut Vec<NodeState>, is: &mut Vec<NodeState>) -> Vec<UnlikeMeshes> {
    let counts = unlike_counts(was.iter().map(|node| node.link.as_str()), is.iter().map(|node| node.link.as_str()));
    // The masses of an oscillator lie along no link.
    let has_both_meshes = |(link, [was, is]): &(String, [u64; 2])| link != "mass" && *was > 1 && *is > 1;
    let meshes = |(link, [was, is]): (String, [u64; 2])| UnlikeMeshes { link, recorded: was - 1, computed: is - 1 };
    let unlike: Vec<UnlikeMeshes> = counts.into_iter().filter(has_both_meshes).map(meshes).collect();
    for UnlikeMeshes { link, recorded, computed } in &unlike {
        was.retain(|node| node.link != *link || is_shared(node.index, *recorded, *computed));
        is.retain(|node| node.link != *link || is_shared(node.index, *computed, *recorded));
        for node in is.iter_mut().filter(|node| node.link == *link) {
            if let Some(shared) = node_at_same_place(u64::from(node.index), *computed, *recorded) {
                node.index = shared as u32;
            }
        }
    }
    unlike
}

/// Whether a mesh of `others` elements has a node at the place of a node in a mesh of `own`.
fn is_shared(index: u32, own: u64, others: u64) -> bool {
    node_at_same_place(u64::from(index), own, others).is_some()
}

fn keep_like_elements(was: &mut Vec<ElementForce>, is: &mut Vec<ElementForce>) {
    let unlike = unlike_counts(was.iter().map(|element| element.link.as_str()), is.iter().map(|element| element.link.as_str()));
    was.retain(|element| !unlike.contains_key(&element.link));
    is.retain(|element| !unlike.contains_key(&element.link));
}

/// The links that occur not as often in one list as in the other, with both counts.
fn unlike_counts<'a>(was: impl Iterator<Item = &'a str>, is: impl Iterator<Item = &'a str>) -> BTreeMap<String, [u64; 2]> {
    let mut counts: BTreeMap<&str, [u64; 2]> = BTreeMap::new();
    was.for_each(|link| counts.entry(link).or_default()[0] += 1);
    is.for_each(|link| counts.entry(link).or_default()[1] += 1);
    counts.into_iter().filter(|(_, [was, is])| was != is).map(|(link, both)| (link.to_owned(), both)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Displacements, Loads};

    /// Nodes of a link, each with its place from 0 to 1 as x.
    fn mesh(link: &str, elements: u32) -> Vec<NodeState> {
        let place = |index: u32| f64::from(index) / f64::from(elements);
        (0..=elements)
            .map(|index| NodeState { link: link.to_owned(), index, x_m: place(index), ..NodeState::default() })
            .collect()
    }

    fn displacements(meshes: &[(&str, u32)]) -> Message {
        let nodes = meshes.iter().flat_map(|(link, elements)| mesh(link, *elements)).collect();
        Message::Displacements(Box::new(Displacements { stamp: None, nodes }))
    }

    fn indices(message: &Message) -> Vec<u32> {
        let Message::Displacements(message) = message else { return Vec::new() };
        message.nodes.iter().map(|node| node.index).collect()
    }

    #[test]
    fn prop_nodes_of_two_meshes_are_compared_at_the_same_places() {
        for (was, is, shared) in [
            (4, 8, vec![0, 1, 2, 3, 4]),
            (8, 4, vec![0, 2, 4, 6, 8]),
            (4, 6, vec![0, 2, 4]),
            (3, 4, vec![0, 3]),
            (5, 1, vec![0, 5]),
        ] {
            let mut recorded = displacements(&[("crank", 2), ("rod", was)]);
            let mut computed = displacements(&[("crank", 2), ("rod", is)]);
            let unlike = keep_shared_places(&mut recorded, &mut computed);
            let expected = UnlikeMeshes { link: "rod".to_owned(), recorded: was.into(), computed: is.into() };
            assert_eq!(unlike, [expected]);
            assert_eq!(indices(&recorded), [vec![0, 1, 2], shared].concat());
            assert_eq!(recorded, computed, "{was} and {is}");
        }
    }

    #[test]
    fn prop_like_meshes_and_masses_are_compared_as_they_are() {
        let alike = [displacements(&[("crank", 2), ("rod", 4)]), displacements(&[("crank", 2), ("rod", 4)])];
        let masses = [displacements(&[("mass", 1)]), displacements(&[("mass", 2)])];
        for [recorded, computed] in [alike, masses] {
            let (mut was, mut is) = (recorded.clone(), computed.clone());
            assert_eq!(keep_shared_places(&mut was, &mut is), []);
            assert_eq!((was, is), (recorded, computed));
        }
    }

    #[test]
    fn prop_forces_in_elements_of_unlike_meshes_are_not_compared() {
        let loads = |links: &[&str]| {
            let elements = links.iter().map(|link| ElementForce { link: (*link).to_owned(), ..ElementForce::default() });
            Message::Loads(Box::new(Loads { elements: elements.collect(), ..Loads::default() }))
        };
        let (mut recorded, mut computed) = (loads(&["crank", "rod"]), loads(&["crank", "rod", "rod"]));
        assert_eq!(keep_shared_places(&mut recorded, &mut computed), []);
        assert_eq!((recorded, computed), (loads(&["crank"]), loads(&["crank"])));
    }
}
