//! Floquet multipliers: whether small motion about a periodic one dies away or grows.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector, Schur, linalg::balancing::balance_parlett_reinsch};

use super::error::FloquetError;
use super::orbit::{Cycle, Guess, Orbit, OrbitSettings, periodic_orbit};
use super::periodic::PeriodicSystem;
use super::scheme::Scheme;

/// An eigenvalue ρ of the monodromy matrix: small motion of that shape is multiplied by it in every period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Multiplier {
    /// ρ.
    pub value: Complex<f64>,
    /// Estimated error of ρ: of the physics by its change when the step was halved, of a scheme by rounding alone.
    pub error: f64,
}

/// Errors are estimates; a multiplier counts as unstable only beyond this many of them.
const SAFETY: f64 = 2.0;
/// A double multiplier of 1 is uncertain by the root of rounding, `√ε = 1.5e-8`: so is that of a crank that turns freely.
const DOUBLE: f64 = 1e-7;
/// Largest error of a multiplier that is resolved, as a part of it.
const RESOLVED: f64 = 1e-2;
/// Multipliers below this are motion that is gone after a turn.
pub(super) const GONE: f64 = 1e-6;

impl Multiplier {
    /// `ln|ρ|/T`: the rate of growth, negative for decay.
    pub fn rate_per_s(&self, period_s: f64) -> f64 {
        self.value.norm().ln() / period_s
    }

    /// `arg ρ/(2πT)`, from `−1/(2T)` to `1/(2T)`: the frequency, up to a multiple of `1/T`.
    pub fn frequency_hz(&self, period_s: f64) -> f64 {
        self.value.arg() / (TAU * period_s)
    }

    /// `|ρ|` above which it is unstable beyond doubt: 1 plus twice its error plus 1e-7, the uncertainty of a double multiplier.
    pub fn unstable_above(&self) -> f64 {
        1.0 + SAFETY * self.error + DOUBLE
    }

    /// Whether the steps resolve it: its error is small beside it.
    pub fn is_resolved(&self) -> bool {
        self.error < RESOLVED * self.value.norm()
    }

    /// Whether such motion is gone after a period; nothing can be told of it.
    pub fn is_gone(&self) -> bool {
        self.value.norm() < GONE
    }

    /// Whether small motion of this shape grows.
    pub fn is_unstable(&self) -> bool {
        self.value.norm() > self.unstable_above()
    }
}

/// A periodic motion and its multipliers, largest magnitude first.
#[derive(Debug, Clone, PartialEq)]
pub struct Floquet {
    /// The periodic motion, with the period, its steps and the monodromy matrix.
    pub orbit: Orbit,
    /// The multipliers, as many as the scheme carries components.
    pub multipliers: Vec<Multiplier>,
}

impl Floquet {
    /// Whether any multiplier is unstable.
    pub fn is_unstable(&self) -> bool {
        self.multipliers.iter().any(Multiplier::is_unstable)
    }

    /// The largest error of a multiplier, relative to `max(1, |ρ|)`.
    pub fn error(&self) -> f64 {
        let relative = |multiplier: &Multiplier| multiplier.error / multiplier.value.norm().max(1.0);
        self.multipliers.iter().map(relative).fold(0.0, f64::max)
    }

    /// Where no multiplier is resolved: whether the steps hide more than so many that are gone, and whether any is to be known.
    fn unresolved(&self, most_gone: usize) -> (bool, bool) {
        let gone = self.multipliers.iter().filter(|multiplier| multiplier.is_gone()).count();
        let hides = gone > most_gone;
        let none = !self.multipliers.iter().any(|multiplier| !multiplier.is_gone() && multiplier.is_resolved());
        (none && hides, none && (hides || gone < self.multipliers.len()))
    }
}

/// The accuracy asked of the multipliers of the physics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Error of every multiplier, relative to `max(1, |ρ|)`, that ends the halving of the step.
    pub tolerance: f64,
    /// Steps of a period to begin with.
    pub fewest_steps: u32,
    /// Most steps of a period; if they resolve no multiplier, up to eight times as many of a system of few unknowns.
    pub most_steps: u32,
    /// Number of multipliers below 1e-6 that are so by themselves; where none is resolved, any more are taken to be damped by the steps.
    pub most_gone: usize,
}

impl Default for Accuracy {
    fn default() -> Self {
        Self { tolerance: 1e-8, fewest_steps: 64, most_steps: 1 << 11, most_gone: usize::MAX }
    }
}

/// Most times as many steps as were asked for, where those resolve no multiplier; and most unknowns times steps then.
pub(super) const FURTHER: u32 = 8;
const MOST_WORK: u32 = 1 << 16;

/// Multipliers of a scheme on its own periodic motion, with the steps of `cycle`; [`Cycle::near`] finds those nearest to a scene's.
///
/// # Errors
/// See [`FloquetError`].
pub fn of_scheme<S: PeriodicSystem>(
    system: &mut S,
    scheme: Scheme,
    cycle: Cycle,
    guess: &Guess,
    settings: &OrbitSettings,
) -> Result<Floquet, FloquetError> {
    let orbit = periodic_orbit(system, scheme, cycle, guess, settings)?;
    let (values, rounding) = eigenvalues(&orbit.monodromy)?;
    let multipliers = values.into_iter().map(|value| Multiplier { value, error: rounding }).collect();
    Ok(Floquet { orbit, multipliers })
}

/// Multipliers of the system itself: those of ESDIRK, whose step is halved until they no longer change.
///
/// The leading error, of fourth order, is extrapolated away: `ρ = ρ_2N + (ρ_2N − ρ_N)/15` (Richardson). The error of each multiplier is
/// the change of this ρ by the last halving, many times its true error where the step resolves its motion. If `most_steps` do not reach
/// the tolerance, the best is returned with its errors: large for vibrations that no step resolved, small for the others. If they resolve
/// none, as of a crank that turns slowly beside its vibrations, the step is halved further, as far as the number of unknowns allows.
///
/// # Errors
/// See [`FloquetError`]. If coarse steps fail, finer ones are tried.
pub fn of_physics<S: PeriodicSystem>(
    system: &mut S,
    period_s: f64,
    guess: &Guess,
    accuracy: &Accuracy,
    settings: &OrbitSettings,
) -> Result<Floquet, FloquetError> {
    let (mut guess, mut steps) = (guess.clone(), accuracy.fewest_steps.max(1));
    let mut coarse: Option<Level> = None;
    let unknowns = u32::try_from(system.degrees_of_freedom()).unwrap_or(u32::MAX);
    let most_for_one = (MOST_WORK / unknowns.max(1)).min(FURTHER * accuracy.most_steps).max(accuracy.most_steps);
    let mut unresolved: Option<Floquet> = None;
    loop {
        let is_last = steps > accuracy.most_steps / 2;
        match of_scheme(system, Scheme::Esdirk, Cycle { period_s, steps }, &guess, settings) {
            Ok(mut fine) => {
                let Orbit { q, v, advance, .. } = fine.orbit.clone();
                guess = Guess { q, v, advance: Some(advance) };
                if is_last && coarse.is_none() {
                    // Without another number of steps, no error is known. From here, fewer find the motion, too.
                    let fewer = of_scheme(system, Scheme::Esdirk, Cycle { period_s, steps: steps / 2 }, &guess, settings);
                    coarse = fewer.ok().map(|mut fewer| Level::refine(&mut fewer.multipliers, None));
                }
                let level = Level::refine(&mut fine.multipliers, coarse.as_ref());
                let (hides, is_unknown) = fine.unresolved(accuracy.most_gone);
                let goes_on = !is_last || steps <= most_for_one / 2 && is_unknown;
                if !goes_on || fine.error() <= accuracy.tolerance && !hides {
                    return Ok(fine);
                }
                unresolved = Some(fine).filter(|_| is_last);
                coarse = Some(level);
            }
            Err(error) if is_last || coarse.is_some() => return unresolved.ok_or(error),
            Err(_) => (),
        }
        steps *= 2;
    }
}

/// Multipliers of one number of steps: as computed, and extrapolated.
struct Level {
    computed: Vec<Complex<f64>>,
    best: Vec<Complex<f64>>,
}

impl Level {
    /// Extrapolates multipliers, and estimates their errors; both need the level before.
    fn refine(multipliers: &mut [Multiplier], coarse: Option<&Level>) -> Self {
        let computed: Vec<Complex<f64>> = multipliers.iter().map(|multiplier| multiplier.value).collect();
        let Some(coarse) = coarse else {
            multipliers.iter_mut().for_each(|multiplier| multiplier.error = f64::INFINITY);
            return Level { best: computed.clone(), computed };
        };
        for (multiplier, before) in multipliers.iter_mut().zip(nearest(&computed, &coarse.computed)) {
            multiplier.value += (multiplier.value - before) / 15.0;
        }
        multipliers.sort_by(|one, other| larger_first(&one.value, &other.value));
        let best: Vec<Complex<f64>> = multipliers.iter().map(|multiplier| multiplier.value).collect();
        for (multiplier, before) in multipliers.iter_mut().zip(nearest(&best, &coarse.best)) {
            multiplier.error = multiplier.error.max((multiplier.value - before).norm());
        }
        Level { computed, best }
    }
}

/// For each value its partner among `others`, which are as many: the nearest pairs are taken first, so that values that no step resolved
/// do not take the partners of those that are.
fn nearest(values: &[Complex<f64>], others: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let pair = |i: usize| others.iter().enumerate().map(move |(j, other)| ((values[i] - other).norm(), i, j));
    let mut pairs: Vec<(f64, usize, usize)> = (0..values.len()).flat_map(pair).collect();
    pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut partners = vec![None; values.len()];
    let mut taken = vec![false; others.len()];
    for (_, i, j) in pairs {
        if partners[i].is_none() && !taken[j] {
            (partners[i], taken[j]) = (Some(others[j]), true);
        }
    }
    partners.into_iter().zip(values).map(|(partner, value)| partner.unwrap_or(*value)).collect()
}

fn larger_first(one: &Complex<f64>, other: &Complex<f64>) -> std::cmp::Ordering {
    other.norm().total_cmp(&one.norm()).then(other.im.total_cmp(&one.im))
}

/// Most sweeps of the eigenvalue iteration, for each row.
const ITERATIONS: usize = 100;

/// Eigenvalues of a matrix, largest magnitude first, and what rounding may do to a simple one: `n ε` of the balanced norm.
pub(super) fn eigenvalues(matrix: &DMatrix<f64>) -> Result<(Vec<Complex<f64>>, f64), FloquetError> {
    if matrix.is_empty() {
        return Ok((Vec::new(), 0.0));
    }
    if !matrix.iter().all(|x| x.is_finite()) {
        return Err(FloquetError::NotFinite);
    }
    let mut balanced = matrix.clone();
    balance_parlett_reinsch(&mut balanced);
    let size = balanced.nrows();
    let rounding = size as f64 * f64::EPSILON * balanced.norm();
    let schur = Schur::try_new(balanced, f64::EPSILON, ITERATIONS * size).ok_or(FloquetError::NoEigenvalues)?;
    let mut values: Vec<Complex<f64>> = schur.complex_eigenvalues().iter().copied().collect();
    if !values.iter().all(|value| value.re.is_finite() && value.im.is_finite()) {
        return Err(FloquetError::NoEigenvalues);
    }
    values.sort_by(larger_first);
    Ok((values, rounding))
}

/// Distance from the eigenvalue at which its vector is solved for, relative to `max(1, |ρ|)`.
const SHIFT: f64 = 1e-10;

/// The eigenvector of an eigenvalue by inverse iteration, its largest component 1; `None` where it is not found.
///
/// It has the components of the vectors carried: q, v and with generalised-α also α.
pub fn eigenvector(monodromy: &DMatrix<f64>, value: Complex<f64>) -> Option<DVector<Complex<f64>>> {
    let size = monodromy.nrows();
    let shifted = value + Complex::from(SHIFT * value.norm().max(1.0));
    let mut matrix = monodromy.map(Complex::from);
    for i in 0..size {
        matrix[(i, i)] -= shifted;
    }
    let factors = matrix.lu();
    // Components of no symmetry, so that no mode is orthogonal to them but by accident.
    let mut vector = DVector::from_fn(size, |i, _| Complex::new(1.0, (1.7 * i as f64).sin()));
    for _ in 0..4 {
        vector = factors.solve(&vector)?;
        let largest = vector.iter().copied().max_by(|one, other| one.norm().total_cmp(&other.norm()))?;
        vector /= largest;
    }
    vector.iter().all(|x| x.re.is_finite() && x.im.is_finite()).then_some(vector)
}

#[cfg(test)]
mod tests {
    use super::super::examples::Hill;
    use super::*;
    use std::f64::consts::PI;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    fn at_rest() -> Guess {
        Guess { q: vec![0.0], v: vec![0.0], advance: None }
    }

    /// Multipliers of Mathieu's equation over π.
    fn mathieu(a: f64, q: f64, scheme: Scheme, steps: u32) -> Result<Floquet, FloquetError> {
        let cycle = Cycle { period_s: PI, steps };
        of_scheme(&mut Hill::mathieu(a, q), scheme, cycle, &at_rest(), &OrbitSettings::default())
    }

    /// The characteristic value of ce₁ (of se₁ for −q): the least eigenvalue of the tridiagonal matrix of DLMF 28.4.
    fn characteristic(q: f64) -> f64 {
        let matrix = DMatrix::from_fn(30, 30, |i, j| match i.abs_diff(j) {
            0 => (2.0 * i as f64 + 1.0).powi(2) + if i == 0 { q } else { 0.0 },
            1 => q,
            _ => 0.0,
        });
        matrix.symmetric_eigenvalues().min()
    }

    /// A boundary of the first tongue between a stable and an unstable place.
    fn boundary(q: f64, scheme: Scheme, steps: u32, stable: f64, unstable: f64) -> Result<f64, FloquetError> {
        let (mut stable, mut unstable) = (stable, unstable);
        while (unstable - stable).abs() > 1e-9 {
            let middle = 0.5 * (stable + unstable);
            *(if mathieu(middle, q, scheme, steps)?.is_unstable() { &mut unstable } else { &mut stable }) = middle;
        }
        Ok(0.5 * (stable + unstable))
    }

    #[test]
    fn val_mathieu_first_tongue() -> Tested {
        // DLMF 28.2 and Abramowitz & Stegun, table 20.1.
        assert!((characteristic(1.0) - 1.859_108_072_5).abs() < 1e-9);
        assert!((characteristic(-1.0) + 0.110_248_816_9).abs() < 1e-9);
        let undamped = [
            (Scheme::Esdirk, 256, 1e-6),
            (Scheme::RungeKutta, 256, 1e-6),
            (Scheme::TwoPoint(0.5), 1024, 1e-4),
            (Scheme::GeneralizedAlpha(0.9), 1024, 1e-4),
        ];
        for (scheme, steps, tolerance) in undamped {
            for q in [0.1, 0.5, 1.0, 2.0] {
                let (upper, lower) = (characteristic(q), characteristic(-q));
                let middle = 0.5 * (upper + lower);
                for (exact, stable) in [(upper, upper + 0.3), (lower, lower - 0.1 * q.min(1.0))] {
                    let found = boundary(q, scheme, steps, stable, middle)?;
                    assert!((found - exact).abs() < tolerance, "{scheme:?}, q = {q}: {found} for {exact}");
                }
            }
        }
        Ok(())
    }

    /// The multipliers of the physics keep their product, 1 without damping; their stated errors hold.
    #[test]
    fn val_multipliers_of_the_physics_state_their_error() -> Tested {
        let (settings, accuracy) = (OrbitSettings::default(), Accuracy::default());
        let found = of_physics(&mut Hill::mathieu(1.0, 1.0), PI, &at_rest(), &accuracy, &settings)?;
        assert!(found.error() <= 1e-8 && found.is_unstable(), "{found:?}");
        let product: Complex<f64> = found.multipliers.iter().map(|multiplier| multiplier.value).product();
        assert!((product - 1.0).norm() < 1e-8, "{product}");
        let fine = mathieu(1.0, 1.0, Scheme::Esdirk, 8192)?;
        for (one, fine) in found.multipliers.iter().zip(&fine.multipliers) {
            assert!((one.value - fine.value).norm() <= one.error, "{one:?} {fine:?}");
        }
        Ok(())
    }

    /// Implicit Euler with 32 steps of π stabilises a tongue: its first-order term damps like `d = h (a − 2 q cos 2t)`, by the rate `h a/2`.
    #[test]
    fn val_a_scheme_that_damps_has_multipliers_of_its_own() -> Tested {
        let (a, q, steps) = (1.0, 0.05, 32);
        let physics = of_physics(&mut Hill::mathieu(a, q), PI, &at_rest(), &Accuracy::default(), &OrbitSettings::default())?;
        let euler = mathieu(a, q, Scheme::TwoPoint(1.0), steps)?;
        assert!(physics.is_unstable() && !euler.is_unstable(), "{physics:?} {euler:?}");
        // Growth of the tongue's middle, q/2 (Nayfeh & Mook, Nonlinear Oscillations, 5.2), less the damping of implicit Euler.
        let growth = [&physics, &euler].map(|found| found.multipliers[0].rate_per_s(PI));
        let h_s = PI / f64::from(steps);
        assert!((growth[0] - 0.5 * q).abs() < 1e-3, "{growth:?}");
        let damping = 0.5 * (1.0 + h_s * h_s).ln() / h_s;
        assert!((growth[0] - growth[1] - damping).abs() < 0.1 * damping, "{growth:?} {damping}");
        Ok(())
    }

    /// On `ẍ + d ẋ + k x = 0`: `ρ = R(hμ)ᴺ`, and of the physics `ρ = exp(μT)`, so the rate is `Re μ` and the frequency `Im μ/2π`.
    #[test]
    fn val_multipliers_of_an_oscillator_are_those_of_the_theory() -> Tested {
        let mu = Complex::new(-0.1, (2.25_f64 - 0.01).sqrt());
        let (mut system, settings) = (Hill::constant(2.25, 0.2), OrbitSettings::default());
        let cycle = Cycle { period_s: 1.7, steps: 10 };
        let z = mu * cycle.step_s();
        for (scheme, theory) in [
            (Scheme::TwoPoint(1.0), 1.0 / (-z + 1.0)),
            (Scheme::TwoPoint(0.5), (z * 0.5 + 1.0) / (-z * 0.5 + 1.0)),
            (Scheme::RungeKutta, (((z / 4.0 + 1.0) * z / 3.0 + 1.0) * z / 2.0 + 1.0) * z + 1.0),
        ] {
            let found = of_scheme(&mut system, scheme, cycle, &at_rest(), &settings)?;
            assert!((found.multipliers[0].value - theory.powi(10)).norm() < 1e-13, "{scheme:?} {found:?}");
        }
        let found = of_physics(&mut system, 1.7, &at_rest(), &Accuracy::default(), &settings)?.multipliers[0];
        assert!((found.value - (mu * 1.7).exp()).norm() < found.error.max(1e-12), "{found:?}");
        assert!((found.rate_per_s(1.7) - mu.re).abs() < 1e-8 && (found.frequency_hz(1.7) - mu.im / TAU).abs() < 1e-8);
        assert!(!found.is_unstable() && Multiplier { value: Complex::from(1.1), error: 0.04 }.is_unstable());
        assert!(!Multiplier { value: Complex::from(1.1), error: 0.06 }.is_unstable());
        Ok(())
    }

    #[test]
    fn prop_an_eigenvector_is_multiplied_by_its_multiplier() -> Tested {
        let found = mathieu(1.7, 0.4, Scheme::Esdirk, 64)?;
        for multiplier in &found.multipliers {
            let mode = eigenvector(&found.orbit.monodromy, multiplier.value).ok_or("no vector")?;
            let after = found.orbit.monodromy.map(Complex::from) * &mode;
            assert!((after - mode * multiplier.value).camax() < 1e-12, "{multiplier:?}");
        }
        Ok(())
    }
}
