//! The state at t = 0.

use nalgebra::Vector2;

use super::FiniteElement;
use super::layout::Kind;
use super::member::{Member, windows};
use super::motion::Motion;
use super::polar::Polar;
use super::strain::left;
use crate::mechanics::equilibrium::{Pivot, second_link_rad, settle};
use crate::mechanics::mechanism::{Input, Mechanism, NoEquilibrium};
use crate::scene::End;

impl FiniteElement {
    /// Straight links, or bent by static loads, each moving as a rigid body.
    pub(super) fn set_start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium> {
        let start = self.chain.start;
        let [angle, rate, _] = input.motion.unwrap_or([start.angle_rad, start.rate_rad_per_s, 0.0]);
        self.place_straight([angle; 2]);
        if start.static_equilibrium {
            self.bend(input, angle)?;
        }
        self.set_rates(rate);
        self.store(|motion| &motion.p, |polar| polar.u, q);
        self.store(|motion| &motion.v, |polar| polar.du, v);
        Ok(())
    }

    /// Positions and tangents of straight links; a second one that ends on the slider has the angle that brings it there.
    fn place_straight(&mut self, angles: [f64; 2]) {
        let mut pin: Vector2<f64> = Vector2::zeros();
        for (i, mut angle) in (0..self.members.len()).zip(angles) {
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

    /// Static equilibrium, with the root held at `angle` or turned to where the base spring balances the chain.
    fn bend(&mut self, input: &Input, angle: f64) -> Result<(), NoEquilibrium> {
        let held = Pivot::of(&self.chain, input) == Pivot::Held;
        let mut bent = Self::new(&self.chain, held);
        if held {
            self.place_straight([angle, second_link_rad(&self.chain, angle)]);
        }
        let input = if held { Input { motion: Some([angle, 0.0, 0.0]), ..Input::default() } } else { *input };
        bent.motion.clone_from(&self.motion);
        let mut q = vec![0.0; bent.degrees_of_freedom()];
        let still = q.clone();
        bent.store(|motion| &motion.p, |polar| polar.u, &mut q);
        settle(&mut bent, &input, &mut q, Self::largest_turn)?;
        bent.motion.load(&bent.layout, &input, &q, &still, &still);
        self.motion.clone_from(&bent.motion);
        Ok(())
    }

    /// Largest change of a direction among the changes `x` of the unknowns.
    fn largest_turn(&self, x: &[f64]) -> f64 {
        let turns = self.layout.active.iter().zip(x).filter(|(place, _)| self.layout.kinds[**place / 2] == Kind::Direction);
        turns.fold(0.0, |most, (_, x)| if x.abs() <= most { most } else { x.abs() })
    }

    /// Coordinates, or their rates, from `all` slots and from the `polar` ones.
    pub(super) fn store(&self, all: fn(&Motion) -> &[Vector2<f64>], polar: fn(&Polar) -> Vector2<f64>, out: &mut [f64]) {
        for (value, &place) in out.iter_mut().zip(&self.layout.active) {
            let (slot, component) = (place / 2, place % 2);
            *value = match self.motion.polar(slot) {
                Some(own) => polar(own)[component],
                None => all(&self.motion)[slot][component],
            };
        }
    }

    /// Velocities and accelerations as if every link were rigid in its present shape, the first turning steadily at `rate`. With the
    /// rod's vector e from pin to slider, `ẏ = 0` and `ÿ = 0` there give `β̇ = −ẏ_A/e_x`, `β̈ = (β̇² e_y − ÿ_A)/e_x`.
    pub(super) fn set_rates(&mut self, rate: f64) {
        self.set_link_rates([rate; 2]);
    }

    /// The same with a rate of its own for a second link that is free.
    pub(super) fn set_link_rates(&mut self, [mut rate, second]: [f64; 2]) {
        let mut pin: [Vector2<f64>; 3] = [Vector2::zeros(); 3];
        let mut acceleration = 0.0;
        for i in 0..self.members.len() {
            let Some(first) = (match &self.members[i] {
                Member::Flexible { first, .. } | Member::Rigid { first, .. } => Some(*first),
                Member::Guided { .. } => None,
            }) else {
                break;
            };
            if i == 1 {
                rate = second;
            }
            let m = &mut self.motion;
            if let (1, End::Slider(_), Some(end)) = (i, &self.chain.end, self.layout.end) {
                let along = m.p[end] - pin[0];
                rate = -pin[1].y / along.x;
                acceleration = (rate * rate * along.y - pin[2].y) / along.x;
            }
            let turn = |r: &Vector2<f64>| left(r) * acceleration - r * (rate * rate);
            match &self.members[i] {
                Member::Flexible { elements, swapped, .. } => {
                    for window in windows(first, *elements, *swapped) {
                        let x = window.gather(&m.p);
                        let at = |x: &Vector2<f64>| pin[1] + left(&(x - pin[0])) * rate;
                        window.set(&mut m.v, [at(&x[0]), left(&x[1]) * rate, at(&x[2]), left(&x[3]) * rate]);
                        let at = |x: &Vector2<f64>| pin[2] + turn(&(x - pin[0]));
                        window.set(&mut m.a, [at(&x[0]), turn(&x[1]), at(&x[2]), turn(&x[3])]);
                    }
                    let end = first + 2 * elements + usize::from(*swapped);
                    pin = [m.p[end], m.v[end], m.a[end]];
                }
                _ => {
                    let a = m.p[first + 1];
                    (m.v[first + 1], m.a[first + 1]) = (left(&a) * rate, turn(&a));
                    pin = [pin[0] + a, pin[1] + left(&a) * rate, pin[2] + turn(&a)];
                }
            }
            m.set_polar_rate(first + 1, rate, acceleration);
        }
        if let (End::Slider(_), Some(end)) = (&self.chain.end, self.layout.end) {
            // The slider does not leave its line, not even by rounding: it stays as it is set here.
            (self.motion.v[end].y, self.motion.a[end].y) = (0.0, 0.0);
        }
    }
}
