//! The state at t = 0.

use super::fitted::Fitted;
use crate::mechanics::equilibrium::{Pivot, second_link_rad, settle};
use crate::mechanics::mechanism::{Input, NoEquilibrium};

impl<const W: usize> Fitted<W> {
    /// Straight links moving as rigid bodies, at the angle and rate of the scene or of the prescribed motion; bent as static
    /// equilibrium asks, where the scene wants that.
    pub(super) fn set_start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium> {
        let start = self.scene.start;
        let [angle, rate, _] = input.motion.unwrap_or([start.angle_rad, start.rate_rad_per_s, 0.0]);
        for (k, is_angle) in self.chain.is_angle.iter().enumerate() {
            (q[k], v[k]) = if *is_angle { (angle, rate) } else { (0.0, 0.0) };
        }
        match Pivot::of(&self.scene, input) {
            _ if !start.static_equilibrium => Ok(()),
            Pivot::Free => settle(self, input, q, Self::largest_turn),
            Pivot::Held => self.bend(angle, q),
        }
    }

    /// Static equilibrium with the tangent at the pivot held, which leaves the chain all coordinates but its first chord angle.
    fn bend(&self, angle: f64, q: &mut [f64]) -> Result<(), NoEquilibrium> {
        let mut held = Self::new(&self.scene, true);
        let second = second_link_rad(&self.scene, angle);
        let mut bent: Vec<f64> = held.chain.is_angle.iter().map(|is_angle| if *is_angle { second } else { 0.0 }).collect();
        settle(&mut held, &Input { motion: Some([angle, 0.0, 0.0]), ..Input::default() }, &mut bent, Self::largest_turn)?;
        let own = q.len() - bent.len();
        q[own..].copy_from_slice(&bent);
        if let [chord] = &mut q[..own] {
            let root = &self.chain.links[0];
            let turns = root.shapes.root_slope.iter().zip(&bent).map(|(slope, eta)| slope / root.shapes.length_m * eta);
            *chord = angle - turns.sum::<f64>();
        }
        Ok(())
    }

    /// Largest turn of a chord, or of a bent link's tangent at its first pin, by changes `x` of the coordinates.
    fn largest_turn(&self, x: &[f64]) -> f64 {
        let chords = x.iter().zip(&self.chain.is_angle).filter(|(_, is_angle)| **is_angle).map(|(x, _)| x.abs());
        let tangents = self.chain.links.iter().flat_map(|link| {
            let slopes = link.shapes.root_slope.iter().zip(&x[link.at..]);
            slopes.map(|(slope, x)| (slope / link.shapes.length_m * x).abs())
        });
        chords.chain(tangents).fold(0.0, most)
    }
}

/// The larger; not a number if either is not.
fn most(a: f64, b: f64) -> f64 {
    if b <= a { a } else { b }
}
