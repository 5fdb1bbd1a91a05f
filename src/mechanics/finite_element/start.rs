//! The state at t = 0.

use nalgebra::Vector2;

use super::FiniteElement;

use super::layout::Kind;
use super::member::{Member, windows};
use super::strain::left;
use crate::mechanics::mechanism::{Input, Mechanism, Weights};
use crate::scene::End;

/// Most iterations towards static equilibrium.
const ITERATIONS: usize = 400;
/// Most that a tangent may turn in one of them, rad.
const MOST_TURN: f64 = 0.2;
/// Beyond this the inertia of a step is nothing.
const LONGEST_STEP_S: f64 = 1e4;
/// Residual, relative to the forces at work, at which it is reached.
const TOLERANCE: f64 = 1e-11;

impl FiniteElement {
    /// Straight links, or bent by static loads, each moving as a rigid body.
    pub(super) fn set_start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) {
        let start = self.chain.start;
        let [angle, rate, _] = input.motion.unwrap_or([start.angle_rad, start.rate_rad_per_s, 0.0]);
        self.place_straight(angle);
        if start.static_equilibrium {
            self.bend(angle);
        }
        self.set_rates(rate);
        for (i, &place) in self.layout.active.iter().enumerate() {
            let (slot, component) = (place / 2, place % 2);
            (q[i], v[i]) = (self.motion.p[slot][component], self.motion.v[slot][component]);
        }
        for polar in &self.motion.polars {
            for (i, &place) in self.layout.active.iter().enumerate() {
                if place / 2 == polar.slot {
                    (q[i], v[i]) = (polar.polar.u[place % 2], polar.polar.du[place % 2]);
                }
            }
        }
    }

    /// Positions and tangents of straight links.
    fn place_straight(&mut self, angle: f64) {
        let mut pin: Vector2<f64> = Vector2::zeros();
        let mut angle = angle;
        for i in 0..self.members.len() {
            let length_m = self.chain.links[i].length_m;
            if let (1, End::Slider(_)) = (i, &self.chain.end) {
                angle = (-pin.y / length_m).asin();
            }
            let along = Vector2::new(angle.cos(), angle.sin());
            let m = &mut self.motion;
            match &self.members[i] {
                Member::Flexible { first, elements, swapped, .. } => {
                    for (k, window) in windows(*first, *elements, *swapped).enumerate() {
                        let at = |k: usize| pin + along * (length_m * k as f64 / *elements as f64);
                        window.set(&mut m.p, [at(k), along, at(k + 1), along]);
                    }
                    m.set_polar(first + 1, Vector2::new(1.0, angle));
                }
                Member::Rigid { first, .. } => {
                    m.p[first + 1] = along * length_m;
                    m.set_polar(first + 1, Vector2::new(length_m, angle));
                }
                Member::Guided { .. } => {}
            }
            pin += along * length_m;
        }
        if let (Some(end), End::Slider(_)) = (self.layout.end, &self.chain.end) {
            self.motion.p[end].y = 0.0;
        }
    }

    /// Static equilibrium with the root held: steps of implicit Euler without memory, each twice as long as the last unless it
    /// would turn a tangent too far, so that they begin as a careful descent and end as Newton's iteration.
    fn bend(&mut self, angle: f64) {
        let mut held = Self::new(&self.chain, true);
        let input = Input { motion: Some([angle, 0.0, 0.0]), ..Input::default() };
        held.motion.clone_from(&self.motion);
        let n = held.degrees_of_freedom();
        let (mut q, zero, mut x) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        held.store(&mut q);
        let mut step_s: f64 = 1e-3;
        for _ in 0..ITERATIONS {
            held.residual(&input, &q, &zero, &zero, &mut x);
            let w = Weights { acceleration: step_s.powi(-2), velocity: 0.0, position: 1.0 };
            if held.residual_size(&x) <= TOLERANCE || held.factor(&input, &q, &zero, &zero, w).is_err() {
                break;
            }
            held.solve(&mut x);
            if held.largest_turn(&x) > MOST_TURN {
                step_s *= 0.25;
                continue;
            }
            step_s = (step_s * 2.0).min(LONGEST_STEP_S);
            for (q, x) in q.iter_mut().zip(&x) {
                *q -= x;
            }
        }
        held.motion.load(&held.layout, &input, &q, &zero, &zero);
        self.motion.clone_from(&held.motion);
    }

    /// Largest change of a direction among the changes `x` of the unknowns.
    fn largest_turn(&self, x: &[f64]) -> f64 {
        let turns = self.layout.active.iter().zip(x).filter(|(place, _)| self.layout.kinds[**place / 2] == Kind::Direction);
        turns.fold(0.0, |most, (_, x)| x.abs().max(most))
    }

    fn store(&self, q: &mut [f64]) {
        for (value, &place) in q.iter_mut().zip(&self.layout.active) {
            let (slot, component) = (place / 2, place % 2);
            *value = match self.motion.polar(slot) {
                Some(polar) => polar.u[component],
                None => self.motion.p[slot][component],
            };
        }
    }

    /// Velocities as if every link were rigid in its present shape, the first turning at `rate`.
    fn set_rates(&mut self, rate: f64) {
        let mut pin: [Vector2<f64>; 2] = [Vector2::zeros(); 2];
        let mut rate = rate;
        for i in 0..self.members.len() {
            let Some(first) = (match &self.members[i] {
                Member::Flexible { first, .. } | Member::Rigid { first, .. } => Some(*first),
                Member::Guided { .. } => None,
            }) else {
                break;
            };
            let m = &mut self.motion;
            if let (1, End::Slider(_), Some(end)) = (i, &self.chain.end, self.layout.end) {
                rate = -pin[1].y / (m.p[end].x - pin[0].x);
            }
            match &self.members[i] {
                Member::Flexible { elements, swapped, .. } => {
                    for window in windows(first, *elements, *swapped) {
                        let x = window.gather(&m.p);
                        let at = |x: &Vector2<f64>| pin[1] + left(&(x - pin[0])) * rate;
                        window.set(&mut m.v, [at(&x[0]), left(&x[1]) * rate, at(&x[2]), left(&x[3]) * rate]);
                    }
                    let end = first + 2 * elements + usize::from(*swapped);
                    pin = [m.p[end], m.v[end]];
                }
                _ => {
                    let a = m.p[first + 1];
                    m.v[first + 1] = left(&a) * rate;
                    pin = [pin[0] + a, pin[1] + left(&a) * rate];
                }
            }
            m.set_polar_rate(first + 1, rate);
        }
    }
}
