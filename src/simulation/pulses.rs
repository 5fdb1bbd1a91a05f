//! Torque pulses: what is waiting, what acts, and its exact mean over a step.

use std::f64::consts::TAU;

use crate::scene::{Pulse, PulseShape};

/// Angular impulse delivered `elapsed_s` after the pulse began (clamped to its duration), N·m·s:
/// `τ u` for a rectangle; `τ (u − (D/2π) sin(2πu/D))` for the raised cosine. At `u = D` both are `τ D`.
fn impulse_nm_s(pulse: &Pulse, elapsed_s: f64) -> f64 {
    let u = elapsed_s.clamp(0.0, pulse.duration_s);
    match pulse.shape {
        // Most of many waiting pulses have not begun.
        _ if u == 0.0 => 0.0,
        _ if u == pulse.duration_s => pulse.torque_nm * u,
        PulseShape::Rectangular => pulse.torque_nm * u,
        PulseShape::RaisedCosine => {
            let turn = TAU / pulse.duration_s;
            pulse.torque_nm * (u - (turn * u).sin() / turn)
        }
    }
}

/// First moment `∫ (s − m) τ ds` of a raised cosine over `[from_s, to_s]` about its middle m, N·m·s². By parts, with the ends a and
/// b of what of the pulse lies within: `(b − m) I(b) − (a − m) I(a) − ∫ I`, `∫₀ᵘ I = τ (u²/2 + (cos(2πu/D) − 1)(D/2π)²)`.
///
/// 0 for a rectangle: its edges within a step stay spread over the step, so that torque times travel is the work of every step.
fn moment_about_middle(pulse: &Pulse, from_s: f64, to_s: f64) -> f64 {
    let (from, to) = (from_s - pulse.start_s, to_s - pulse.start_s);
    let (a, b) = (from.max(0.0), to.min(pulse.duration_s));
    if b <= a || pulse.shape == PulseShape::Rectangular {
        return 0.0;
    }
    let turn = TAU / pulse.duration_s;
    let integral = |u: f64| pulse.torque_nm * (0.5 * u * u + ((turn * u).cos() - 1.0) / (turn * turn));
    let middle = 0.5 * (from + to);
    (b - middle) * impulse_nm_s(pulse, b) - (a - middle) * impulse_nm_s(pulse, a) - (integral(b) - integral(a))
}

/// Torque just before `elapsed_s` after the pulse began, N·m: `τ`, or `τ (1 − cos(2πu/D))`.
fn torque_nm(pulse: &Pulse, elapsed_s: f64) -> f64 {
    if !(elapsed_s > 0.0 && elapsed_s <= pulse.duration_s) {
        return 0.0;
    }
    match pulse.shape {
        PulseShape::Rectangular => pulse.torque_nm,
        PulseShape::RaisedCosine => pulse.torque_nm * (1.0 - (TAU * elapsed_s / pulse.duration_s).cos()),
    }
}

/// Pulses that are waiting or acting. Summed over steps, their means times the step telescope to `τ·Δt` each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pulses {
    active: Vec<Pulse>,
}

impl Pulses {
    /// With room for `capacity` pulses without allocating.
    pub fn with_capacity(capacity: usize) -> Self {
        Pulses { active: Vec::with_capacity(capacity) }
    }

    /// Adds one.
    pub fn push(&mut self, pulse: Pulse) {
        self.active.push(pulse);
    }

    /// How many wait or act.
    pub fn len(&self) -> usize {
        self.active.len()
    }

    /// Whether none waits or acts.
    pub fn is_empty(&self) -> bool {
        self.active.is_empty()
    }

    /// All that wait or act.
    pub fn iter(&self) -> impl Iterator<Item = &Pulse> {
        self.active.iter()
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.active.clear();
    }

    /// Mean torque over `[from_s, to_s]`, N·m.
    pub fn mean_nm(&self, from_s: f64, to_s: f64) -> f64 {
        let delivered = |pulse: &Pulse| impulse_nm_s(pulse, to_s - pulse.start_s) - impulse_nm_s(pulse, from_s - pulse.start_s);
        self.active.iter().map(delivered).sum::<f64>() / (to_s - from_s)
    }

    /// Rise of the smooth torques over `[from_s, to_s]`, N·m/s: of the straight line that has their mean and first moment,
    /// `12 ∫ (s − m) τ ds / h³` with m the middle.
    pub fn rise_nm_per_s(&self, from_s: f64, to_s: f64) -> f64 {
        let moment: f64 = self.active.iter().map(|pulse| moment_about_middle(pulse, from_s, to_s)).sum();
        12.0 * moment / (to_s - from_s).powi(3)
    }

    /// Torque just before `time_s`, N·m.
    pub fn value_nm(&self, time_s: f64) -> f64 {
        self.active.iter().map(|pulse| torque_nm(pulse, time_s - pulse.start_s)).sum()
    }

    /// Forgets the pulses that are over by `time_s`.
    pub fn retire(&mut self, time_s: f64) {
        self.active.retain(|pulse| time_s - pulse.start_s < pulse.duration_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_impulse_is_exact_whatever_the_step() {
        for shape in [PulseShape::Rectangular, PulseShape::RaisedCosine] {
            for (step_s, duration_s, start_s) in
                [(1e-3, 0.1, 0.0), (1e-3, 0.37e-3, 1.0003), (0.1, 0.05, 0.07), (1e-4, 0.123, 2.5), (0.3, 10.0, 0.9)]
            {
                let mut pulses = Pulses::default();
                pulses.push(Pulse { start_s, torque_nm: 5.0, duration_s, shape });
                let mut impulse = 0.0;
                let mut n = 0_u32;
                while !pulses.is_empty() {
                    let (from_s, to_s) = (f64::from(n) * step_s, f64::from(n + 1) * step_s);
                    impulse += pulses.mean_nm(from_s, to_s) * (to_s - from_s);
                    pulses.retire(to_s);
                    n += 1;
                }
                let exact = 5.0 * duration_s;
                assert!((impulse - exact).abs() <= 1e-12 * exact, "{shape:?} {duration_s} s at {step_s} s: {impulse}");
            }
        }
    }

    #[test]
    fn val_rise_is_that_of_the_first_moment() {
        let mut pulses = Pulses::default();
        let pulse = Pulse { start_s: 0.3, torque_nm: 5.0, duration_s: 0.4, shape: PulseShape::RaisedCosine };
        pulses.push(pulse);
        for (from_s, to_s) in [(0.0, 0.2), (0.1, 0.5), (0.35, 0.36), (0.4, 0.9), (0.0, 1.0), (0.7, 0.8)] {
            let (n, h) = (100_000_u32, to_s - from_s);
            let moment: f64 = (0..n)
                .map(|k| {
                    let s = h * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
                    s * torque_nm(&pulse, 0.5 * (from_s + to_s) + s - pulse.start_s) * h / f64::from(n)
                })
                .sum();
            let (rise, expected) = (pulses.rise_nm_per_s(from_s, to_s), 12.0 * moment / h.powi(3));
            assert!((rise - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{from_s} {to_s}: {rise} {expected}");
        }
    }

    #[test]
    fn val_overlapping_pulses_add() {
        let mut pulses = Pulses::default();
        for _ in 0..2 {
            pulses.push(Pulse { start_s: 0.0, torque_nm: 3.0, duration_s: 1.0, shape: PulseShape::Rectangular });
        }
        assert_eq!(pulses.mean_nm(0.25, 0.5), 6.0);
    }
}
