//! The integrators on one mass, `ẍ + d ẋ + k x = 0`: spectral radius by theory and as they run, and their order.

use nalgebra::{Complex, DMatrix, Matrix3};

use crate::integrate::{NewtonSettings, RungeKutta, Singular, State, StepError, System, Weights};
pub use crate::small_motion::scheme::Scheme;
use crate::study::Table;

const NEWTON: NewtonSettings = NewtonSettings { tolerance: 1e-12, max_iterations: 20 };

/// One mass on a spring and a damper, per unit of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Oscillator {
    /// k, 1/s².
    pub stiffness: f64,
    /// d, 1/s.
    pub damper: f64,
    /// Magnitude of its fastest eigenvalue, 1/s.
    pub fastest: f64,
}

impl Oscillator {
    pub(super) fn undamped(omega: f64) -> Self {
        Oscillator { stiffness: omega * omega, damper: 0.0, fastest: omega }
    }
}

/// `r = a + d v + k q`.
struct Mass {
    oscillator: Oscillator,
    at_work: f64,
    tangent: f64,
}

impl Mass {
    fn new(oscillator: Oscillator) -> Self {
        Mass { oscillator, at_work: 0.0, tangent: 0.0 }
    }
}

impl System for Mass {
    fn degrees_of_freedom(&self) -> usize {
        1
    }
    fn residual(&mut self, _: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let (viscous, elastic) = (self.oscillator.damper * v[0], self.oscillator.stiffness * q[0]);
        self.at_work = a[0].abs() + viscous.abs() + elastic.abs();
        r[0] = a[0] + viscous + elastic;
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        if r[0] == 0.0 { 0.0 } else { r[0].abs() / self.at_work }
    }
    fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        let Oscillator { stiffness, damper, .. } = self.oscillator;
        self.tangent = w.acceleration + w.velocity * damper + w.position * stiffness;
        if self.tangent == 0.0 { Err(Singular) } else { Ok(()) }
    }
    fn solve(&mut self, x: &mut [f64]) {
        x[0] /= self.tangent;
    }
}

impl Scheme {
    /// ϑ or ρ∞; `None` for the schemes of fourth order.
    pub fn parameter(self) -> Option<f64> {
        match self {
            Scheme::TwoPoint(parameter) | Scheme::GeneralizedAlpha(parameter) => Some(parameter),
            Scheme::RungeKutta | Scheme::Esdirk => None,
        }
    }

    /// Order on smooth problems in theory.
    pub fn order(self) -> f64 {
        match self {
            Scheme::TwoPoint(weight) if weight != 0.5 => 1.0,
            Scheme::TwoPoint(_) | Scheme::GeneralizedAlpha(_) => 2.0,
            Scheme::RungeKutta | Scheme::Esdirk => 4.0,
        }
    }

    /// The largest |g| without damping, at `z = ωh`.
    pub fn radius_in_theory(self, omega_h: f64) -> f64 {
        self.radius_of(Oscillator::undamped(omega_h), &[Complex::new(0.0, omega_h)])
    }

    /// The largest |g| for the oscillator with these eigenvalues, h = 1: of the two-point method
    /// `g = (1 + (1 − ϑ) z) / (1 − ϑ z)` (thesis 5.2); of Runge–Kutta `g = 1 + z + z²/2 + z³/6 + z⁴/24`; of ESDIRK `R(z)`; of
    /// generalised-α by its amplification matrix.
    pub(super) fn radius_of(self, oscillator: Oscillator, eigenvalues: &[Complex<f64>]) -> f64 {
        let growth = |z: Complex<f64>| match self {
            Scheme::TwoPoint(weight) => ((z * (1.0 - weight) + 1.0) / (-z * weight + 1.0)).norm(),
            Scheme::RungeKutta => RungeKutta::growth(z.re, z.im),
            Scheme::Esdirk => esdirk(z),
            Scheme::GeneralizedAlpha(rho) => chung_hulbert(oscillator, rho),
        };
        eigenvalues.iter().map(|z| growth(*z)).fold(0.0, f64::max)
    }

    /// The largest |g| without damping from single steps of the running integrator.
    ///
    /// # Errors
    /// [`StepError`] when a step cannot be taken.
    pub fn radius_as_run(self, omega_h: f64) -> Result<f64, StepError> {
        self.radius_run_on(Oscillator::undamped(omega_h))
    }

    /// The same for an oscillator, h = 1: single steps from each unit vector of `(q, v)`, or `(q, v, α)` with auxiliary accelerations,
    /// scaled by `(1, ω, ω²)`, ω the magnitude of the fastest eigenvalue.
    pub(super) fn radius_run_on(self, oscillator: Oscillator) -> Result<f64, StepError> {
        let Oscillator { stiffness, damper, fastest } = oscillator;
        let scale = [1.0, fastest, fastest * fastest];
        let size = self.carried_vectors();
        let mut matrix = DMatrix::zeros(size, size);
        for column in 0..size {
            let mut unit = [0.0; 3];
            unit[column] = scale[column];
            let mut state = State::new(vec![unit[0]], vec![unit[1]]);
            state.a[0] = -stiffness * unit[0] - damper * unit[1];
            state.alpha[0] = unit[2];
            self.integrator(1, NEWTON).step(&mut Mass::new(oscillator), 0.0, 1.0, &mut state)?;
            for (row, value) in [state.q[0], state.v[0], state.alpha[0]].into_iter().take(size).enumerate() {
                matrix[(row, column)] = value / scale[row];
            }
        }
        Ok(radius(matrix))
    }

    /// Observed order at t = 2 of `ẍ + x = 0` from `x = 1`, halving the step.
    ///
    /// # Errors
    /// [`StepError`] when a step cannot be taken.
    pub fn order_as_run(self) -> Result<f64, StepError> {
        let steps = if self.order() == 4.0 { 100 } else { 6400 };
        Ok((self.error_at_2(steps)? / self.error_at_2(2 * steps)?).log2())
    }

    fn error_at_2(self, steps: u32) -> Result<f64, StepError> {
        let (mut integrator, h_s) = (self.integrator(1, NEWTON), 2.0 / f64::from(steps));
        let mut mass = Mass::new(Oscillator::undamped(1.0));
        let mut state = State::new(vec![1.0], vec![0.0]);
        integrator.begin(&mut mass, 0.0, h_s, &mut state)?;
        for n in 0..steps {
            integrator.step(&mut mass, f64::from(n) * h_s, h_s, &mut state)?;
        }
        Ok((state.q[0] - 2.0_f64.cos()).hypot(state.v[0] + 2.0_f64.sin()))
    }
}

/// Chung & Hulbert 1993 as they write it, on `(q, v, a)` scaled by `(1, ω, ω²)`, h = 1:
/// `(1 − α_m) a₁ + α_m a₀ + (1 − α_f) (d v₁ + k q₁) + α_f (d v₀ + k q₀) = 0` with Newmark's formulas.
fn chung_hulbert(oscillator: Oscillator, rho: f64) -> f64 {
    let Oscillator { stiffness, damper, fastest: z } = oscillator;
    let (k, d) = (stiffness / (z * z), damper / z);
    let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
    let (gamma, beta) = (0.5 - am + af, 0.25 * (1.0 - am + af).powi(2));
    #[rustfmt::skip]
    let (new, old) = (
        Matrix3::new(1.0, 0.0, -beta * z * z,  0.0, 1.0, -gamma * z,  (1.0 - af) * k, (1.0 - af) * d, 1.0 - am),
        Matrix3::new(1.0, z, (0.5 - beta) * z * z,  0.0, 1.0, (1.0 - gamma) * z,  -af * k, -af * d, -am),
    );
    new.lu().solve(&old).map_or(f64::NAN, |matrix| radius(DMatrix::from_fn(3, 3, |i, j| matrix[(i, j)])))
}

/// `|R(z)|` of an L-stable method of order 4 with five implicit stages, `γ = ¼`: the numerator is what `(1 − z/4)⁵ eᶻ` has up to `z⁴`.
fn esdirk(z: Complex<f64>) -> f64 {
    let numerator = (((z * (7.0 / 768.0) + 1.0 / 96.0) * z - 1.0 / 8.0) * z - 1.0 / 4.0) * z + 1.0;
    numerator.norm() / (-z / 4.0 + 1.0).norm().powi(5)
}

fn radius(matrix: DMatrix<f64>) -> f64 {
    matrix.complex_eigenvalues().iter().map(|x| x.norm()).fold(0.0, f64::max)
}

/// One row for every scheme and every ωh: the parameter (where it has one), theory, as run, and their difference.
///
/// # Errors
/// [`StepError`] when a step cannot be taken.
pub fn radius_table(schemes: &[Scheme], omegas_h: &[f64]) -> Result<Table, StepError> {
    let pairs: Vec<(Scheme, f64)> = schemes.iter().flat_map(|&scheme| omegas_h.iter().map(move |&z| (scheme, z))).collect();
    let theory: Vec<f64> = pairs.iter().map(|(scheme, z)| scheme.radius_in_theory(*z)).collect();
    let run = pairs.iter().map(|(scheme, z)| scheme.radius_as_run(*z)).collect::<Result<Vec<f64>, _>>()?;
    let mut table = Table::default();
    if pairs.iter().any(|(scheme, _)| scheme.parameter().is_some()) {
        table.push("parameter", pairs.iter().map(|(scheme, _)| scheme.parameter().unwrap_or(f64::NAN)).collect());
    }
    table.push("omega_h", pairs.iter().map(|(_, z)| *z).collect());
    table.push("difference", theory.iter().zip(&run).map(|(theory, run)| run - theory).collect());
    table.push("radius_in_theory", theory);
    table.push("radius_as_run", run);
    Ok(table)
}

/// One row for every scheme: the parameter (where it has one), the order in theory and as run.
///
/// # Errors
/// [`StepError`] when a step cannot be taken.
pub fn order_table(schemes: &[Scheme]) -> Result<Table, StepError> {
    let mut table = Table::default();
    if schemes.iter().any(|scheme| scheme.parameter().is_some()) {
        table.push("parameter", schemes.iter().map(|scheme| scheme.parameter().unwrap_or(f64::NAN)).collect());
    }
    table.push("order_in_theory", schemes.iter().map(|scheme| scheme.order()).collect());
    table.push("order_as_run", schemes.iter().map(|scheme| scheme.order_as_run()).collect::<Result<_, _>>()?);
    Ok(table)
}
