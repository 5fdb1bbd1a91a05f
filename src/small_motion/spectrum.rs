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
/// Decays are a crowd if each rate differs from the next by less than this part, and if there are at least so many.
const CROWD: (f64, usize) = (1e-3, 3);
/// Eigenvalues this far below the shift are found anew with a lower one,
const FAR_BELOW: f64 = 1e4;
/// if the next is as many times as large: none of a group is in both findings.
const GAP: f64 = 4.0;
/// A lower shift that does not end below this part of the one before finds the same again: the search ends there.
const LOWER: f64 = 0.1;
/// Eigenvectors are found with a shift beside their eigenvalue by one of these parts of it.
const BESIDE: [f64; 3] = [1e-13, 7e-13, 5e-12];
/// A subspace in which the eigenvalue routine does not end is grown by so many vectors, and so often.
const GROWN: (usize, usize) = (7, 3);
/// Iterations of the eigenvalue routine for every row of its matrix; more than it mostly needs.
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

    /// The eigenvalues far below the shift, up to the last gap there. `None` if there is no gap.
    fn far_below(&self, shift: f64) -> Option<FarBelow> {
        let known = |magnitude: f64| magnitude.max(self.free_below);
        let gaps =
            self.magnitudes.windows(2).enumerate().map(|(place, pair)| (place + 1, known(pair[0]), pair[1] / known(pair[0])));
        let mut far = gaps.filter(|(_, below, ratio)| *ratio >= GAP && *below * FAR_BELOW <= shift);
        far.next_back().map(|(number, below, ratio)| FarBelow { number, shift: ABOVE * below, end: below * ratio.sqrt() })
    }
}

/// Eigenvalues far below a shift.
struct FarBelow {
    number: usize,
    /// A shift for them.
    shift: f64,
    /// Within the gap to the next.
    end: f64,
}

impl FarBelow {
    /// Those, by lower shifts than one above. Of several eigenvalues 0, a subspace grown from one vector may miss some by a high shift: a
    /// second rotation was lost. So as many more are looked for.
    fn pairs(&self, system: &Linearised, above: f64) -> Result<Vec<Eigenpair>, NoModes> {
        let own = graded(system, Wanted::Eigenvalues(self.number), (self.shift, above))?.0;
        // Where that does not end, those that are known stand.
        let more = about(system, Wanted::Eigenvalues(2 * self.number), self.shift).map_or(Vec::new(), |found| found.pairs);
        let more: Vec<Eigenpair> = more.into_iter().map(|(_, pair)| pair).filter(|pair| pair.value.norm() < self.end).collect();
        Ok(if more.len() > own.len() { more } else { own })
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
        let graded = graded(system, Wanted::Pairs(asked), (1.0, f64::INFINITY));
        let (mut pairs, is_whole) = graded.map_err(|why| if why == NoModes::NotFound { NoModes::NoEigenvalues } else { why })?;
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
        Some(far) => (far.number, far.pairs(system, shift)?),
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
    let (mut vectors, mut failures) = ((2 * count + SPARE).min(rows), 0);
    loop {
        let found = match pairs(system, wanted, shift, &krylov(&inverse, rows, vectors)) {
            Err(NoModes::NotFound) if failures < GROWN.1 && vectors < rows => {
                (vectors, failures) = ((vectors + GROWN.0).min(rows), failures + 1);
                continue;
            }
            found => found?,
        };
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
    let (free, maybe_free) = (FREE * shift, FREE * shift.max(stiffest(system)));
    let schur = Schur::try_new(matrix.clone(), f64::EPSILON, ITERATIONS * rows).ok_or(NoModes::NotFound)?;
    let value = |theta: &Complex<f64>| Complex::new(shift, 0.0) + theta.inv() * shift;
    let mut values: Vec<(Complex<f64>, Complex<f64>)> =
        schur.complex_eigenvalues().iter().filter(|theta| theta.norm() > 0.0).map(|theta| (*theta, value(theta))).collect();
    values.sort_by(|one, other| one.1.norm().total_cmp(&other.1.norm()));
    // Where the whole matrix is treated, each is known.
    if *beyond > 0.0 {
        let mut crowded = crowded(&values, maybe_free).into_iter();
        values.retain(|_| !crowded.next().unwrap_or(false));
    }
    for k in 1..values.len() {
        let [one, other] = [values[k - 1].1, values[k].1];
        let is_alike = one.im == 0.0 && other.im == 0.0 && (one.norm() - other.norm()).abs() <= ALIKE * other.norm();
        if is_alike && one.re < 0.0 && other.re > 0.0 {
            values.swap(k - 1, k);
        }
    }
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

/// Of eigenvalues in the order of their magnitudes, those in a crowd of decays. Under stress `E (ε + c ε̇)`, every shape of a link that
/// vibrates faster than 2/c creeps back at a rate next to 1/c: as many decays as a mesh has unknowns, and any sum of their shapes is one,
/// too. A subspace has some of them only.
fn crowded(values: &[(Complex<f64>, Complex<f64>)], maybe_free: f64) -> Vec<bool> {
    let (alike, least) = CROWD;
    let decays = |value: Complex<f64>| value.re < 0.0 && value.im.abs() <= alike * value.re.abs() && value.norm() >= maybe_free;
    let rates: Vec<f64> = values.iter().filter(|(_, value)| decays(*value)).map(|(_, value)| value.norm()).collect();
    let crowds = rates.chunk_by(|one, next| next - one <= alike * next);
    let mut are_crowded = crowds.flat_map(|crowd| std::iter::repeat_n(crowd.len() >= least, crowd.len()));
    values.iter().map(|(_, value)| decays(*value) && are_crowded.next().unwrap_or(false)).collect()
}

/// Largest `√(Kᵢᵢ/Mᵢᵢ)`, 1/s.
fn stiffest(system: &Linearised) -> f64 {
    let diagonal = |band: &Band| -> Vec<f64> { band.iter().filter(|(i, j, _)| i == j).map(|(_, _, value)| value).collect() };
    let ratios = diagonal(&system.stiffness).into_iter().zip(diagonal(&system.mass)).filter(|(_, mass)| *mass > 0.0);
    ratios.map(|(stiffness, mass)| (stiffness / mass).abs().sqrt()).fold(0.0, f64::max)
}

/// By three steps of inverse iteration.
fn eigenvector(matrix: &DMatrix<f64>, theta: Complex<f64>) -> Result<DVector<Complex<f64>>, NoModes> {
    BESIDE.into_iter().find_map(|beside| eigenvector_beside(matrix, theta, beside)).ok_or(NoModes::NotFound)
}

/// That iteration with a shift beside the eigenvalue by a part of it; `None` where the matrix is singular there.
fn eigenvector_beside(matrix: &DMatrix<f64>, theta: Complex<f64>, part: f64) -> Option<DVector<Complex<f64>>> {
    let rows = matrix.nrows();
    let beside = theta * (1.0 + part) + Complex::new(1e-300, 0.0);
    let mut shifted = matrix.map(|entry| Complex::new(entry, 0.0));
    for k in 0..rows {
        shifted[(k, k)] -= beside;
    }
    let factors = shifted.lu();
    let mut vector = DVector::from_fn(rows, |i, _| Complex::new(1.0 + (i as f64 * 1.234_567).sin(), 0.3));
    for _ in 0..3 {
        vector = factors.solve(&vector)?;
        vector /= Complex::new(vector.norm(), 0.0);
    }
    vector.iter().all(|entry| entry.re.is_finite() && entry.im.is_finite()).then_some(vector)
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
