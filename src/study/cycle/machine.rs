//! The rigid crank-slider at a given crank angle.

use crate::mechanics::crank_slider::moving;
use crate::mechanics::{Input, LinkObservation, Mechanism as _, Observation, Rigid};
use crate::scene::Chain;

/// A crank-slider whose crank moves as prescribed.
pub(super) struct Machine {
    rigid: Rigid,
    seen: Observation,
}

/// The state at one angle, in SI units. Triples are a value, its rate and its acceleration.
pub(super) struct CycleInstant {
    pub crank: [f64; 3],
    /// Angle φ below the x axis.
    pub rod: [f64; 3],
    pub piston: [f64; 3],
    pub centre: [[f64; 2]; 3],
    /// Ground on crank.
    pub o: [f64; 2],
    /// Crank on rod.
    pub a: [f64; 2],
    /// Rod on slider.
    pub e: [f64; 2],
    pub guide: f64,
    pub resistance: f64,
    pub shaking: [f64; 2],
    pub torque: f64,
    pub kinetic: f64,
    /// Inertia of the mechanism at the crank: `2 T` at unit rate.
    pub inertia: f64,
}

impl CycleInstant {
    /// Magnitude of the shaking force.
    pub fn shaking_force(&self) -> f64 {
        self.shaking[0].hypot(self.shaking[1])
    }
}

impl Machine {
    pub fn new(chain: &Chain) -> Self {
        let links = vec![LinkObservation::default(); chain.links.len()];
        Machine { rigid: Rigid::new(chain, true), seen: Observation { links, ..Observation::default() } }
    }

    /// At a crank angle, rate and acceleration.
    ///
    /// The forces on the frame, `−O`, `−guide`, and the gas's on its head, `+F_E`, add up to minus the mass times the
    /// acceleration of its centre, but for weight: that is the shaking force.
    pub fn at(&mut self, crank: [f64; 3]) -> CycleInstant {
        let [angle, rate, acceleration] = crank;
        self.rigid.observe(&Input { motion: Some(crank), ..Input::default() }, &[], &[], &[], &mut self.seen);
        let seen = &self.seen;
        let rod =
            seen.links.last().map(|rod| [rod.chord_rad, rod.rate_rad_per_s, rod.acceleration_rad_per_s2.unwrap_or_default()]);
        let (mass, path) = self.rigid.centre_of_mass(angle);
        let centre = moving(&path, rate, acceleration);
        CycleInstant {
            crank,
            rod: rod.unwrap_or_default().map(|value| -value),
            piston: moving(&self.rigid.end(angle), rate, acceleration).map(|[x, _]| x),
            centre,
            o: seen.pivot_n.unwrap_or_default(),
            a: seen.crank_pin_n.unwrap_or_default(),
            e: seen.slider_pin_n.unwrap_or_default(),
            guide: seen.guide_n.unwrap_or_default(),
            resistance: seen.resistance_n.unwrap_or_default(),
            shaking: centre[2].map(|acceleration| -mass * acceleration),
            torque: seen.motion_torque_nm.unwrap_or_default(),
            kinetic: seen.energy.kinetic_j,
            inertia: self.rigid.inertia_kg_m2(angle),
        }
    }
}
