//! The lowest eigenvalues of `(λ² M + λ D + K) φ = 0`, with their vectors.

use nalgebra::{Complex, DMatrix, DVector, linalg::Schur};

use super::NoModes;
use super::band::{Band, BandLu};
use super::linearised::Linearised;
use super::rounding::is_rounding;

/// Up to this many rows the whole matrix of the first-order system is treated; beyond it, Krylov's subspace.
const DENSE: usize = 120;
/// Vectors of that subspace beyond those asked for.
const SPARE: usize = 60;
/// Relative residual in the inverted system at which an eigenvalue is accepted.
const TOLERANCE: f64 = 1e-11;
/// A double eigenvalue 0, of free motion, is found to the root of rounding only: of this part of the shift, or of the stiffest entry's
/// frequency where rounding may hold the motion.
const FREE: f64 = 5e-8;
/// The shift is chosen anew until it lies within this factor of the highest eigenvalue asked for: what is far above the shift is lost
/// in the rounding of what is near.
const SHIFT_WITHIN: f64 = 3.0;
/// The shift chosen over that eigenvalue: on it, the system has no inverse where the eigenvalue is real, as of a motion that grows
/// without swinging.
const ABOVE: f64 = 1.1;
/// Most choices of the shift.
const SHIFTS: usize = 8;
/// A growth comes before a decay if their rates differ by less than this part.
const ALIKE: f64 = 1e-6;
/// Eigenvalues this far below the shift are found anew with a lower one,
const FAR_BELOW: f64 = 1e4;
/// if the next is as many times as large: none of a group is in both findings.
const GAP: f64 = 4.0;
/// A lower shift that does not end below this part of the one before finds the same again: the search ends there.
const LOWER: f64 = 0.1;
/// Iterations of the eigenvalue routine for every row of its matrix; more than it ever needs.
const ITERATIONS: usize = 100;

/// One eigenvalue and its vector; of a conjugate pair, the one with the positive imaginary part.
#[derive(Debug, Clone, PartialEq)]
pub struct Eigenpair {
    /// λ, 1/s; 0 of free motion.
    pub value: Complex<f64>,
    /// φ, in the coordinates of the model.
    pub vector: DVector<Complex<f64>>,
}

/// The first-order system `(x, w)˙`, `w = ẋ`, inverted about a real shift σ > 0: `S (x′, w′) = (x, w)` with
///
/// ```text
/// (σ² M + σ D + K) x = −(M w′ + (D + σ M) x′)      w = x′ + σ x
/// ```
///
/// whose eigenvalues are `1/(λ − σ)`. Its second half is scaled by σ, so that both have one unit.
struct Inverse<'a> {
    system: &'a Linearised,
    shift: f64,
    damping: Band,
    factors: BandLu,
}

impl<'a> Inverse<'a> {
    fn new(system: &'a Linearised, shift: f64) -> Result<Self, NoModes> {
        let damping = system.damping.combine(1.0, &system.mass, shift);
        let matrix = damping.combine(shift, &system.stiffness, 1.0);
        let factors = matrix.factor().map_err(|_| NoModes::Singular)?;
        Ok(Inverse { system, shift, damping, factors })
    }

    /// `x ← σ S x`.
    fn apply(&self, x: &mut [f64]) {
        let (first, second) = x.split_at_mut(self.system.mass.rows());
        let speed: Vec<f64> = second.iter().map(|w| w * self.shift).collect();
        let (inertia, damped) = (self.system.mass.times(&speed), self.damping.times(first));
        let mut solved: Vec<f64> = inertia.iter().zip(&damped).map(|(m, d)| -(m + d)).collect();
        self.factors.solve(&mut solved);
        for ((first, second), x) in first.iter_mut().zip(second).zip(solved) {
            *second = *first + self.shift * x;
            *first = self.shift * x;
        }
    }
}

/// The number of eigenvalues to find.
#[derive(Clone, Copy)]
enum Wanted {
    /// A number of those that are listed: see [`Eigenpair`].
    Pairs(usize),
    /// A number of all: a conjugate pair counts as two.
    Eigenvalues(usize),
}

impl Wanted {
    fn is_met(self, pairs: usize, eigenvalues: usize) -> bool {
        match self {
            Wanted::Pairs(count) => pairs >= count,
            Wanted::Eigenvalues(count) => eigenvalues >= count,
        }
    }
}

/// The eigenvalues that one shift finds.
struct Found {
    /// Each with its place among all eigenvalues.
    pairs: Vec<(usize, Eigenpair)>,
    /// Magnitudes of all eigenvalues up to the last pair, in order.
    magnitudes: Vec<f64>,
    /// Below this, an eigenvalue is rounding.
    free_below: f64,
    /// Largest relative residual in the inverted system.
    residual: f64,
    /// Whether there are as many as wanted.
    is_whole: bool,
}

impl Found {
    fn highest(&self) -> f64 {
        self.pairs.iter().map(|(_, pair)| pair.value.norm()).fold(0.0, f64::max)
    }

    /// The eigenvalues far below the shift, up to the last gap there: their number, and a shift for them. `None` if there is no gap.
    fn far_below(&self, shift: f64) -> Option<(usize, f64)> {
        let known = |magnitude: f64| magnitude.max(self.free_below);
        let gaps =
            self.magnitudes.windows(2).enumerate().map(|(place, pair)| (place + 1, known(pair[0]), pair[1] / known(pair[0])));
        let mut far = gaps.filter(|(_, below, ratio)| *ratio >= GAP && *below * FAR_BELOW <= shift);
        far.next_back().map(|(number, below, _)| (number, ABOVE * below))
    }
}

/// The `count` lowest eigenvalues, in order of magnitude.
///
/// # Errors
/// [`NoModes`] where nothing can move, the position is singular, or eigenvalues are not found.
pub fn lowest(system: &Linearised, count: usize) -> Result<Vec<Eigenpair>, NoModes> {
    if system.mass.rows() == 0 {
        return Err(NoModes::NothingMoves);
    }
    let mut asked = count;
    loop {
        let (mut pairs, is_whole) = graded(system, Wanted::Pairs(asked), (1.0, f64::INFINITY))?;
        // What is two by a high shift may be one by its own, as of free motion.
        if pairs.len() >= count || !is_whole {
            pairs.truncate(count);
            return Ok(pairs);
        }
        asked += count - pairs.len();
    }
}

/// Each eigenvalue by a shift at most [`FAR_BELOW`] times as large, where a gap allows it: by one far above, it is known to the rounding
/// of the shift only, and less where fast motion is damped strongly. Also, whether there are as many as wanted.
fn graded(system: &Linearised, wanted: Wanted, (first_shift, below): (f64, f64)) -> Result<(Vec<Eigenpair>, bool), NoModes> {
    let (found, shift) = by_own_shift(system, wanted, first_shift)?;
    // A shift that is no lower than the one before would find the same again.
    let far_below = found.far_below(shift).filter(|_| shift < LOWER * below);
    let (low, mut pairs) = match far_below {
        None => (0, Vec::new()),
        Some((low, lower_shift)) => (low, graded(system, Wanted::Eigenvalues(low), (lower_shift, shift))?.0),
    };
    pairs.extend(found.pairs.into_iter().filter(|(place, _)| *place >= low).map(|(_, pair)| pair));
    Ok((pairs, found.is_whole))
}

/// Those that are wanted by a shift of the size of the highest, and that shift.
fn by_own_shift(system: &Linearised, wanted: Wanted, first_shift: f64) -> Result<(Found, f64), NoModes> {
    let mut shift = first_shift;
    for _ in 1..SHIFTS {
        let found = about(system, wanted, shift)?;
        let highest = found.highest();
        if highest == 0.0 || (shift / SHIFT_WITHIN..=shift * SHIFT_WITHIN).contains(&highest) {
            return Ok((found, shift));
        }
        shift = ABOVE * highest;
    }
    Ok((about(system, wanted, shift)?, shift))
}

/// Those nearest to a shift.
fn about(system: &Linearised, wanted: Wanted, shift: f64) -> Result<Found, NoModes> {
    let inverse = Inverse::new(system, shift)?;
    let rows = 2 * system.mass.rows();
    if rows <= DENSE {
        let mut matrix = DMatrix::identity(rows, rows);
        matrix.as_mut_slice().chunks_exact_mut(rows).for_each(|column| inverse.apply(column));
        let whole = Projected { matrix, basis: DMatrix::identity(rows, rows), beyond: 0.0 };
        return pairs(system, wanted, shift, &whole);
    }
    let (Wanted::Pairs(count) | Wanted::Eigenvalues(count)) = wanted;
    let mut vectors = (2 * count + SPARE).min(rows);
    loop {
        let found = pairs(system, wanted, shift, &krylov(&inverse, rows, vectors))?;
        if found.residual <= TOLERANCE && found.is_whole || vectors == rows {
            return Ok(found);
        }
        vectors = (2 * vectors).min(rows);
    }
}

/// The inverted system in a basis V: `S V = V H` but for `beyond` times the last unit vector.
struct Projected {
    matrix: DMatrix<f64>,
    basis: DMatrix<f64>,
    beyond: f64,
}

/// Arnoldi's basis, orthogonalised twice.
fn krylov(inverse: &Inverse<'_>, rows: usize, vectors: usize) -> Projected {
    let mut basis = DMatrix::zeros(rows, vectors);
    let mut projected = DMatrix::zeros(vectors, vectors);
    // Any vector with a part in every mode.
    let mut next = DVector::from_fn(rows, |i, _| 1.0 + (i as f64 * 1.234_567).sin());
    for k in 0..vectors {
        let norm = next.norm();
        if k > 0 {
            projected[(k, k - 1)] = norm;
        }
        next /= norm;
        basis.set_column(k, &next);
        inverse.apply(next.as_mut_slice());
        for _ in 0..2 {
            let within = basis.columns(0, k + 1);
            let parts = within.tr_mul(&next);
            next -= within * &parts;
            projected.view_mut((0, k), (k + 1, 1)).zip_apply(&parts, |entry, part| *entry += part);
        }
    }
    Projected { matrix: projected, basis, beyond: next.norm() }
}

/// The eigenpairs of the inverted system with the largest eigenvalues `σ/(λ − σ)`, as those of the system.
fn pairs(system: &Linearised, wanted: Wanted, shift: f64, inverted: &Projected) -> Result<Found, NoModes> {
    let Projected { matrix, basis, beyond } = inverted;
    let rows = matrix.nrows();
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err(NoModes::Singular);
    }
    let schur = Schur::try_new(matrix.clone(), f64::EPSILON, ITERATIONS * rows).ok_or(NoModes::NotFound)?;
    let value = |theta: &Complex<f64>| Complex::new(shift, 0.0) + theta.inv() * shift;
    let mut values: Vec<(Complex<f64>, Complex<f64>)> =
        schur.complex_eigenvalues().iter().filter(|theta| theta.norm() > 0.0).map(|theta| (*theta, value(theta))).collect();
    values.sort_by(|one, other| one.1.norm().total_cmp(&other.1.norm()));
    for k in 1..values.len() {
        let [one, other] = [values[k - 1].1, values[k].1];
        let is_alike = one.im == 0.0 && other.im == 0.0 && (one.norm() - other.norm()).abs() <= ALIKE * other.norm();
        if is_alike && one.re < 0.0 && other.re > 0.0 {
            values.swap(k - 1, k);
        }
    }
    let (free, maybe_free) = (FREE * shift, FREE * shift.max(stiffest(system)));
    let mut found = Found { pairs: Vec::new(), magnitudes: Vec::new(), free_below: maybe_free, residual: 0.0, is_whole: false };
    let mut number_free = 0;
    for (place, (theta, value)) in values.into_iter().enumerate() {
        let eigenvector = || -> Result<_, NoModes> {
            let within = eigenvector(matrix, theta)?;
            let vector = basis.map(|entry| Complex::new(entry, 0.0)) * &within;
            Ok((within, normalised(system, vector.rows(0, system.mass.rows()).into_owned())))
        };
        let is_free = value.norm() < free || value.norm() < maybe_free && is_rounding(system, value, &eigenvector()?.1);
        number_free += usize::from(is_free);
        // One of a conjugate pair, and one of the double eigenvalue 0 of free motion.
        let is_second = if is_free { number_free % 2 == 0 } else { value.im < 0.0 };
        if wanted.is_met(found.pairs.len(), place) && !is_second {
            break;
        }
        found.magnitudes.push(value.norm());
        if is_second {
            continue;
        }
        let (within, vector) = eigenvector()?;
        found.residual = found.residual.max(beyond * within[rows - 1].norm() / theta.norm());
        let value = if is_free { Complex::new(0.0, 0.0) } else { Complex::new(value.re, value.im.max(0.0)) };
        found.pairs.push((place, Eigenpair { value, vector }));
    }
    found.is_whole = wanted.is_met(found.pairs.len(), found.magnitudes.len());
    Ok(found)
}

/// Largest `√(Kᵢᵢ/Mᵢᵢ)`, 1/s.
fn stiffest(system: &Linearised) -> f64 {
    let diagonal = |band: &Band| -> Vec<f64> { band.iter().filter(|(i, j, _)| i == j).map(|(_, _, value)| value).collect() };
    let ratios = diagonal(&system.stiffness).into_iter().zip(diagonal(&system.mass)).filter(|(_, mass)| *mass > 0.0);
    ratios.map(|(stiffness, mass)| (stiffness / mass).abs().sqrt()).fold(0.0, f64::max)
}

/// By three steps of inverse iteration.
fn eigenvector(matrix: &DMatrix<f64>, theta: Complex<f64>) -> Result<DVector<Complex<f64>>, NoModes> {
    let rows = matrix.nrows();
    let beside = theta * (1.0 + 1e-13) + Complex::new(1e-300, 0.0);
    let mut shifted = matrix.map(|entry| Complex::new(entry, 0.0));
    for k in 0..rows {
        shifted[(k, k)] -= beside;
    }
    let factors = shifted.lu();
    let mut vector = DVector::from_fn(rows, |i, _| Complex::new(1.0 + (i as f64 * 1.234_567).sin(), 0.3));
    for _ in 0..3 {
        vector = factors.solve(&vector).ok_or(NoModes::NotFound)?;
        vector /= Complex::new(vector.norm(), 0.0);
    }
    if vector.iter().all(|entry| entry.re.is_finite() && entry.im.is_finite()) { Ok(vector) } else { Err(NoModes::NotFound) }
}

/// With `φᴴ M φ = 1`, its phase such that as much as possible of it is real.
fn normalised(system: &Linearised, vector: DVector<Complex<f64>>) -> DVector<Complex<f64>> {
    let square: Complex<f64> = vector.iter().map(|x| x * x).sum();
    let turned = vector * Complex::from_polar(1.0, -0.5 * square.arg());
    let [re, im] = [turned.map(|x| x.re), turned.map(|x| x.im)];
    let energy = |x: &DVector<f64>| x.dot(&DVector::from_vec(system.mass.times(x.as_slice())));
    let norm = (energy(&re) + energy(&im)).abs().sqrt();
    let sign = if turned[turned.map(|x| x.re.abs()).imax()].re < 0.0 { -1.0 } else { 1.0 };
    turned * Complex::new(sign / norm, 0.0)
}

#[cfg(test)]
mod tests {
    use super::super::{Point, Subject, modes};
    use crate::scene::SceneSource;
    use crate::simulation::Simulation;

    /// At three of a thousand instants of this run the second eigenvalue is real, and the shift stood on it.
    #[test]
    fn regress_modes_are_found_at_every_instant_of_a_run() -> Result<(), Box<dyn std::error::Error>> {
        let pulse = "pulse=[{start_s=0.0,torque_nm=20.0,duration_s=0.1},{start_s=2.0,torque_nm=-10.0,duration_s=0.2}]";
        let scene = SceneSource::open("crank-slider", &[pulse.to_owned()])?.scene;
        let (subject, mut simulation) = (Subject::new(&scene, None)?, Simulation::new(&scene)?);
        while simulation.time_s() < 3.0 {
            simulation.step()?;
            let point = Point::from(simulation.motion().ok_or("no motion")?);
            modes(&subject, &point, 2).map_err(|error| format!("{} s: {error}", simulation.time_s()))?;
        }
        Ok(())
    }

    /// A stiff crank with strong material damping: beside its decay of 1e8 1/s, the swing of the chain was lost, or had three digits.
    #[test]
    fn regress_a_slow_swing_is_found_beside_fast_decays() -> Result<(), Box<dyn std::error::Error>> {
        const FREE: &str = "[crank]\nlength_m = 0.05\nsection = { shape = \"rectangle\", width_m = 0.005, height_m = 0.02 }\n\
                            density_kg_per_m3 = 7850.0\nyoungs_modulus_pa = 2.1e11\nelements = 2\nmodes = 1\n\
                            [rod]\nlength_m = 0.2\nsection = { shape = \"rectangle\", width_m = 0.015, height_m = 0.0012 }\n\
                            density_kg_per_m3 = 7850.0\nyoungs_modulus_pa = 2.1e11\nelements = 4\nmodes = 3\n\
                            [slider]\nmass_kg = 0.3\n[gravity]\ny_m_per_s2 = -9.81\n[base]\ndamper_nm_s_per_rad = 5e-4\n";
        for (model, elements) in [("modal", 2), ("finite-element", 4)] {
            for damping in ["0.0", "1e-6", "1e-4", "5e-4", "1e-3"] {
                let keys = [
                    format!("solver.model={model}"),
                    format!("crank.damping_s={damping}"),
                    format!("crank.elements={elements}"),
                    format!("rod.elements={elements}"),
                ];
                let subject = Subject::new(&SceneSource::parse("free.toml", FREE, &keys)?.scene, None)?;
                let point = subject.at_rest(-std::f64::consts::FRAC_PI_2)?;
                for count in [1, 5, 8, 20] {
                    let found = modes(&subject, &point, count)?;
                    let (name, hz, damping_ratio) = (found[0].name(), found[0].frequency_hz(), found[0].damping_ratio());
                    let is_right = (hz - 0.699473).abs() < 1e-6 && (damping_ratio - 0.0665).abs() < 1e-4;
                    assert!(name == "chain swing" && is_right, "{keys:?}, {count}: {name}, {hz} Hz, {damping_ratio}");
                }
            }
        }
        Ok(())
    }

    /// The shift of the highest of 16 modes shows the double 0 of a free beam as a growth and a decay: 15 modes were found.
    #[test]
    fn regress_as_many_modes_are_found_as_asked_for() -> Result<(), Box<dyn std::error::Error>> {
        const BEAM: &str = "[beam]\nlength_m = 0.5\nsection = { shape = \"rectangle\", width_m = 0.02, height_m = 0.004 }\n\
                            density_kg_per_m3 = 7850\nyoungs_modulus_pa = 2.1e11\nelements = 16\n[base]\n[solver]\nmodel = \"finite-element\"\n";
        let subject = Subject::new(&SceneSource::parse("beam.toml", BEAM, &[])?.scene, None)?;
        for angle_rad in [0.0, 0.5, 1.6] {
            let point = subject.at_rest(angle_rad)?;
            for count in 1..=20 {
                assert_eq!(modes(&subject, &point, count)?.len(), count, "{angle_rad} rad");
            }
        }
        Ok(())
    }

    /// Upside down, it falls at the rate at which another motion dies away: that came first or second by the rounding of the shift.
    #[test]
    fn regress_of_a_fall_the_growth_comes_first() -> Result<(), Box<dyn std::error::Error>> {
        let arm = "[beam]\nlength_m = 1.1\nrigid = true\nmass_kg = 2\n[base]\n[gravity]\ny_m_per_s2 = -9.81\n";
        let subject = Subject::new(&SceneSource::parse("arm.toml", arm, &[])?.scene, None)?;
        for count in 1..=3 {
            let found = modes(&subject, &subject.at_rest(std::f64::consts::FRAC_PI_2)?, count)?;
            assert!(found[0].eigenvalue.re > 3.0, "{count}: {}", found[0].eigenvalue);
        }
        Ok(())
    }
}
