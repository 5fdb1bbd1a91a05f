//! Modes of a mechanism that turns: how each one grows or fades over a turn, by itself and as a scheme computes it.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::error::FloquetError;
use super::floquet::{Accuracy, FURTHER, Floquet, GONE, Multiplier, eigenvalues, eigenvector, of_physics, of_scheme};
use super::mode::{Identifier, Mode, numbered};
use super::motion_search::coarse_motion;
use super::orbit::{Cycle, Guess, Orbit, OrbitSettings};
use super::periodic::{CrankDrive, DrivenMechanism};
use super::point::Point;
use super::scheme::Scheme;
use super::scheme_motion::{SchemeMotion, own_motion};
use super::subject::Subject;
use super::{Band, Linearised, NoModes};
use crate::integrate::{System as _, solve_acceleration};

/// A multiplier that is nearer to 1 than this, or than so many of its errors, is that of a shift along the motion.
const ALONG: f64 = 1e-4;
const DOUBLED: f64 = 3.0;
/// Phase of a vibration in a step that shows it, rad.
const PHASE_RAD: f64 = 0.5;
/// Least likeness of a free crank's own motion to the velocities, 0 to 1.
pub(super) const ALIKE: f64 = 0.5;
/// A motion that changes by less than this part of itself in a step is slow beside steps.
const SLOW: f64 = 0.1;
/// Part of the ratio of velocities and displacements from which on their quotient tells the frequency.
const TELLING: f64 = 0.5;
/// Turns per vibration beyond which no whole number of turns is told from the next.
const MOST_TURNS: f64 = 1e4;

/// One mode of small motion about a turning mechanism.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicMode {
    /// Name, shape and energies at the beginning of the turn. Its eigenvalue λ is `ln ρ/T`, with as many whole turns added to its
    /// frequency as bring it nearest to the ratio of the mode's velocities and displacements.
    pub mode: Mode,
    /// ρ of the physics, with its error.
    pub multiplier: Multiplier,
    /// ρ of the scheme at its step, for the shape that is most alike.
    pub by_scheme: Option<Complex<f64>>,
}

/// A periodic motion with its modes.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicModes {
    /// The motion of the physics.
    pub orbit: Orbit,
    /// Its modes, in the order of frequency.
    pub modes: Vec<PeriodicMode>,
    /// Number of multipliers whose motion is gone after a turn. They have no mode here.
    pub gone: usize,
    /// Number of multipliers that are as small, though no motion at the turn's beginning is damped so much: steps that do not resolve
    /// a vibration damp it away. They have no mode here, either.
    pub lost: usize,
    /// Period, steps and largest multiplier of the scheme's own motion; why there is none.
    pub scheme: Option<Result<SchemeMotion, FloquetError>>,
}

/// The modes, how many multipliers are of motion that is gone after a turn, and the scheme's multipliers of a free crank's own motion.
struct Identified {
    modes: Vec<PeriodicMode>,
    fading: usize,
    own: Vec<Complex<f64>>,
}

/// Residual at which a scheme's motion repeats: thousands of steps leave more rounding than those of the physics.
const SCHEME_REPEATS: f64 = 1e-6;

/// A scheme at a step, s.
pub type SchemeStep = (Scheme, f64);

impl Subject {
    /// The modes about the periodic motion at a mean speed: the crank moved at that speed if it is held, else free under the constant
    /// torque that sustains it. A motion found at a `near` speed helps where a resonance is not far.
    ///
    /// # Errors
    /// [`NoModes`] where no such motion is found.
    pub fn periodic_modes(
        &self,
        angle_rad: f64,
        speed_rad_per_s: f64,
        accuracy: &Accuracy,
        scheme: Option<SchemeStep>,
        near: Option<&Orbit>,
    ) -> Result<PeriodicModes, NoModes> {
        if self.is_oscillator() {
            return Err(NoModes::NoCrank);
        }
        if speed_rad_per_s == 0.0 {
            return Err(NoModes::NoSpeed);
        }
        if self.has_free_second_link() {
            return Err(NoModes::FreeSecondLink);
        }
        if self.has_base_spring() {
            return Err(NoModes::BaseSpring);
        }
        let period_s = TAU / speed_rad_per_s.abs();
        let settings = OrbitSettings::default();
        let mut mechanism = self.mechanism();
        if mechanism.degrees_of_freedom() == 0 {
            return Err(NoModes::NothingMoves);
        }
        let mut guess = self.guess(angle_rad, speed_rad_per_s, near)?;
        let mut system = DrivenMechanism::new(mechanism.as_mut(), self.drive(angle_rad, speed_rad_per_s));
        if near.is_none() {
            guess = coarse_motion(&mut system, period_s, &guess).unwrap_or(guess);
        }
        let start = Point { q: guess.q.clone(), v: guess.v.clone(), ..self.at_rest(angle_rad)? };
        let most_gone = fading_if_shown(&Linearised::new(self.mechanism().as_mut(), &start), period_s, accuracy.most_steps);
        let accuracy = Accuracy { most_gone: most_gone.min(accuracy.most_gone), ..*accuracy };
        let mut found = of_physics(&mut system, period_s, &guess, &accuracy, &settings)?;
        if !self.is_held() {
            err_as_the_shift(&mut found.multipliers);
        }
        let point = start_of(&mut system, &found.orbit)?;
        let own = Guess { q: found.orbit.q.clone(), v: found.orbit.v.clone(), advance: Some(found.orbit.advance.clone()) };
        let by_scheme_settings = OrbitSettings { tolerance: SCHEME_REPEATS, ..settings };
        let by_scheme = scheme
            .map(|(scheme, step_s)| of_scheme(&mut system, scheme, Cycle::near(period_s, step_s), &own, &by_scheme_settings));
        let Identified { modes, fading, own } =
            self.identified(&found, &point, by_scheme.as_ref().and_then(|found| found.as_ref().ok()))?;
        let scheme = by_scheme.map(|found| found.map(|found| SchemeMotion::of(&found, own)));
        let small = found.multipliers.iter().filter(|multiplier| multiplier.is_gone()).count();
        let gone = small.min(fading);
        Ok(PeriodicModes { orbit: found.orbit, modes, gone, lost: small - gone, scheme })
    }

    fn drive(&self, angle_rad: f64, speed_rad_per_s: f64) -> CrankDrive {
        if self.is_held() {
            CrankDrive::Speed { start_rad: angle_rad, speed_rad_per_s }
        } else {
            CrankDrive::Torque { torque_nm: self.mean_torque_nm(speed_rad_per_s).unwrap_or(0.0) }
        }
    }

    /// Links that turn as they stand in equilibrium; or a motion found at another speed, in this one's time.
    fn guess(&self, angle_rad: f64, speed_rad_per_s: f64, near: Option<&Orbit>) -> Result<Guess, NoModes> {
        if let Some(near) = near {
            let faster = speed_rad_per_s.abs() * near.cycle.period_s / TAU;
            let v = near.v.iter().map(|v| v * faster).collect();
            return Ok(Guess { q: near.q.clone(), v, advance: Some(near.advance.clone()) });
        }
        let mut still = self.at_rest(angle_rad)?;
        still.input.motion = self.is_held().then_some([angle_rad, speed_rad_per_s, 0.0]);
        let mut mechanism = self.mechanism();
        let row = Linearised::new(mechanism.as_mut(), &still).torque;
        mechanism.rigid_motion(&still.input, speed_rad_per_s, &still.q, &mut still.v, &mut still.a);
        // Only the angle on which torque acts goes on; all else is after a turn where it was.
        let turns = |(b, v): (&f64, &f64)| if *b != 0.0 && *v == speed_rad_per_s { TAU * speed_rad_per_s.signum() } else { 0.0 };
        let advance = row.iter().zip(&still.v).map(turns).collect();
        Ok(Guess { q: still.q, v: still.v, advance: Some(advance) })
    }

    /// The modes of the multipliers, and what the scheme makes of them.
    fn identified(&self, found: &Floquet, point: &Point, scheme: Option<&Floquet>) -> Result<Identified, NoModes> {
        let (n, period_s) = (point.q.len(), found.orbit.cycle.period_s);
        let mut identifier = Identifier::new(self, point)?;
        let own: Vec<(Complex<f64>, DVector<Complex<f64>>)> = scheme.map(|scheme| shapes(scheme, n)).unwrap_or_default();
        // One of each conjugate pair.
        let is_told = |multiplier: &&Multiplier| multiplier.value.im >= -1e-12 * multiplier.value.norm() && !multiplier.is_gone();
        let halves = |vector: DVector<Complex<f64>>| (vector.rows(0, n).into_owned(), vector.rows(n, n).into_owned());
        let with_shape = |multiplier: &Multiplier| {
            eigenvector(&found.orbit.monodromy, multiplier.value).map(|vector| (*multiplier, halves(vector)))
        };
        let told: Vec<_> = found.multipliers.iter().filter(is_told).filter_map(with_shape).collect();
        let along = DVector::from_iterator(n, found.orbit.v.iter().map(|v| Complex::from(*v)));
        let shapes: Vec<_> =
            told.iter().map(|(multiplier, (shape, _))| (*multiplier, alike(&identifier.system, shape, &along))).collect();
        let ahead = if self.is_held() { Vec::new() } else { running_ahead(&shapes) };
        let own_by_scheme = {
            let likenesses = own.iter().map(|(value, shape)| (*value, alike(&identifier.system, shape, &along)));
            if self.is_held() { Vec::new() } else { own_motion(&likenesses.collect::<Vec<_>>()) }
        };
        let of_scheme = {
            let with_shapes: Vec<_> = told.iter().map(|(multiplier, (shape, _))| (multiplier.value, shape)).collect();
            partners(&identifier.system, &with_shapes, &own)
        };
        let mut modes = Vec::new();
        for ((place, (multiplier, (shape, rates))), by_scheme) in told.into_iter().enumerate().zip(of_scheme) {
            let square = inner(&identifier.system, &shape, &shape).re;
            let size_per_s = (inner(&identifier.system, &rates, &rates).re / square).sqrt();
            // Of one link alone, the modes are those of a steady state.
            let is_steady = self.chain().is_some_and(|chain| chain.links.len() == 1);
            let quotient = if is_steady { inner(&identifier.system, &shape, &rates) / square } else { Complex::from(0.0) };
            let value = |vibrates| match vibrates {
                true => exponent(multiplier.value, period_s, (quotient, size_per_s)),
                false => exponent(multiplier.value, period_s, (Complex::from(0.0), 0.0)),
            };
            let facts = (size_per_s, ahead.contains(&place));
            let mode = identifier.identify_periodic(facts, value, shape / Complex::from(square.sqrt()));
            modes.push(PeriodicMode { mode, multiplier, by_scheme });
        }
        modes.sort_by(|one: &PeriodicMode, other| one.mode.eigenvalue.im.total_cmp(&other.mode.eigenvalue.im));
        // The frequencies of others are wrong by whole turns, and stand anywhere among these.
        let mut places: Vec<usize> = (0..modes.len()).collect();
        places.sort_by_key(|place| !modes[*place].is_resolved());
        let named = numbered(places.iter().map(|place| modes[*place].mode.clone()).collect());
        places.into_iter().zip(named).for_each(|(place, mode)| modes[place].mode = mode);
        // The two real multipliers of one mode, where it has come into step with the crank.
        for place in 1..modes.len() {
            let [one, two] = [&modes[place - 1].mode, &modes[place].mode];
            if one.kind == two.kind && two.eigenvalue.im - one.eigenvalue.im < 1e-9 * two.eigenvalue.im {
                modes[place].mode.number = one.number;
            }
        }
        Ok(Identified { modes, fading: fading(&identifier.system, period_s), own: own_by_scheme })
    }
}

impl PeriodicMode {
    /// Whether the steps resolve it: its error is small beside it.
    pub fn is_resolved(&self) -> bool {
        self.multiplier.is_resolved()
    }

    /// Whether it is slow beside steps of this size, and its error is known, however large.
    pub fn is_slow(&self, step_s: f64) -> bool {
        self.mode.eigenvalue.norm() * step_s < SLOW && self.multiplier.error.is_finite()
    }
}

impl PeriodicModes {
    /// Modes that grow by themselves, beyond doubt.
    pub fn unstable(&self) -> impl Iterator<Item = &PeriodicMode> {
        self.modes.iter().filter(|mode| mode.multiplier.is_unstable())
    }

    /// Whether the growth of any mode is known: none is where a motion was found with one number of steps alone, or where no mode is
    /// slow enough for the steps.
    pub fn is_known(&self) -> bool {
        self.modes.is_empty() && self.lost == 0 || self.modes.iter().any(PeriodicMode::is_resolved)
    }

    /// The largest magnitude of a multiplier that is resolved; 0 where nothing moves.
    pub fn largest(&self) -> f64 {
        self.modes.iter().filter(|mode| mode.is_resolved()).map(|mode| mode.multiplier.value.norm()).fold(0.0, f64::max)
    }
}

/// The state at the beginning of the turn.
fn start_of(system: &mut DrivenMechanism<'_, dyn crate::mechanics::Mechanism>, orbit: &Orbit) -> Result<Point, NoModes> {
    let Orbit { q, v, .. } = orbit;
    let (mut a, mut scratch) = (vec![0.0; q.len()], vec![0.0; system.degrees_of_freedom()]);
    solve_acceleration(system, 0.0, q, v, &mut a, &mut scratch).map_err(|_| NoModes::Singular)?;
    let mut input = system.input(0.0);
    input.torque_nm = orbit.torque_nm.unwrap_or(input.torque_nm);
    Ok(Point { input, q: q.clone(), v: v.clone(), a, speed_rad_per_s: 0.0 })
}

/// Places of the multipliers of a free crank's own motion, given each with how much its shape is like the velocities: the shift along the
/// motion, whose multiplier is 1, and a change of its speed. That is real, too, and of those the most alike. Where a link's bending has
/// come into step with the crank, its two multipliers are also real. Of an undamped crank, 1 is double, and any error splits it: by a pair
/// that is conjugate, or real.
fn running_ahead(shapes: &[(Multiplier, f64)]) -> Vec<usize> {
    let value = |place: usize| shapes[place].0.value;
    let from_one = |place: usize| (value(place) - 1.0).norm();
    let is_real = |place: usize| value(place).re > 0.0 && value(place).im.abs() <= 1e-12 * value(place).norm();
    let is_shift = |place: &usize| shapes[*place].1 >= ALIKE && from_one(*place) <= ALONG.max(DOUBLED * shapes[*place].0.error);
    let shifts = (0..shapes.len()).filter(is_shift);
    let Some(shift) = shifts.min_by(|one, other| from_one(*one).total_cmp(&from_one(*other))) else { return Vec::new() };
    let others = (0..shapes.len()).filter(|place| *place != shift && is_real(shift) && is_real(*place));
    let faster = others.max_by(|one, other| shapes[*one].1.total_cmp(&shapes[*other].1));
    std::iter::once(shift).chain(faster.filter(|place| shapes[*place].1 >= ALIKE)).collect()
}

/// The number of multipliers of motion, damped as at this point, that are gone after a period: those of the eigenvalues λ of
/// `(λ² M + λ D + K) φ = 0` with `|e^{λT}|` so small. If the eigenvalues are not found, none is known to be.
fn fading(system: &Linearised, period_s: f64) -> usize {
    exponents(system).iter().filter(|value| fades(value, period_s)).count()
}

/// Whether motion of an eigenvalue is gone after a period.
fn fades(value: &Complex<f64>, period_s: f64) -> bool {
    value.re * period_s < GONE.ln()
}

/// The same number, where as many steps as are allowed can show the slowest vibration that does not fade; else no limit.
fn fading_if_shown(system: &Linearised, period_s: f64, most_steps: u32) -> usize {
    let exponents = exponents(system);
    let lasting = exponents.iter().filter(|value| !fades(value, period_s) && value.im > 0.0);
    let slowest_per_s = lasting.map(|value| value.im).fold(f64::INFINITY, f64::min);
    let is_reachable = slowest_per_s * period_s <= PHASE_RAD * f64::from(FURTHER * most_steps);
    if is_reachable { exponents.iter().filter(|value| fades(value, period_s)).count() } else { usize::MAX }
}

/// The eigenvalues λ of `(λ² M + λ D + K) φ = 0`; none where they are not found.
fn exponents(system: &Linearised) -> Vec<Complex<f64>> {
    let [mass, damping, stiffness] = [&system.mass, &system.damping, &system.stiffness].map(Band::dense);
    let (n, lu) = (mass.nrows(), mass.lu());
    let (Some(damping), Some(stiffness)) = (lu.solve(&damping), lu.solve(&stiffness)) else { return Vec::new() };
    let mut first_order = DMatrix::zeros(2 * n, 2 * n);
    first_order.view_mut((0, n), (n, n)).fill_with_identity();
    first_order.view_mut((n, 0), (n, n)).copy_from(&-stiffness);
    first_order.view_mut((n, n), (n, n)).copy_from(&-damping);
    eigenvalues(&first_order).map_or(Vec::new(), |(values, _)| values)
}

/// Multipliers of a scheme with their shapes.
fn shapes(found: &Floquet, n: usize) -> Vec<(Complex<f64>, DVector<Complex<f64>>)> {
    let upper = found.multipliers.iter().filter(|multiplier| multiplier.value.im >= 0.0 && !multiplier.is_gone());
    upper
        .filter_map(|multiplier| {
            let vector = eigenvector(&found.orbit.monodromy, multiplier.value)?;
            Some((multiplier.value, vector.rows(0, n).into_owned()))
        })
        .collect()
}

/// `xᴴ M y`.
fn inner(system: &Linearised, x: &DVector<Complex<f64>>, y: &DVector<Complex<f64>>) -> Complex<f64> {
    system.mass.iter().map(|(i, j, value)| x[i].conj() * y[j] * value).sum()
}

/// For each multiplier the one of a scheme whose value and shape are nearest, each of which is given once. Two of a free crank have shapes
/// that are nearly the same.
fn partners(
    system: &Linearised,
    modes: &[(Complex<f64>, &DVector<Complex<f64>>)],
    own: &[(Complex<f64>, DVector<Complex<f64>>)],
) -> Vec<Option<Complex<f64>>> {
    let distance = |(value, shape): &(Complex<f64>, &DVector<Complex<f64>>),
                    (of_scheme, other): &(Complex<f64>, DVector<Complex<f64>>)| {
        (value - of_scheme).norm() / (value.norm() + of_scheme.norm()) + 1.0 - alike(system, shape, other)
    };
    let pairs = |i: usize| own.iter().enumerate().map(move |(j, own)| (i, j, own));
    let mut pairs: Vec<(f64, usize, usize)> =
        (0..modes.len()).flat_map(pairs).map(|(i, j, own)| (distance(&modes[i], own), i, j)).collect();
    pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
    let (mut found, mut taken) = (vec![None; modes.len()], vec![false; own.len()]);
    for (_, i, j) in pairs {
        if found[i].is_none() && !taken[j] {
            (found[i], taken[j]) = (Some(own[j].0), true);
        }
    }
    found
}

/// No time enters the motion of a free crank, so that one of its multipliers is 1. What is computed for it shows an error that two numbers
/// of steps may share, as where both cut the corners of a resistance table alike: no other multiplier is known better.
pub(super) fn err_as_the_shift(multipliers: &mut [Multiplier]) {
    let off = multipliers.iter().map(|multiplier| (multiplier.value - 1.0).norm()).fold(f64::INFINITY, f64::min);
    for multiplier in multipliers.iter_mut().filter(|_| off.is_finite()) {
        multiplier.error = multiplier.error.max(off * multiplier.value.norm());
    }
}

fn alike(system: &Linearised, x: &DVector<Complex<f64>>, y: &DVector<Complex<f64>>) -> f64 {
    inner(system, x, y).norm_sqr() / (inner(system, x, x).re * inner(system, y, y).re)
}

/// λ: `ln ρ/T`, its frequency moved by whole turns to the place nearest to one that is known roughly.
///
/// In a steady state the velocities ψ are λ times the displacements φ, and `λ = φᴴ M ψ / φᴴ M φ`. Where velocities are those in a frame at
/// rest, the part that comes from the rotation is at right angles to the displacements, and hardly counts. In a motion that is periodic
/// alone, the quotient is 0 here, and the ratio of the sizes `√(ψᴴ M ψ / φᴴ M φ)` at the beginning of the turn is near |λ|.
fn exponent(multiplier: Complex<f64>, period_s: f64, (quotient, size_per_s): (Complex<f64>, f64)) -> Complex<f64> {
    let (turn, own) = (TAU / period_s, multiplier.arg() / period_s);
    let rate = multiplier.norm().ln() / period_s;
    let moved = |own: f64, near_per_s: f64| own + turn * ((near_per_s - own) / turn).round().clamp(-MOST_TURNS, MOST_TURNS);
    if quotient.im.abs() >= TELLING * size_per_s {
        return Complex::new(rate, moved(own, quotient.im).abs());
    }
    let near_per_s = (size_per_s * size_per_s - rate * rate).max(0.0).sqrt();
    // The conjugate is as good.
    let (one, other) = (moved(own, near_per_s), moved(-own, near_per_s));
    let best = if (one - near_per_s).abs() <= (other - near_per_s).abs() { one } else { other };
    Complex::new(rate, best.abs())
}
