//! Names of the unknowns.

use super::FiniteElement;
use super::member::{Member, windows};
use crate::mechanics::mechanism::Coordinate;
use crate::scene::Link;

impl FiniteElement {
    /// The unknowns by name, such as `rod_node_3_x_m` and `rod_node_3_slope_y`.
    pub(super) fn named_coordinates(&self) -> Vec<Coordinate> {
        let mut slots: Vec<Option<[Coordinate; 2]>> = vec![None; self.layout.slots()];
        for (member, link) in self.members.iter().zip(&self.chain.links) {
            match member {
                Member::Flexible { first, elements, swapped, .. } => {
                    slots[first + 1] = Some(root(link));
                    for (k, window) in windows(*first, *elements, *swapped).enumerate() {
                        let last = usize::from(window.swapped);
                        let (place, slope) = (window.first + 2 + last, window.first + 3 - last);
                        slots[place] = Some(position(link, k + 1));
                        slots[slope] = Some(tangent(link, k + 1));
                    }
                }
                Member::Rigid { first, .. } => slots[first + 1] = Some(root(link)),
                Member::Guided { .. } => {}
            }
        }
        let of = |place: &usize| slots[place / 2].as_ref().map(|pair| pair[place % 2].clone());
        self.layout.active.iter().filter_map(of).collect()
    }
}

fn position(link: &Link, node: usize) -> [Coordinate; 2] {
    let element_m = link.length_m / link.elements as f64;
    ["x", "y"].map(|axis| Coordinate::displacement(format!("{}_node_{node}_{axis}_m", link.name.as_str()), element_m))
}

fn tangent(link: &Link, node: usize) -> [Coordinate; 2] {
    ["x", "y"].map(|axis| Coordinate::turn(format!("{}_node_{node}_slope_{axis}", link.name.as_str())))
}

/// The tangent at the first pin in polar coordinates: its stretch and its angle.
fn root(link: &Link) -> [Coordinate; 2] {
    ["node_0_slope", "angle_rad"].map(|what| Coordinate::turn(format!("{}_{what}", link.name.as_str())))
}
