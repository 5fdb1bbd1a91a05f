//! Energies and powers of the chain.

use nalgebra::Vector2;

use super::FiniteElement;
use super::member::{Member, hub, windows};
use super::motion::Window;
use super::rigid::{self, Masses};
use crate::mechanics::mechanism::Input;
use crate::mechanics::observation::Energy;

impl FiniteElement {
    /// Energies for the motion as loaded.
    pub(super) fn energies(&self) -> Energy {
        let m = &self.motion;
        let mut kinetic_j = 0.0;
        let mut strain_j = 0.5 * self.chain.base.torsion_spring_nm_per_rad * m.root().u.y.powi(2);
        let has_weight = self.gravity != Vector2::zeros();
        let mut moment = Vector2::zeros(); // ∫ r dm
        for member in &self.members {
            match member {
                Member::Flexible { beam, first, elements, swapped } => {
                    for window in windows(*first, *elements, *swapped) {
                        let (x, v) = (window.gather(&m.p), window.gather(&m.v));
                        let momentum = beam.inertia(&v);
                        kinetic_j += 0.5 * (0..4).map(|k| v[k].dot(&momentum[k])).sum::<f64>();
                        strain_j += beam.strain_energy_j(&x);
                        if has_weight {
                            let weighted = beam.inertia(&x);
                            moment += weighted[0] + weighted[2];
                        }
                    }
                    strain_j += hub(*first, *elements, *swapped).map_or(0.0, |window| beam.hub_energy_j(&window.gather(&m.p)));
                }
                Member::Rigid { first, masses } => {
                    kinetic_j += rigid::kinetic_j(masses, &m.v[*first], &m.v[first + 1]);
                    moment += first_moment(masses, &m.p[*first], &m.p[first + 1]);
                }
                Member::Guided { first, rod } => {
                    let [a, da, _] = rod.along(&self.guided_state(*first).0);
                    kinetic_j += rigid::kinetic_j(&rod.masses, &m.v[*first], &da);
                    moment += first_moment(&rod.masses, &m.p[*first], &a);
                }
            }
        }
        if let Some([p, v]) = self.end_point() {
            kinetic_j += 0.5 * self.end.mass_kg * v.norm_squared();
            moment += p * self.end.mass_kg;
        }
        Energy { kinetic_j, strain_j: Some(strain_j), potential_j: has_weight.then(|| -self.gravity.dot(&moment)) }
    }

    /// Position and velocity of the point mass at the end, unless a rigid link has taken it in.
    fn end_point(&self) -> Option<[Vector2<f64>; 2]> {
        if let Some(end) = self.layout.end {
            return Some([self.motion.p[end], self.motion.v[end]]);
        }
        let Some(Member::Guided { first, rod }) = self.members.last() else { return None };
        let [a, da, _] = rod.along(&self.guided_state(*first).0);
        Some([self.motion.p[*first] + a, self.motion.v[*first] + da])
    }

    /// Whether power is torque times rate: no prescribed motion, no damping, no load on the slider.
    pub(super) fn only_torque_works(&self) -> bool {
        let damped = |member: &Member| matches!(member, Member::Flexible { beam, .. } if beam.damped());
        self.chain.base.damper_nm_s_per_rad == 0.0 && !self.end.is_loaded() && !self.members.iter().any(damped)
    }

    /// `[power put in, power dissipated]`.
    pub(super) fn powers(&self, input: &Input) -> [f64; 2] {
        let rate = self.motion.root().du.y;
        let torque = if input.motion.is_some() { self.motion_torque_nm() } else { input.torque_nm };
        let slide = self.end_point().map_or(0.0, |[_, v]| v.x);
        let mut dissipated = self.chain.base.damper_nm_s_per_rad * rate.powi(2) + self.end.friction_n_s_per_m * slide.powi(2);
        for member in &self.members {
            if let Member::Flexible { beam, first, elements, swapped } = member {
                let vectors = |window: Window| (window.gather(&self.motion.p), window.gather(&self.motion.v));
                let each = windows(*first, *elements, *swapped).map(vectors).map(|(x, v)| beam.dissipation_w(&x, &v));
                let hub = hub(*first, *elements, *swapped).map(vectors).map(|(x, v)| beam.hub_dissipation_w(&x, &v));
                dissipated += each.chain(hub).sum::<f64>();
            }
        }
        [torque * rate - self.resistance_n() * slide, dissipated]
    }
}

/// `∫ r dm` of a rigid link.
fn first_moment(m: &Masses, p: &Vector2<f64>, a: &Vector2<f64>) -> Vector2<f64> {
    p * m[0][0] + a * m[0][1]
}
