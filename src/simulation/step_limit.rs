//! The longest step of the explicit scheme, from the model linearised at its start.

use nalgebra::DMatrix;
use nalgebra::linalg::{Schur, balancing::balance_parlett_reinsch};

use crate::integrate::RungeKutta;
use crate::mechanics::{Input, Mechanism, Weights};

/// Eigenvalues whose real part is above this part of them grow by themselves, whatever the scheme.
const GROWING: f64 = 1e-2;
/// Steps of the eigenvalue iteration for every row of its matrix; more than it ever needs.
const ITERATIONS: usize = 100;

/// Step limit of the explicit scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StepLimit {
    /// The longest step that is stable, s.
    pub longest_s: f64,
    /// Magnitude of the eigenvalue that limits it: the frequency of a vibration or the rate of a decay, 1/s.
    pub fastest_per_s: f64,
}

/// The limit of [`RungeKutta`] for small motion about the start `q`, at rest there: for the eigenvalues μ of
///
/// ```text
/// M ẍ + D ẋ + K x = 0      D = ∂r/∂v,  K = ∂r/∂q
/// ```
///
/// the step h with every `hμ` inside the scheme's region. `None` where nothing limits it, or the eigenvalues are not found.
/// Frequencies that change over a turn are those of the start.
pub(super) fn step_limit<M: Mechanism>(mechanism: &mut M, input: &Input, q: &[f64]) -> Option<StepLimit> {
    let limit = |[re, im]: [f64; 2]| {
        let fastest_per_s = re.hypot(im);
        if re > GROWING * fastest_per_s || fastest_per_s == 0.0 {
            return None;
        }
        let longest_s = RungeKutta::stable_to(im.abs().atan2(re.min(0.0))) / fastest_per_s;
        longest_s.is_finite().then_some(StepLimit { longest_s, fastest_per_s })
    };
    let limits = eigenvalues(mechanism, input, q)?.into_iter().filter_map(limit);
    limits.min_by(|one, other| one.longest_s.total_cmp(&other.longest_s))
}

/// The eigenvalues μ of small motion about `q`, as `[real part, imaginary part]`, 1/s; `None` if they are
/// not found.
fn eigenvalues<M: Mechanism>(mechanism: &mut M, input: &Input, q: &[f64]) -> Option<Vec<[f64; 2]>> {
    let motion = linearised(mechanism, input, q)?;
    let rows = motion.nrows();
    let eigenvalues = Schur::try_new(motion, f64::EPSILON, ITERATIONS * rows)?.complex_eigenvalues();
    Some(eigenvalues.iter().map(|x| [x.re, x.im]).collect())
}

/// The matrix of `(s x, ẋ)˙ = [0, s; −M⁻¹K/s, −M⁻¹D] (s x, ẋ)`, `s² = |M⁻¹K|`, with its rows and columns scaled alike.
fn linearised<M: Mechanism>(mechanism: &mut M, input: &Input, q: &[f64]) -> Option<DMatrix<f64>> {
    let n = q.len();
    let rest = vec![0.0; n];
    let mut tangent = |velocity, position| {
        let mut matrix = DMatrix::zeros(n, n);
        let weights = Weights { acceleration: 0.0, velocity, position };
        mechanism.tangent(input, q, &rest, &rest, weights, &mut |i, j, entry| matrix[(i, j)] += entry);
        matrix
    };
    let (mut damping, mut stiffness) = (tangent(1.0, 0.0), tangent(0.0, 1.0));
    mechanism.factor(input, q, &rest, &rest, Weights { acceleration: 1.0, velocity: 0.0, position: 0.0 }).ok()?;
    for matrix in [&mut stiffness, &mut damping] {
        matrix.as_mut_slice().chunks_exact_mut(n.max(1)).for_each(|column| mechanism.solve(column));
    }
    let scale = stiffness.norm().sqrt();
    let mut motion = DMatrix::zeros(2 * n, 2 * n);
    if scale > 0.0 {
        motion.view_mut((0, n), (n, n)).fill_diagonal(scale);
        motion.view_mut((n, 0), (n, n)).copy_from(&(stiffness / -scale));
    }
    motion.view_mut((n, n), (n, n)).copy_from(&-damping);
    if n == 0 || !motion.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    balance_parlett_reinsch(&mut motion);
    Some(motion)
}
