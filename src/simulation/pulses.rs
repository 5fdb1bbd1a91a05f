//! Torque pulses: what is waiting, what acts, and its exact mean over a step.

use std::f64::consts::PI;

use crate::scene::{Pulse, PulseShape};

/// Overlap of a pulse and a step.
///
/// A difference of two antiderivatives would lose what a long pulse has little of: early in a pulse of duration D, over a step
/// h, the impulse goes as h³/D² and its first moment as h⁴/D². So both come from the overlap's middle and width instead.
struct Overlap {
    /// Times since the pulse began, or till it ends, whichever is nearer; first and last of the overlap, ascending, s.
    near_s: [f64; 2],
    /// Whether they count till the end.
    mirrored: bool,
    /// Length, s.
    width_s: f64,
    /// Length over that of the step.
    share: f64,
    /// From the step's middle to the overlap's, over the step.
    offset: f64,
}

impl Overlap {
    /// `None` if nothing of the pulse lies within.
    #[inline]
    fn new(pulse: &Pulse, from_s: f64, to_s: f64) -> Option<Self> {
        let (from, to, duration) = (from_s - pulse.start_s, to_s - pulse.start_s, pulse.duration_s);
        let (first, last) = (from.max(0.0), to.min(duration));
        // A step within the pulse is as long as its own ends say: counted from the pulse's start they are rounded again.
        let step_s = to_s - from_s;
        let width_s = if from >= 0.0 && to <= duration { step_s } else { last - first };
        if width_s <= 0.0 {
            return None;
        }
        let (before, after) = ((-from).max(0.0), (to - duration).max(0.0));
        let mirrored = first + last > duration;
        let near_s = if mirrored { [duration - last, duration - first] } else { [first, last] };
        Some(Overlap { near_s, mirrored, width_s, share: width_s / step_s, offset: 0.5 * (before - after) / step_s })
    }
}

/// The mean over an overlap, and the mean of `(s − middle) · 2/width`, both over the pulse's torque τ.
///
/// Of `1 − cos 2πs/D` with `φ = 2π middle/D` and `x = π width/D`:
///
/// ```text
/// mean    1 − cos φ sinc x = (1 − cos φ) + cos φ (1 − sinc x)
/// moment  sin φ (sinc x − cos x)/x
/// ```
///
/// and no term nearly cancels another for φ from 0 to π, which the nearer end of the pulse provides.
fn mean_and_moment(pulse: &Pulse, overlap: &Overlap) -> [f64; 2] {
    if pulse.shape == PulseShape::Rectangular {
        return [1.0, 0.0];
    }
    let half_turn_per_s = PI / pulse.duration_s;
    let phase = Phase::new(pulse.duration_s, overlap.near_s);
    let (lost, bessel) = sinc_lost_and_bessel(half_turn_per_s * overlap.width_s);
    let moment = phase.sin * bessel;
    [phase.one_minus_cos + phase.cos * lost, if overlap.mirrored { -moment } else { moment }]
}

/// Sine and cosine of `φ = 2π m/D`, `0 ≤ φ ≤ π`, each as exact as the times that φ comes from.
struct Phase {
    sin: f64,
    cos: f64,
    one_minus_cos: f64,
}

impl Phase {
    /// For the middle `m` of two times of at most `D` in sum.
    #[inline]
    fn new(duration_s: f64, [first_s, last_s]: [f64; 2]) -> Self {
        let half_turn_per_s = PI / duration_s;
        let twice_s = first_s + last_s;
        if twice_s <= 0.5 * duration_s {
            // By half of φ: 1 − cos φ = 2 sin² ½φ.
            let (sin, cos) = (0.5 * half_turn_per_s * twice_s).sin_cos();
            let one_minus_cos = 2.0 * sin * sin;
            return Self { sin: 2.0 * sin * cos, cos: 1.0 - one_minus_cos, one_minus_cos };
        }
        // By π − φ, as φ near π would be too coarse for sin φ.
        let middle_s = 0.5 * duration_s;
        let (sin, cos) = (half_turn_per_s * ((middle_s - first_s) + (middle_s - last_s))).sin_cos();
        Self { sin, cos: -cos, one_minus_cos: 1.0 + cos }
    }
}

/// `1 − sinc x` and `(sinc x − cos x)/x` (the spherical Bessel function j₁) for `0 ≤ x ≤ π`; below 1 by their series,
/// `x²/6 (1 − x²/20 (1 − x²/42 …))` with `2k (2k + 1)` and `x/3 (1 − x²/10 (1 − x²/28 …))` with `2k (2k + 3)`.
#[inline]
fn sinc_lost_and_bessel(x: f64) -> (f64, f64) {
    const SINC: [f64; 8] = [20.0, 42.0, 72.0, 110.0, 156.0, 210.0, 272.0, 342.0];
    const BESSEL: [f64; 8] = [10.0, 28.0, 54.0, 88.0, 130.0, 180.0, 238.0, 304.0];
    if x < 1.0 {
        let square = x * x;
        let series = |divisors: &[f64; 8]| divisors.iter().rev().fold(1.0, |sum, divisor| 1.0 - square / divisor * sum);
        return (square / 6.0 * series(&SINC), x / 3.0 * series(&BESSEL));
    }
    let (sin, cos) = x.sin_cos();
    let sinc = sin / x;
    (1.0 - sinc, (sinc - cos) / x)
}

/// Mean torque of one pulse over a step, N·m.
#[inline]
pub(super) fn mean_nm(pulse: &Pulse, from_s: f64, to_s: f64) -> f64 {
    let Some(overlap) = Overlap::new(pulse, from_s, to_s) else { return 0.0 };
    let [mean, _] = mean_and_moment(pulse, &overlap);
    pulse.torque_nm * (overlap.share * mean)
}

/// `12 ∫ (s − m) τ ds / h³` of a raised cosine over a step of length h with the middle m, N·m/s: of the straight line that has its
/// mean and first moment. With `w` the overlap's share of the step and `o` the offset of its middle over h it is
/// `12/h · w (½ w moment + o mean)` of the overlap's own.
///
/// 0 for a rectangle: where more edges fall within a step than it has parts, they stay spread over the rest of it, so that torque times
/// travel is the work of every step.
#[inline]
fn rise_nm_per_s(pulse: &Pulse, from_s: f64, to_s: f64) -> f64 {
    if pulse.shape == PulseShape::Rectangular {
        return 0.0;
    }
    let Some(overlap) = Overlap::new(pulse, from_s, to_s) else { return 0.0 };
    let [mean, moment] = mean_and_moment(pulse, &overlap);
    let about_middle = 0.5 * overlap.share * moment + overlap.offset * mean;
    pulse.torque_nm * (12.0 * overlap.share * about_middle) / (to_s - from_s)
}

/// Torque at `time_s`, N·m: `τ (1 − cos(2πu/D))` of a raised cosine u after it began. A rectangle, which jumps, has the torque `τ` that
/// it has at `side_s`, shortly before or after.
pub(super) fn torque_nm(pulse: &Pulse, time_s: f64, side_s: f64) -> f64 {
    let duration_s = pulse.duration_s;
    let acts = |elapsed_s: f64| elapsed_s > 0.0 && elapsed_s <= duration_s;
    let elapsed_s = time_s - pulse.start_s;
    match pulse.shape {
        PulseShape::Rectangular if acts(side_s - pulse.start_s) => pulse.torque_nm,
        PulseShape::RaisedCosine if acts(elapsed_s) => {
            let near_s = elapsed_s.min(duration_s - elapsed_s);
            pulse.torque_nm * Phase::new(duration_s, [near_s; 2]).one_minus_cos
        }
        _ => 0.0,
    }
}

/// Pulses that are waiting or acting.
///
/// Every mean is good to 2e-15 of itself for durations of 1e-12 to 1e9 s and steps of 1e-10 to 10 s, apart from the rounding of the
/// step's own ends. No mean of a pulse changes sign, so the means times the steps add up to `τ·Δt` to 1e-14.
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

    /// Number of pulses that wait or act.
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
        self.begun(to_s).map(|pulse| mean_nm(pulse, from_s, to_s)).sum()
    }

    /// Rise of the smooth torques over `[from_s, to_s]`, N·m/s: of the straight line that has their mean and first moment,
    /// `12 ∫ (s − m) τ ds / h³` with m the middle.
    pub fn rise_nm_per_s(&self, from_s: f64, to_s: f64) -> f64 {
        self.begun(to_s).map(|pulse| rise_nm_per_s(pulse, from_s, to_s)).sum()
    }

    /// The first time between the two at which a pulse begins or ends, s.
    pub fn edge_within(&self, from_s: f64, to_s: f64) -> Option<f64> {
        let edges = self.begun(to_s).flat_map(|pulse| [pulse.start_s, pulse.start_s + pulse.duration_s]);
        edges.filter(|&edge_s| from_s < edge_s && edge_s < to_s).min_by(f64::total_cmp)
    }

    /// Torque at `time_s`, N·m: of rectangles, which jump, that at `side_s`, shortly before or after.
    pub fn value_nm(&self, time_s: f64, side_s: f64) -> f64 {
        self.begun(time_s.max(side_s)).map(|pulse| torque_nm(pulse, time_s, side_s)).sum()
    }

    /// Those that begin before `time_s`: most of many waiting pulses do not.
    #[inline]
    fn begun(&self, time_s: f64) -> impl Iterator<Item = &Pulse> {
        self.active.iter().filter(move |pulse| pulse.start_s < time_s)
    }

    /// Forgets the pulses that are over by `time_s`.
    pub fn retire(&mut self, time_s: f64) {
        self.active.retain(|pulse| time_s - pulse.start_s < pulse.duration_s);
    }
}

#[cfg(test)]
mod tests;
