//! Estimated error of the time step, from each scheme's own error terms.

use crate::mechanics::{CarriedTurn, Measure};

/// The peak of an error that swings over the mean of its magnitude, and what its feedback on the motion adds, as measured: see
/// [`ErrorEstimate`].
const PEAK: f64 = 2.0;
/// Numbers of an estimate in a checkpoint.
const NUMBERS: usize = 20;
/// Numbers of it in older recordings: those that know nothing of the rotation, and those that carry it along by each step's own motion.
const OLDER_NUMBERS: [usize; 2] = [9, 13];

/// Error term of one step, in the quantities that users look at: see [`ErrorTerm`](crate::integrate::ErrorTerm).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Term {
    pub measure: Measure,
    pub factor: f64,
    /// If the change since the step before counts: a number that grows with the step as the measure does.
    pub size: Option<f64>,
}

/// Estimated error of the time discretization since the epoch began.
///
/// **What it is.** Every step adds its own leading error, e. Rates that err go on erring, and angles with them. Two sums follow that:
///
/// ```text
/// of the chord       s ← s + |e_θ|     d ← d + h w     w ← w + e_ω
/// of the rotation    (δ, δ̇) ← e^{Ah} (δ, δ̇) + (c·M e_q, c·M e_v)/(c·M c)
///
/// estimate = 2 (s + max(|d|, |δ|))
/// ```
///
/// For a vibration of frequency ω and amplitude A, `Σ |e_θ|` grows as the error in phase does, `c (hω)ᵖ ωt A`. The factor is π/2 from a
/// mean magnitude to its peak, and what the error's feedback on the motion adds.
///
/// The second sum takes the part of e in which the chain turns by c, as if its links kept their shape. It carries it along as a small
/// error of the rigid chain grows or fades: at a dead centre that the crank barely passes, by orders of magnitude. `e^{Ah}` stands while
/// the crank turns by a hundredth of a radian and its rate changes by a twentieth ([`CarriedTurn`]). The sum is 0 where one angle does
/// not say where a rigid chain is. Errors of ESDIRK are changes from step to step, which cancel in it where vibration is not resolved;
/// there the first one shows more.
///
/// **What it is good for.** It is an estimate of size, not a bound. Of the default scene and R2s, over 2 s, from 1e-2 to 1e-7 rad, it was
/// 0.4 to 3.1 of the true error, but for finite elements with ESDIRK: there 0.4 to 6.6 on R2s and 0.9 to 21 on the default scene, whose
/// vibration no step resolved. `tests/damped/estimate.rs` measures that. It knows nothing of the model's own error, and nothing of chaos.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ErrorEstimate {
    /// Errors of the first link's chord angle, magnitudes summed, rad.
    pub angle_sum_rad: f64,
    /// Error of its rate, rad/s.
    pub rate_rad_per_s: f64,
    /// The rate's error carried on, rad.
    pub drift_rad: f64,
    /// Error of the rotation, rad, and of its rate, rad/s, carried along.
    pub turn: [f64; 2],
    /// How they are carried along.
    pub carried: CarriedTurn,
    /// Errors of the last flexible link's middle, magnitudes summed, m.
    pub deflection_sum_m: f64,
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

    /// Adds one more part of a step, of `h_s`, by its terms, of coordinates and velocities. The rotation's error is carried along if one
    /// angle says where the chain is.
    pub(super) fn add(&mut self, h_s: f64, terms: &[Term; 2], turns: bool) {
        let mut errors = [Measure::default(); 2];
        for ((error, term), left) in errors.iter_mut().zip(terms).zip(&mut self.left) {
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
            let [angle_rad, rate_rad_per_s] = self.carried.after(self.turn);
            self.turn = [angle_rad + of_q.turn_rad, rate_rad_per_s + of_v.turn_rad];
        }
        self.angle_sum_rad += of_q.angle_rad.abs();
        self.deflection_sum_m += of_q.deflection_m.abs();
        self.last_step_rad += of_q.angle_rad.abs();
    }

    /// Estimated error of the first link's chord angle, rad.
    pub fn angle_rad(&self) -> f64 {
        PEAK * (self.angle_sum_rad + self.drift_rad.abs().max(self.turn[0].abs()))
    }

    /// Estimated error of the last flexible link's middle, m.
    pub fn deflection_m(&self) -> f64 {
        PEAK * self.deflection_sum_m
    }

    /// All of it, for a checkpoint.
    pub fn numbers(&self) -> [f64; NUMBERS] {
        let [q, v] = self.left;
        let CarriedTurn { step_s, crank, matrix: [[aa, ar], [ra, rr]] } = self.carried;
        [
            self.angle_sum_rad,
            self.rate_rad_per_s,
            self.drift_rad,
            self.deflection_sum_m,
            self.last_step_rad,
            q.angle_rad,
            q.deflection_m,
            v.angle_rad,
            v.deflection_m,
            q.turn_rad,
            v.turn_rad,
            self.turn[0],
            self.turn[1],
            step_s,
            crank[0],
            crank[1],
            aa,
            ar,
            ra,
            rr,
        ]
    }

    /// From what [`ErrorEstimate::numbers`] gave, or from as many of them as older recordings hold; `None` from any other count.
    pub fn from_numbers(given: &[f64]) -> Option<Self> {
        let mut numbers = [0.0; NUMBERS];
        if given.len() != NUMBERS && !OLDER_NUMBERS.contains(&given.len()) {
            return None;
        }
        numbers.iter_mut().zip(given).for_each(|(number, given)| *number = *given);
        let [sum, rate, drift, deflection, last, left @ .., turn, turn_rate, step_s, crank, crank_rate, aa, ar, ra, rr] = numbers;
        let [q_angle, q_deflection, v_angle, v_deflection, q_turn, v_turn] = left;
        let measure = |angle_rad, deflection_m, turn_rad| Measure { angle_rad, deflection_m, turn_rad };
        Some(ErrorEstimate {
            angle_sum_rad: sum,
            rate_rad_per_s: rate,
            drift_rad: drift,
            turn: [turn, turn_rate],
            carried: CarriedTurn { step_s, crank: [crank, crank_rate], matrix: [[aa, ar], [ra, rr]] },
            deflection_sum_m: deflection,
            last_step_rad: last,
            left: [measure(q_angle, q_deflection, q_turn), measure(v_angle, v_deflection, v_turn)],
        })
    }
}
