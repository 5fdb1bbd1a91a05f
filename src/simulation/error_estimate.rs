//! Estimated error of the time step, from each scheme's own error terms.

use crate::mechanics::{Block, CarriedTurn, Measure, Passage, ROTATIONS};

/// The peak of an error that swings over the mean of its magnitude, and what its feedback on the motion adds, as measured: see
/// [`ErrorEstimate`].
const PEAK: f64 = 2.0;
/// Numbers of an estimate in a checkpoint, where no second link turns by itself, but for those of [`Extent`], which come last.
const NUMBERS: usize = 20;
/// Numbers more where one does.
const NUMBERS_OF_SECOND: usize = 18;
/// Numbers of [`Extent`].
const NUMBERS_OF_EXTENT: usize = 4;
/// Numbers of it in older recordings: those that know nothing of the rotation, those that carry it along by each step's own motion, and
/// those that know nothing of the extent of motion.
const OLDER_NUMBERS: [usize; 4] = [9, 13, NUMBERS, NUMBERS + NUMBERS_OF_SECOND];

/// Error term of one step, in the quantities that users look at: see [`ErrorTerm`](crate::integrate::ErrorTerm).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Term {
    pub measure: Measure,
    pub factor: f64,
    /// If the change since the step before counts: a number that grows with the step as the measure does.
    pub size: Option<f64>,
}

/// The errors of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StepTerms {
    /// Smooth terms, of coordinates and of velocities.
    pub terms: [Term; 2],
    /// Error of the first link's rate by corners of the resistance, rad/s.
    pub corner_rad_per_s: f64,
    /// The course of a rigid chain of one angle over the step, if it is known.
    pub course: Option<Passage>,
    /// Rates of the first link's chord, rad/s, and of the last flexible link's middle, m/s, where the chain turns freely.
    pub rates: [f64; 2],
    /// Slowest decay of what the links do beside turning, 1/s.
    pub fading_per_s: f64,
}

/// How fast and how far the chain moved so far: by these, an error of the chord's angle becomes one of the deflection.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Extent {
    /// Largest rate of the first link's chord, rad/s.
    pub turning_rad_per_s: f64,
    /// Largest rate of the deflection of the last flexible link's middle, m/s.
    pub bending_m_per_s: f64,
    /// Way of that deflection since it last turned back, m, with its sign.
    pub swing_m: f64,
    /// Largest such way, m: from one peak to the next.
    pub largest_swing_m: f64,
}

impl Extent {
    fn after(self, [turning_rad_per_s, bending_m_per_s]: [f64; 2], h_s: f64) -> Self {
        let way_m = h_s * bending_m_per_s;
        let swing_m = if self.swing_m * way_m < 0.0 { way_m } else { self.swing_m + way_m };
        Extent {
            turning_rad_per_s: self.turning_rad_per_s.max(turning_rad_per_s.abs()),
            bending_m_per_s: self.bending_m_per_s.max(bending_m_per_s.abs()),
            swing_m,
            largest_swing_m: self.largest_swing_m.max(swing_m.abs()),
        }
    }

    /// Change of the deflection where the first link is elsewhere by an angle, m: no more than from one peak to the next.
    fn moved_m(self, angle_rad: f64) -> f64 {
        let of_a_radian_m = if self.turning_rad_per_s > 0.0 { self.bending_m_per_s / self.turning_rad_per_s } else { 0.0 };
        (angle_rad * of_a_radian_m).min(self.largest_swing_m)
    }
}

/// Estimated error of the time discretization since the epoch began.
///
/// **What it is.** Every step adds its own leading error, e. Rates that err go on erring, and angles with them. Two sums follow that:
///
/// ```text
/// of the chord       s ← s + |e_θ|     d ← d + h w     w ← w + e_ω
/// of the rotation    (δ, δ̇) ← R e^{Ah} (δ, δ̇) + (c·M e_q, c·M e_v)/(c·M c)      of each link that turns by itself
///
/// estimate = 2 (s + max(|d|, |δ|))
///
/// of the deflection  s_u ← e^{−σh} s_u + |e_u|
///
/// estimate = 2 s_u + min(estimate of the chord · max|u̇|/max|θ̇|, largest swing of u)
/// ```
///
/// For a vibration of frequency ω and amplitude A, `Σ |e_θ|` grows as the error in phase does, `c (hω)ᵖ ωt A`. The factor is π/2 from a
/// mean magnitude to its peak, and what the error's feedback on the motion adds.
///
/// The second sum takes the part of e in which the chain turns by c, as if its links kept their shape. It carries it along as a small
/// error of the rigid chain grows or fades: at a dead centre that the crank barely passes, by orders of magnitude. `e^{Ah}` stands while
/// the links turn by a hundredth of a radian and their rates change by a twentieth ([`CarriedTurn`]). Vibration would pump it: what a
/// rigid chain's errors keep is given back to it ([`Passage`]). An open chain of two links has two
/// such turns, whose errors grow together as it tumbles. A corner in the table of the slider's resistance, which no smooth error term
/// sees, adds its own error to the rate of the rotation. Errors of ESDIRK are changes from step to step, which cancel in it where
/// vibration is not resolved; there the first one shows more.
///
/// An error of a deflection u is a vibration, and fades as the slowest vibration of a link does by its own damping: σ. Where the chord
/// errs by an angle, the link bends as it does that much earlier or later.
///
/// **What it is good for.** It is an estimate of size, not a bound. Of the default scene and R2s, over 2 s, from 1e-2 to 1e-7 rad, it was
/// 0.4 to 3.1 of the true error, but for finite elements with ESDIRK: there 0.4 to 6.6 on R2s and 0.9 to 23 on the default scene, whose
/// vibration no step resolved. From 1e-5 rad on, it was 0.08 to 18 of an open chain that tumbles, and least where vibration is not
/// resolved; of a table of resistance whose corners are passed quickly, 0.2 to 7; where a damper holds the speed, 4 to 25, as the sums
/// of the chord do not fade. `tests/damped/estimate.rs` measures that. It knows nothing of the model's own error, and nothing of chaos: where a
/// heavy slider, or links without damping, exchange energy with the rotation, errors grow a thousand times more than it says.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ErrorEstimate {
    /// Errors of the first link's chord angle, magnitudes summed, rad.
    pub angle_sum_rad: f64,
    /// Error of its rate, rad/s.
    pub rate_rad_per_s: f64,
    /// The rate's error carried on, rad.
    pub drift_rad: f64,
    /// Errors of the rotation of the first link, and of a second one that is free, rad, and of their rates, rad/s, carried along.
    pub turns: [[f64; 2]; ROTATIONS],
    /// How they are carried along.
    pub carried: CarriedTurn,
    /// Errors of the last flexible link's middle, magnitudes summed, m. They fade as vibration does.
    pub deflection_sum_m: f64,
    /// How fast it turned, and how fast and how far it bent.
    pub extent: Extent,
    /// Error of the last step in the first link's chord angle, rad.
    pub last_step_rad: f64,
    /// Measures of the last step, of coordinates and of velocities, over the power of the step as which they grow.
    pub left: [Measure; 2],
}

impl ErrorEstimate {
    /// Goes on after a change of the scene: the measures of its last step, and what carries an error along, are those of another model.
    pub(super) fn without_last_step(self) -> Self {
        ErrorEstimate { left: [Measure::default(); 2], carried: CarriedTurn::default(), ..self }
    }

    /// Begins a step, which may be taken in parts.
    pub(super) fn begin_step(&mut self) {
        self.last_step_rad = 0.0;
    }

    /// Adds one more part of a step, of `h_s`, by its terms. The rotation's error is carried along where the chain turns freely.
    pub(super) fn add(&mut self, h_s: f64, step: &StepTerms, turns: bool) {
        let mut errors = [Measure::default(); 2];
        for ((error, term), left) in errors.iter_mut().zip(&step.terms).zip(&mut self.left) {
            let Term { measure, factor, size } = *term;
            *error = measure.times(factor);
            if let Some(size) = size {
                *error = error.plus(left.times(-factor * size));
                *left = measure.times(1.0 / size);
            }
        }
        let [of_q, of_v] = errors;
        self.drift_rad += h_s * self.rate_rad_per_s;
        self.rate_rad_per_s += of_v.angle_rad;
        if turns {
            self.turns = self.carried.after(self.turns, step.course.as_ref());
            for (link, turn) in self.turns.iter_mut().enumerate() {
                turn[0] += of_q.turns_rad[link];
                turn[1] += of_v.turns_rad[link];
            }
            self.turns[0][1] += step.corner_rad_per_s;
        }
        self.angle_sum_rad += of_q.angle_rad.abs();
        self.extent = self.extent.after(step.rates, h_s);
        self.deflection_sum_m *= (-step.fading_per_s * h_s).exp();
        self.deflection_sum_m += of_q.deflection_m.abs();
        self.last_step_rad += of_q.angle_rad.abs();
    }

    /// Estimated error of the first link's chord angle, rad.
    pub fn angle_rad(&self) -> f64 {
        PEAK * (self.angle_sum_rad + self.drift_rad.abs().max(self.turns[0][0].abs()))
    }

    /// Estimated error of the last flexible link's middle, m.
    pub fn deflection_m(&self) -> f64 {
        PEAK * self.deflection_sum_m + self.extent.moved_m(self.angle_rad())
    }

    /// All of it, for a checkpoint.
    pub fn numbers(&self) -> Vec<f64> {
        let [q, v] = self.left;
        let CarriedTurn { step_s, links, blocks: [[own, by_second], of_second] } = self.carried;
        let mut numbers = vec![
            self.angle_sum_rad,
            self.rate_rad_per_s,
            self.drift_rad,
            self.deflection_sum_m,
            self.last_step_rad,
            q.angle_rad,
            q.deflection_m,
            v.angle_rad,
            v.deflection_m,
            q.turns_rad[0],
            v.turns_rad[0],
        ];
        numbers.extend(self.turns[0]);
        numbers.push(step_s);
        numbers.extend(links[0]);
        numbers.extend(own.as_flattened());
        let mut second = vec![q.turns_rad[1], v.turns_rad[1]];
        second.extend(self.turns[1]);
        second.extend(links[1]);
        second.extend([by_second, of_second[0], of_second[1]].as_flattened().as_flattened());
        if second.iter().any(|number| *number != 0.0) {
            numbers.extend(second);
        }
        let Extent { turning_rad_per_s, bending_m_per_s, swing_m, largest_swing_m } = self.extent;
        numbers.extend([turning_rad_per_s, bending_m_per_s, swing_m, largest_swing_m]);
        numbers
    }

    /// From what [`ErrorEstimate::numbers`] gave, or from as many of them as older recordings hold; `None` from any other count.
    pub fn from_numbers(given: &[f64]) -> Option<Self> {
        let mut numbers = [0.0; NUMBERS + NUMBERS_OF_SECOND];
        let (given, extent) = match given.len().checked_sub(NUMBERS_OF_EXTENT) {
            _ if OLDER_NUMBERS.contains(&given.len()) => (given, Extent::default()),
            Some(others) if others == NUMBERS || others == numbers.len() => {
                let (of_estimate, of_extent) = given.split_at(others);
                let [turning_rad_per_s, bending_m_per_s, swing_m, largest_swing_m] = of_extent.try_into().ok()?;
                (of_estimate, Extent { turning_rad_per_s, bending_m_per_s, swing_m, largest_swing_m })
            }
            _ => return None,
        };
        numbers.iter_mut().zip(given).for_each(|(number, given)| *number = *given);
        let mut numbers = numbers.into_iter();
        let mut next = || numbers.next().unwrap_or_default();
        let mut estimate = ErrorEstimate {
            angle_sum_rad: next(),
            rate_rad_per_s: next(),
            drift_rad: next(),
            deflection_sum_m: next(),
            last_step_rad: next(),
            extent,
            ..ErrorEstimate::default()
        };
        for left in &mut estimate.left {
            (left.angle_rad, left.deflection_m) = (next(), next());
        }
        for link in 0..ROTATIONS {
            for left in &mut estimate.left {
                left.turns_rad[link] = next();
            }
            estimate.turns[link] = [next(), next()];
            if link == 0 {
                estimate.carried.step_s = next();
            }
            estimate.carried.links[link] = [next(), next()];
            let mut block = || -> Block { [[next(), next()], [next(), next()]] };
            if link == 0 {
                estimate.carried.blocks[0][0] = block();
            } else {
                estimate.carried.blocks[0][1] = block();
                estimate.carried.blocks[1] = [block(), block()];
            }
        }
        Some(estimate)
    }
}
