//! `r = M a + g − p`: forces of all members on their slots, projected on the unknowns.

use nalgebra::Vector2;

use super::FiniteElement;
use super::beam::{Beam, Four};
use super::layout::{Kind, Layout};
use super::member::{Member, hub, windows};
use super::motion::Window;
use super::rigid::{GuidedForces, Masses, PinMotion, SliderLoad};
use crate::mechanics::mechanism::Input;

/// The largest force and moment at work before they balance.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Work {
    force_n: f64,
    moment_nm: f64,
}

impl Work {
    /// Error of the members' forces by rounding of positions.
    pub(super) fn rounding(members: &[Member], reach_m: f64) -> Self {
        let mut most = Self::default();
        for member in members {
            if let Member::Flexible { beam, .. } = member {
                let [force_n, moment_nm] = beam.rounding(reach_m);
                most.take(force_n, moment_nm);
            }
        }
        most
    }

    #[inline]
    fn take(&mut self, force_n: f64, moment_nm: f64) {
        self.force_n = larger(force_n, self.force_n);
        self.moment_nm = larger(moment_nm, self.moment_nm);
    }

    #[inline]
    fn take_element(&mut self, f: &Four) {
        let [p, t, q, u] = f.map(|f| larger(f.x.abs(), f.y.abs()));
        self.take(larger(p, q), larger(t, u));
    }

    /// Largest of `r` beyond rounding, relative to the forces at work, per kind.
    pub(super) fn relative(&self, rounding: &Self, layout: &Layout, r: &[f64]) -> f64 {
        let mut largest = Self::default();
        for (value, place) in r.iter().zip(&layout.active) {
            match layout.kinds[place / 2] {
                Kind::Position => largest.force_n = larger(value.abs(), largest.force_n),
                Kind::Direction => largest.moment_nm = larger(value.abs(), largest.moment_nm),
            }
        }
        let ratio = |largest: f64, rounding: f64, work: f64| match largest - rounding {
            beyond if beyond > 0.0 => beyond / work,
            _ => 0.0,
        };
        let force = ratio(largest.force_n, rounding.force_n, self.force_n);
        force.max(ratio(largest.moment_nm, rounding.moment_nm, self.moment_nm))
    }
}

/// The larger of two, the second if the first is no number: an instruction where [`f64::max`] takes five.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

impl FiniteElement {
    /// Fills `forces` and `work` for the motion as loaded, without what acts at the base.
    pub(super) fn add_forces(&mut self) {
        self.forces.fill(Vector2::zeros());
        self.work = Work::default();
        for i in 0..self.members.len() {
            self.add_member(i);
        }
        self.add_end();
        for polar in &mut self.motion.polars {
            polar.force = self.forces[polar.slot];
            self.forces[polar.slot] = polar.polar.force(&polar.force);
        }
    }

    fn add_member(&mut self, i: usize) {
        let motion = &self.motion;
        match &self.members[i] {
            Member::Flexible { beam, first, elements, swapped } => {
                for window in windows(*first, *elements, *swapped) {
                    let (_, elastic, inertia) = self.plain_forces(beam, window);
                    self.work.take_element(&elastic);
                    self.work.take_element(&inertia);
                    window.add(&mut self.forces, std::array::from_fn(|k| elastic[k] + inertia[k]));
                }
                if let Some(window) = hub(*first, *elements, *swapped) {
                    window.add(&mut self.forces, beam.hub_force(&window.gather(&motion.p), &window.gather(&motion.v)));
                }
            }
            Member::Rigid { first, masses } => {
                let [p, a] = self.rigid_forces(*first, masses);
                let length_m = motion.p[first + 1].norm();
                self.work.take(p.amax().max(a.amax()), a.amax() * length_m);
                self.forces[*first] += p;
                self.forces[first + 1] += a;
            }
            Member::Guided { first, .. } => {
                let Some(guided) = self.guided_forces() else { return };
                let length_m = self.chain.links[0].length_m;
                self.work.take(guided.pin.amax(), guided.pin.amax() * length_m);
                self.forces[*first] += guided.pin;
            }
        }
    }

    /// An element's vectors, its elastic forces (with damping), and its inertia forces (with gravity).
    pub(super) fn element_forces(&self, beam: &Beam, window: Window) -> (Four, Four, Four) {
        let (x, elastic, inertia) = self.plain_forces(beam, window);
        if !window.at_hub() {
            return (x, elastic, inertia);
        }
        let hub = beam.hub_force(&x, &window.gather(&self.motion.v));
        (x, std::array::from_fn(|k| elastic[k] + hub[k]), inertia)
    }

    /// The same without what the hub adds.
    #[inline]
    fn plain_forces(&self, beam: &Beam, window: Window) -> (Four, Four, Four) {
        let (x, dx) = (window.gather(&self.motion.p), window.gather(&self.motion.v));
        let mut a = window.gather(&self.motion.a);
        a[0] -= self.gravity;
        a[2] -= self.gravity;
        (x, beam.force(&x, &dx), beam.inertia(&a))
    }

    /// Forces on a rigid link's `p` and `a`.
    pub(super) fn rigid_forces(&self, first: usize, m: &Masses) -> [Vector2<f64>; 2] {
        let (p, a) = (self.motion.a[first] - self.gravity, self.motion.a[first + 1]);
        m.map(|row| p * row[0] + a * row[1])
    }

    /// Motion of the pin that a rigid rod to a slider hangs on, and the slider's load.
    pub(super) fn guided_state(&self, first: usize) -> (PinMotion, SliderLoad) {
        let m = &self.motion;
        let pin = PinMotion { p: m.p[first], dp: m.v[first], ddp: m.a[first], gravity: self.gravity };
        let (resistance_n, resistance_slope) = self.end.resistance(&pin.p);
        let (mass_kg, friction_n_s_per_m) = (self.end.mass_kg, self.end.friction_n_s_per_m);
        (pin, SliderLoad { mass_kg, friction_n_s_per_m, resistance_n, resistance_slope })
    }

    /// Forces of a rigid rod to a slider, if there is one.
    pub(super) fn guided_forces(&self) -> Option<GuidedForces> {
        let Some(Member::Guided { first, rod }) = self.members.last() else { return None };
        let (pin, load) = self.guided_state(*first);
        Some(rod.forces(&pin, &load))
    }

    /// Slider or tip mass at the end of a flexible link.
    fn add_end(&mut self) {
        let Some(end) = self.layout.end else { return };
        let mut force = (self.motion.a[end] - self.gravity) * self.end.mass_kg;
        force.x += self.end.friction_n_s_per_m * self.motion.v[end].x + self.resistance_n();
        self.work.take(force.amax(), 0.0);
        self.forces[end] += force;
    }

    /// Resistance on the slider at present.
    pub(super) fn resistance_n(&self) -> f64 {
        self.layout.pin.map_or(0.0, |pin| self.end.resistance(&self.motion.p[pin]).0)
    }

    /// Torque of the base's spring and damper on the root, taken to the equation's left.
    pub(super) fn base_torque_nm(&self) -> f64 {
        let (base, root) = (&self.chain.base, self.motion.root());
        base.torsion_spring_nm_per_rad * root.u.y + base.damper_nm_s_per_rad * root.du.y
    }

    /// `forces` as the unknowns feel them, with torque, spring and damper at the base.
    pub(super) fn project(&mut self, input: &Input, r: &mut [f64]) {
        let base_nm = self.base_torque_nm();
        self.at_work = self.work;
        self.at_work.take(0.0, base_nm.abs().max(input.torque_nm.abs()));
        for (value, &place) in r.iter_mut().zip(&self.layout.active) {
            *value = self.forces[place / 2][place % 2];
        }
        if let Some(root) = self.layout.root {
            r[root] += base_nm - input.torque_nm;
        }
    }
}
