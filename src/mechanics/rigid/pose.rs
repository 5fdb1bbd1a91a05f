//! Places and directions of the bodies at a crank angle.

use crate::mechanics::crank_slider::{Path, Turn, along, crank_turn, rod_turn};
use crate::scene::{Chain, End};

/// A body of the chain at one crank angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body<const D: usize = 3> {
    pub(super) mass_kg: f64,
    pub(super) inertia_kg_m2: f64,
    pub(super) centre: Path<D>,
    pub(super) turn: Turn,
}

/// Everything that depends on the crank angle alone: links, then what hangs on the end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pose<const D: usize = 3> {
    pub(super) bodies: [Body<D>; 3],
    pub(super) links: usize,
    pub(super) end: Path<D>,
}

impl<const D: usize> Pose<D> {
    pub(super) const NONE: Self = Self {
        bodies: [Body { mass_kg: 0.0, inertia_kg_m2: 0.0, centre: [[0.0; 2]; D], turn: Turn::STILL }; 3],
        links: 0,
        end: [[0.0; 2]; D],
    };
}

/// Moves the bodies to a crank angle.
pub(super) fn set_pose<const D: usize>(chain: &Chain, theta_rad: f64, pose: &mut Pose<D>) {
    let crank = crank_turn(theta_rad);
    set_paths(chain, pose, |link| match link {
        0 => crank,
        _ => rod_turn(&crank, chain.links[0].length_m / chain.links[link].length_m),
    });
}

/// Moves the bodies to where the directions of their links lead.
#[inline]
pub(super) fn set_paths<const D: usize>(chain: &Chain, pose: &mut Pose<D>, turn: impl Fn(usize) -> Turn) {
    let mut at = [[0.0; 2]; D];
    for (index, (body, link)) in pose.bodies.iter_mut().zip(&chain.links).enumerate() {
        let turn = turn(index);
        (body.mass_kg, body.inertia_kg_m2, body.turn) = (link.mass_kg, link.inertia_kg_m2, turn);
        body.centre = along(&at, &turn, link.centre_of_mass_m);
        at = along(&at, &turn, link.length_m);
    }
    (pose.links, pose.end) = (chain.links.len(), at);
    if let Some(end) = pose.bodies.get_mut(pose.links) {
        end.centre = at;
        end.mass_kg = match &chain.end {
            End::Free { tip_mass_kg } => *tip_mass_kg,
            End::Slider(slider) => slider.mass_kg,
        };
    }
}
