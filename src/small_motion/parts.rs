//! The parts of a mechanism that store strain energy, each with its share of the stiffness.

use super::band::Band;
use super::linearised::tangent;
use super::point::Point;
use super::subject::Subject;
use crate::mechanics::{Mechanism, Weights};
use crate::scene::LinkName;

/// A part that stores strain energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// Bending of a link.
    Bending(LinkName),
    /// Stretching of a link.
    Stretching(LinkName),
    /// The torsion spring of the base.
    Base,
}

/// The stiffness of every part at a point. The residual is linear in each stiffness of the scene, so that doubling one of them adds
/// exactly its part:
///
/// ```text
/// K_bending = K(2J) − K      K_stretching = K(2E) − K − K_bending      K_base = K(2k) − K
/// ```
///
/// Dampers are left out.
pub(super) struct Parts {
    /// The model without dampers, and with one of its stiffnesses doubled.
    undamped: Box<dyn Mechanism>,
    doubled: Vec<(Part, Box<dyn Mechanism>)>,
}

impl Parts {
    pub(super) fn new(subject: &Subject) -> Self {
        let undamped = |chain: &mut crate::scene::Chain| chain.links.iter_mut().for_each(|link| link.damping_s = 0.0);
        let mut doubled = Vec::new();
        let links = subject.chain().map(|chain| chain.links.clone()).unwrap_or_default();
        for (i, link) in links.iter().enumerate().filter(|(_, link)| !link.rigid && link.bar.is_some()) {
            let change = |change: fn(&mut crate::scene::Bar)| {
                subject.changed(|chain| {
                    undamped(chain);
                    chain.links[i].bar.iter_mut().for_each(change);
                })
            };
            doubled.push((Part::Bending(link.name), change(|bar| bar.second_moment_m4 *= 2.0)));
            doubled.push((Part::Stretching(link.name), change(|bar| bar.youngs_modulus_pa *= 2.0)));
        }
        if subject.chain().is_some_and(|chain| chain.base.torsion_spring_nm_per_rad > 0.0) {
            let sprung = subject.changed(|chain| {
                undamped(chain);
                chain.base.torsion_spring_nm_per_rad *= 2.0;
            });
            doubled.push((Part::Base, sprung));
        }
        Parts { undamped: subject.changed(undamped), doubled }
    }

    /// Each part's stiffness at a point.
    pub(super) fn stiffness(&mut self, point: &Point) -> Vec<(Part, Band)> {
        let position = Weights { acceleration: 0.0, velocity: 0.0, position: 1.0 };
        let whole = tangent(self.undamped.as_mut(), point, position);
        let mut parts: Vec<(Part, Band)> = Vec::new();
        for (part, mechanism) in &mut self.doubled {
            let mut own = tangent(mechanism.as_mut(), point, position).combine(1.0, &whole, -1.0);
            if let (Part::Stretching(_), Some((_, bending))) = (*part, parts.last()) {
                own = own.combine(1.0, bending, -1.0);
            }
            parts.push((*part, own));
        }
        parts
    }
}
