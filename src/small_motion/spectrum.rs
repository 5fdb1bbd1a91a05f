//! The lowest eigenvalues of `(λ² M + λ D + K) φ = 0`, with their vectors.

use nalgebra::{Complex, DMatrix, DVector, linalg::Schur};

use super::NoModes;
use super::band::{Band, BandLu};
use super::linearised::Linearised;

/// Up to this many rows the whole matrix of the first-order system is treated; beyond it, Krylov's subspace.
const DENSE: usize = 120;
/// Vectors of that subspace beyond those asked for.
const SPARE: usize = 60;
/// Relative residual in the inverted system at which an eigenvalue is accepted.
const TOLERANCE: f64 = 1e-11;
/// A double eigenvalue 0, of free motion, is found to the root of rounding only: of this part of the stiffest entry's frequency, or of
/// the shift.
const FREE: f64 = 5e-8;
/// The shift is chosen anew until it lies within this factor of the highest eigenvalue asked for: what is far above the shift is lost
/// in the rounding of what is near.
const SHIFT_WITHIN: f64 = 3.0;
/// The shift chosen over that eigenvalue: on it, the system has no inverse where the eigenvalue is real, as of a motion that grows
/// without swinging.
const ABOVE: f64 = 1.1;
/// Most choices of the shift.
const SHIFTS: usize = 8;
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

/// The `count` lowest eigenvalues, in order of magnitude.
///
/// # Errors
/// [`NoModes`] where nothing can move, the position is singular, or eigenvalues are not found.
pub fn lowest(system: &Linearised, count: usize) -> Result<Vec<Eigenpair>, NoModes> {
    if system.mass.rows() == 0 {
        return Err(NoModes::NothingMoves);
    }
    let mut shift = 1.0;
    for _ in 1..SHIFTS {
        let pairs = about(system, count, shift)?;
        let highest = pairs.iter().map(|pair| pair.value.norm()).fold(0.0, f64::max);
        if highest == 0.0 || (shift / SHIFT_WITHIN..=shift * SHIFT_WITHIN).contains(&highest) {
            return Ok(pairs);
        }
        shift = ABOVE * highest;
    }
    about(system, count, shift)
}

/// Those nearest to a shift.
fn about(system: &Linearised, count: usize, shift: f64) -> Result<Vec<Eigenpair>, NoModes> {
    let inverse = Inverse::new(system, shift)?;
    let rows = 2 * system.mass.rows();
    if rows <= DENSE {
        let mut matrix = DMatrix::identity(rows, rows);
        matrix.as_mut_slice().chunks_exact_mut(rows).for_each(|column| inverse.apply(column));
        let whole = Projected { matrix, basis: DMatrix::identity(rows, rows), beyond: 0.0 };
        return Ok(pairs(system, count, shift, &whole)?.0);
    }
    let mut vectors = (2 * count + SPARE).min(rows);
    loop {
        let (found, residual) = pairs(system, count, shift, &krylov(&inverse, rows, vectors))?;
        if residual <= TOLERANCE && found.len() == count || vectors == rows {
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

/// The eigenpairs of the inverted system with the largest eigenvalues `σ/(λ − σ)`, as those of the system, and the largest of their
/// relative residuals.
fn pairs(system: &Linearised, count: usize, shift: f64, inverted: &Projected) -> Result<(Vec<Eigenpair>, f64), NoModes> {
    let Projected { matrix, basis, beyond } = inverted;
    let rows = matrix.nrows();
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return Err(NoModes::Singular);
    }
    let schur = Schur::try_new(matrix.clone(), f64::EPSILON, ITERATIONS * rows).ok_or(NoModes::NotFound)?;
    let value = |theta: &Complex<f64>| Complex::new(shift, 0.0) + theta.inv() * shift;
    let mut found: Vec<(Complex<f64>, Complex<f64>)> =
        schur.complex_eigenvalues().iter().filter(|theta| theta.norm() > 0.0).map(|theta| (*theta, value(theta))).collect();
    found.sort_by(|one, other| one.1.norm().total_cmp(&other.1.norm()));
    let free_below = FREE * shift.max(stiffest(system));
    let mut pairs: Vec<Eigenpair> = Vec::new();
    let (mut free, mut residual) = (0, 0.0_f64);
    for (theta, value) in found {
        let is_free = value.norm() < free_below;
        free += usize::from(is_free);
        // One of a conjugate pair, and one of the double eigenvalue 0 of free motion.
        let is_second = if is_free { free % 2 == 0 } else { value.im < 0.0 };
        if is_second {
            continue;
        }
        if pairs.len() == count {
            break;
        }
        let within = eigenvector(matrix, theta)?;
        residual = residual.max(beyond * within[rows - 1].norm() / theta.norm());
        let vector = basis.map(|entry| Complex::new(entry, 0.0)) * within;
        let vector = normalised(system, vector.rows(0, system.mass.rows()).into_owned());
        let value = if is_free { Complex::new(0.0, 0.0) } else { Complex::new(value.re, value.im.max(0.0)) };
        pairs.push(Eigenpair { value, vector });
    }
    Ok((pairs, residual))
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
}
