//! Observation of the chain, from the motion as loaded and the forces that it needs.

use crate::mechanics::rigid_bar::RigidBar;
use nalgebra::Vector2;

use super::FiniteElement;
use super::beam::Beam;
use super::layout::ROOT;
use super::member::{Member, windows};
use super::motion::Window;
use super::strain::cross;
use crate::mechanics::mechanism::Input;
use crate::mechanics::observation::{ElementForces, LinkObservation, NodeObservation, Observation};

/// A link's chord: its first pin, the vector to its last, and their rates.
#[derive(Debug, Clone, Copy)]
struct Chord {
    start: [Vector2<f64>; 3],
    along: [Vector2<f64>; 3],
    /// Direction whose angle counts whole turns, and that angle.
    tangent: (Vector2<f64>, f64),
}

/// Angle from `a` to `b`, −π to π.
fn turn(a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    cross(a, b).atan2(a.dot(b))
}

impl Chord {
    fn angle(&self) -> f64 {
        self.tangent.1 + turn(&self.tangent.0, &self.along[0])
    }

    /// `β̇ = a × ȧ/|a|²`, `β̈ = a × ä/|a|² − 2 β̇ (a·ȧ)/|a|²`.
    fn rates(&self) -> [f64; 2] {
        let [a, da, dda] = &self.along;
        let square = a.norm_squared();
        let rate = cross(a, da) / square;
        [rate, (cross(a, dda) - 2.0 * rate * a.dot(da)) / square]
    }

    fn deflection(&self, position: &Vector2<f64>) -> f64 {
        cross(&self.along[0], &(position - self.start[0])) / self.along[0].norm()
    }
}

impl FiniteElement {
    /// Fills everything.
    pub(super) fn fill(&self, input: &Input, out: &mut Observation) {
        out.links.resize_with(self.members.len(), LinkObservation::default);
        for (i, link) in out.links.iter_mut().enumerate() {
            self.fill_link(i, link);
        }
        let crank_pin = self.layout.pin.map(|_| self.first_pin_force(1));
        out.pivot_n = Some((self.first_pin_force(0) + self.carried(crank_pin)).into());
        out.crank_pin_n = crank_pin.map(Into::into);
        self.fill_slider(out);
        out.motion_torque_nm = input.motion.map(|_| self.motion_torque_nm());
        self.fill_rigid_bars(input, out);
        out.energy = self.energies();
        out.out_of_range = None;
    }

    fn fill_link(&self, i: usize, out: &mut LinkObservation) {
        let chord = self.chord(i);
        out.chord_rad = chord.angle();
        let [rate, acceleration] = chord.rates();
        out.rate_rad_per_s = rate;
        out.acceleration_rad_per_s2 = Some(acceleration);
        out.nodes.resize(self.chain.links[i].elements + 1, NodeObservation::default());
        match &self.members[i] {
            Member::Flexible { beam, first, elements, swapped } => {
                out.elements.resize(*elements, ElementForces::default());
                let mut rotation = chord.tangent.1;
                let mut before = chord.tangent.0;
                for (k, window) in windows(*first, *elements, *swapped).enumerate() {
                    let (x, v) = (window.gather(&self.motion.p), window.gather(&self.motion.v));
                    out.nodes[k] = node(&chord, &x[0], &v[0], rotation);
                    rotation += turn(&before, &x[3]);
                    before = x[3];
                    out.nodes[k + 1] = node(&chord, &x[2], &v[2], rotation);
                    out.elements[k] = self.internal_forces(beam, window);
                }
            }
            _ => {
                let last = (out.nodes.len() - 1) as f64;
                for (k, place) in out.nodes.iter_mut().enumerate() {
                    let share = k as f64 / last;
                    let at = |rate: usize| chord.start[rate] + chord.along[rate] * share;
                    *place = node(&chord, &at(0), &at(1), out.chord_rad);
                    place.deflection_m = None;
                }
            }
        }
    }

    /// Internal forces of rigid links, where `out` has room for them.
    fn fill_rigid_bars(&self, input: &Input, out: &mut Observation) {
        let root_nm = out.motion_torque_nm.unwrap_or(input.torque_nm) - self.base_torque_nm();
        let firsts = [(out.pivot_n, root_nm), (out.crank_pin_n, 0.0)];
        for (i, (seen, (force, moment_nm))) in out.links.iter_mut().zip(firsts).enumerate() {
            if matches!(self.members[i], Member::Flexible { .. }) {
                continue;
            }
            let chord = self.chord(i);
            let [rate_rad_per_s, acceleration_rad_per_s2] = chord.rates();
            let bar = RigidBar {
                length_m: self.chain.links[i].length_m,
                mass_kg: self.chain.links[i].mass_kg,
                angle_rad: chord.angle(),
                rate_rad_per_s,
                acceleration_rad_per_s2,
                first_m_per_s2: (chord.start[2] - self.gravity).into(),
                force_n: force.unwrap_or_default(),
                moment_nm,
            };
            bar.fill(&mut seen.elements);
        }
    }

    fn chord(&self, i: usize) -> Chord {
        let m = &self.motion;
        let all = |slot: usize| [m.p[slot], m.v[slot], m.a[slot]];
        match &self.members[i] {
            Member::Flexible { first, elements, swapped, .. } => {
                let end = all(first + 2 * elements + usize::from(*swapped));
                let start = all(*first);
                let along = std::array::from_fn(|k| end[k] - start[k]);
                Chord { start, along, tangent: (m.p[first + 1], self.polar_angle(first + 1)) }
            }
            Member::Rigid { first, .. } => {
                let along = all(first + 1);
                Chord { start: all(*first), along, tangent: (along[0], self.polar_angle(first + 1)) }
            }
            Member::Guided { first, rod } => {
                let along = rod.along(&self.guided_state(*first).0);
                Chord { start: all(*first), along, tangent: (along[0], along[0].y.atan2(along[0].x)) }
            }
        }
    }

    /// Angle of a link's chord, whole turns counted.
    pub(super) fn chord_rad(&self, i: usize) -> f64 {
        self.chord(i).angle()
    }

    fn polar_angle(&self, slot: usize) -> f64 {
        self.motion.polar(slot).map_or(0.0, |polar| polar.u.y)
    }

    /// Internal forces from the element's own equilibrium: moments from what works on the rotations of its ends, axial and
    /// shear from what works on its stretch as a whole.
    fn internal_forces(&self, beam: &Beam, window: Window) -> ElementForces {
        let (x, elastic, inertia) = self.element_forces(beam, window);
        let whole = |k: usize| elastic[k] + inertia[k];
        let chord = (x[2] - x[0]).normalize();
        ElementForces {
            axial_n: elastic[2].dot(&chord),
            shear_n: cross(&chord, &elastic[2]),
            moment_start_nm: -cross(&x[1], &whole(1)),
            moment_end_nm: cross(&x[3], &whole(3)),
        }
    }

    /// Force that an element needs at one of its slots.
    fn element_force(&self, beam: &Beam, window: Window, k: usize) -> Vector2<f64> {
        let (_, elastic, inertia) = self.element_forces(beam, window);
        elastic[k] + inertia[k]
    }

    /// Force on a link at its first pin, of its own motion alone.
    fn first_pin_force(&self, i: usize) -> Vector2<f64> {
        match &self.members[i] {
            Member::Flexible { beam, first, elements, swapped } => {
                let window = windows(*first, *elements, *swapped).next();
                window.map_or(Vector2::zeros(), |window| self.element_force(beam, window, 0))
            }
            Member::Rigid { first, masses } => self.rigid_forces(*first, masses)[0],
            Member::Guided { .. } => self.guided_forces().map_or(Vector2::zeros(), |guided| guided.pin),
        }
    }

    /// Force that a rigid first link passes down to the pivot.
    fn carried(&self, crank_pin: Option<Vector2<f64>>) -> Vector2<f64> {
        match self.members[0] {
            Member::Flexible { .. } => Vector2::zeros(),
            _ => crank_pin.unwrap_or_default(),
        }
    }

    fn fill_slider(&self, out: &mut Observation) {
        (out.slider_pin_n, out.guide_n, out.resistance_n) = (None, None, None);
        if self.end.resistance.is_none() {
            return;
        }
        let weight_y = self.end.mass_kg * self.gravity.y;
        let pin = match (self.guided_forces(), self.members.last()) {
            (Some(guided), _) => Vector2::new(guided.slider_x, -guided.rod_end_y),
            (None, Some(Member::Flexible { beam, first, elements, swapped })) => {
                let window = windows(*first, *elements, *swapped).last();
                -window.map_or(Vector2::zeros(), |window| self.element_force(beam, window, 2))
            }
            _ => return,
        };
        out.slider_pin_n = Some(pin.into());
        out.guide_n = Some(-pin.y - weight_y);
        out.resistance_n = Some(self.resistance_n());
    }

    /// Torque that the prescribed motion needs.
    pub(super) fn motion_torque_nm(&self) -> f64 {
        self.forces[ROOT].y + self.base_torque_nm()
    }
}

fn node(chord: &Chord, position: &Vector2<f64>, velocity: &Vector2<f64>, rotation: f64) -> NodeObservation {
    NodeObservation {
        position_m: (*position).into(),
        velocity_m_per_s: (*velocity).into(),
        rotation_rad: Some(rotation),
        deflection_m: Some(chord.deflection(position)),
    }
}
