//! A chain as if its links were rigid, with the angles that say where it is.

use std::f64::consts::{PI, TAU};

use super::{CarriedTurn, Course, Rigid, TwoLinks};
use crate::mechanics::mechanism::ROTATIONS;
use crate::scene::Chain;

/// A rigid chain whose motion is free.
#[derive(Debug, Clone)]
pub enum RigidChain {
    /// The first link's angle says where it is: a crank-slider, or one link.
    OneAngle(Box<Rigid>),
    /// Each of two links has an angle of its own.
    TwoLinks(TwoLinks),
}

impl RigidChain {
    /// Of this chain.
    pub fn new(chain: &Chain) -> Self {
        TwoLinks::new(chain).map_or_else(|| RigidChain::OneAngle(Box::new(Rigid::new(chain, false))), RigidChain::TwoLinks)
    }

    /// Number of angles that say where it is.
    pub fn rotations(&self) -> usize {
        match self {
            RigidChain::OneAngle(_) => 1,
            RigidChain::TwoLinks(_) => ROTATIONS,
        }
    }

    /// The angles by which its links turn in a small change, rad, from the part that each link's turn has in it: see
    /// [`Mechanism::turn_part`](crate::mechanics::Mechanism::turn_part).
    pub fn turned(&self, links: [[f64; 2]; ROTATIONS], parts: [f64; ROTATIONS]) -> [f64; ROTATIONS] {
        match self {
            RigidChain::OneAngle(_) => parts,
            RigidChain::TwoLinks(two) => two.turned(links, parts),
        }
    }

    /// Whether its resistance has corners.
    pub fn has_corners(&self) -> bool {
        matches!(self, RigidChain::OneAngle(rigid) if rigid.has_corners())
    }

    /// Error of the first link's rate by corners of the resistance that it passes in a step, rad/s, from its angle, rad, and rate, rad/s,
    /// before and after it, and from the scheme's error of a corner at a part of the step: see
    /// [`Integrator::corner_error`](crate::integrate::Integrator::corner_error).
    pub fn corner_error(&self, step_s: f64, [from, to]: [[f64; 2]; 2], of_scheme: impl Fn(f64) -> f64) -> f64 {
        let RigidChain::OneAngle(rigid) = self else { return 0.0 };
        // Angles of finite elements may lack whole turns.
        let turned = (to[0] - from[0] + PI).rem_euclid(TAU) - PI;
        let to = [from[0] + turned, to[1]];
        rigid.corners(from, to).map(|(part, jump)| of_scheme(part) * jump * step_s * step_s).sum()
    }

    /// Its own motion at an angle, rad, and rate, rad/s, of the first link; `None` if a second one turns by itself.
    pub fn course(&self, [angle_rad, rate_rad_per_s]: [f64; 2]) -> Option<Course> {
        match self {
            RigidChain::OneAngle(rigid) => Some(rigid.course(angle_rad, rate_rad_per_s)),
            RigidChain::TwoLinks(_) => None,
        }
    }

    /// The growth of small errors over `step_s` about angles, rad, and rates, rad/s, under a torque at the base.
    pub fn carried_turn(&self, step_s: f64, links: [[f64; 2]; ROTATIONS], torque_nm: f64) -> CarriedTurn {
        match self {
            RigidChain::OneAngle(rigid) => rigid.carried_turn(step_s, links, torque_nm),
            RigidChain::TwoLinks(two) => two.carried_turn(step_s, links, torque_nm),
        }
    }
}
