//! Energies and powers of the chain.

use super::chain::Chain;
use super::loads::base_torque_nm;
use super::plane::{Vector, add, add_scaled, dot, quarter};
use crate::mechanics::mechanism::Input;
use crate::mechanics::observation::Energy;

impl<const W: usize> Chain<W> {
    /// Energies of the motion present.
    pub(super) fn energy(&self, q: &[f64]) -> Energy {
        let [tangent, _] = self.tangent();
        let mut energy = Energy {
            kinetic_j: 0.5 * self.tip.mass_kg * dot(self.end.velocity, self.end.velocity),
            strain_j: Some(0.5 * self.base.torsion_spring_nm_per_rad * tangent * tangent),
            potential_j: (self.gravity != [0.0; 2]).then(|| -self.tip.mass_kg * dot(self.gravity, self.end.position)),
        };
        for (link, frame) in self.links.iter().zip(&self.frames) {
            let velocity = |f: usize| add_scaled(link.du[f], frame.chord.rate, quarter(link.u[f]));
            energy.kinetic_j += link.kinetic_j(frame.direction.to_local(frame.first.velocity), velocity);
            if let Some(strain) = &mut energy.strain_j {
                *strain += link.elastic.energy_j(&q[link.own()]) + link.strong.energy_j();
            }
            let means = link.shapes.mean.iter().zip(&link.u);
            let centre = means.fold([0.0; 2], |sum: Vector, (k, u)| add_scaled(sum, *k, *u));
            let centre = add(frame.first.position, frame.direction.to_global(centre));
            if let Some(potential) = &mut energy.potential_j {
                *potential -= link.mass_kg * dot(self.gravity, centre);
            }
        }
        energy
    }

    /// Torque that the prescribed motion needs, from the moments on the first link about the pivot, N·m.
    pub(super) fn motion_torque_nm(&self, input: &Input) -> f64 {
        let [tangent, rate] = self.tangent();
        self.links[0].moment(&self.forces[0].functions) + base_torque_nm(self.base, tangent, rate) - input.torque_nm
    }

    /// Whether rates alone say the power: no prescribed motion, no load on the end.
    pub(super) fn power_follows_from_rates(&self) -> bool {
        !self.is_prescribed() && !self.tip.is_loaded()
    }

    /// The same as [`Chain::power_w`] where [`Chain::power_follows_from_rates`].
    pub(super) fn power_of_rates_w(&self, input: &Input, v: &[f64]) -> [f64; 2] {
        let rate: f64 = self.tangent_row.iter().zip(v).map(|(row, v)| row * v).sum();
        [input.torque_nm * rate, self.damping_w(rate, v)]
    }

    /// Power that the links' damping and the base's take, W.
    fn damping_w(&self, rate: f64, v: &[f64]) -> f64 {
        let links: f64 = self.links.iter().map(|link| link.elastic.dissipation_w(&v[link.own()])).sum();
        links + self.base.damper_nm_s_per_rad * rate * rate
    }

    /// Power put in by torque, prescribed motion and resistance, and power dissipated, W; of prescribed motion
    /// after a residual.
    pub(super) fn power_w(&self, input: &Input, v: &[f64]) -> [f64; 2] {
        let [_, rate] = self.tangent();
        let motion = if self.is_prescribed() { self.motion_torque_nm(input) } else { 0.0 };
        let along = self.end.velocity[0];
        let [resistance, _] = self.tip.resistance(self.frames[0].chord.angle);
        let friction = self.tip.friction_n_s_per_m * along * along;
        [(input.torque_nm + motion) * rate - resistance * along, self.damping_w(rate, v) + friction]
    }
}
