//! The integrators on one mass, `ẍ + ω² x = 0`: spectral radius by theory and as they run, and their order.

use nalgebra::{DMatrix, Matrix3};

use crate::integrate::{
    Esdirk, GeneralizedAlpha, Integrator, NewtonSettings, RungeKutta, Singular, State, StepError, System, TwoPoint, Weights,
};
use crate::study::Table;

const NEWTON: NewtonSettings = NewtonSettings { tolerance: 1e-12, max_iterations: 20 };

/// A scheme with its parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// The two-point method of this ϑ.
    TwoPoint(f64),
    /// Generalised-α of this ρ∞.
    GeneralizedAlpha(f64),
    /// Runge–Kutta of fourth order.
    RungeKutta,
    /// ESDIRK4(3)6L[2]SA.
    Esdirk,
}

/// `r = a + ω² q`.
struct Mass {
    omega: f64,
    at_work: f64,
    tangent: f64,
}

impl System for Mass {
    fn degrees_of_freedom(&self) -> usize {
        1
    }
    fn residual(&mut self, _: f64, q: &[f64], _: &[f64], a: &[f64], r: &mut [f64]) {
        let elastic = self.omega * self.omega * q[0];
        self.at_work = a[0].abs() + elastic.abs();
        r[0] = a[0] + elastic;
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        if r[0] == 0.0 { 0.0 } else { r[0].abs() / self.at_work }
    }
    fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        self.tangent = w.acceleration + w.position * self.omega * self.omega;
        if self.tangent == 0.0 { Err(Singular) } else { Ok(()) }
    }
    fn solve(&mut self, x: &mut [f64]) {
        x[0] /= self.tangent;
    }
}

impl Scheme {
    /// ϑ or ρ∞; none for the schemes of fourth order.
    pub fn parameter(self) -> Option<f64> {
        match self {
            Scheme::TwoPoint(parameter) | Scheme::GeneralizedAlpha(parameter) => Some(parameter),
            Scheme::RungeKutta | Scheme::Esdirk => None,
        }
    }

    /// The order that theory gives it on smooth problems.
    pub fn order(self) -> f64 {
        match self {
            Scheme::TwoPoint(weight) if weight != 0.5 => 1.0,
            Scheme::TwoPoint(_) | Scheme::GeneralizedAlpha(_) => 2.0,
            Scheme::RungeKutta | Scheme::Esdirk => 4.0,
        }
    }

    fn integrator(self) -> Integrator {
        match self {
            Scheme::TwoPoint(weight) => Integrator::TwoPoint(TwoPoint::new(1, weight, NEWTON)),
            Scheme::GeneralizedAlpha(rho) => Integrator::GeneralizedAlpha(GeneralizedAlpha::new(1, rho, NEWTON)),
            Scheme::RungeKutta => Integrator::RungeKutta(RungeKutta::new(1)),
            Scheme::Esdirk => Integrator::Esdirk(Esdirk::new(1, NEWTON)),
        }
    }

    /// The largest |g| at `z = ωh`: of the two-point method `g = (1 + (1 − ϑ) i z) / (1 − ϑ i z)` (thesis 5.2); of Runge–Kutta
    /// `g = 1 + iz + (iz)²/2 + (iz)³/6 + (iz)⁴/24`; of ESDIRK
    /// `R(iz)`; of generalised-α by its amplification matrix.
    pub fn radius_in_theory(self, omega_h: f64) -> f64 {
        let z2 = omega_h * omega_h;
        match self {
            Scheme::TwoPoint(weight) => (1.0 + (1.0 - weight).powi(2) * z2).sqrt() / (1.0 + weight * weight * z2).sqrt(),
            Scheme::RungeKutta => (1.0 - z2 / 2.0 + z2 * z2 / 24.0).hypot(omega_h * (1.0 - z2 / 6.0)),
            Scheme::Esdirk => esdirk(omega_h),
            Scheme::GeneralizedAlpha(rho) => chung_hulbert(omega_h, rho),
        }
    }

    /// The same from single steps of the running integrator, h = 1, from each unit vector of `(q, v)`, or `(q, v, α)` with
    /// auxiliary accelerations, scaled by `(1, ω, ω²)`.
    ///
    /// # Errors
    /// [`StepError`] when a step cannot be taken.
    pub fn radius_as_run(self, omega_h: f64) -> Result<f64, StepError> {
        let scale = [1.0, omega_h, omega_h * omega_h];
        let size = if matches!(self, Scheme::GeneralizedAlpha(_)) { 3 } else { 2 };
        let mut matrix = DMatrix::zeros(size, size);
        for column in 0..size {
            let mut unit = [0.0; 3];
            unit[column] = scale[column];
            let mut state = State::new(vec![unit[0]], vec![unit[1]]);
            state.a[0] = -omega_h * omega_h * unit[0];
            state.alpha[0] = unit[2];
            let mut mass = Mass { omega: omega_h, at_work: 0.0, tangent: 0.0 };
            self.integrator().step(&mut mass, 0.0, 1.0, &mut state)?;
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
        let (mut integrator, h_s) = (self.integrator(), 2.0 / f64::from(steps));
        let mut mass = Mass { omega: 1.0, at_work: 0.0, tangent: 0.0 };
        let mut state = State::new(vec![1.0], vec![0.0]);
        for n in 0..steps {
            integrator.step(&mut mass, f64::from(n) * h_s, h_s, &mut state)?;
        }
        Ok((state.q[0] - 2.0_f64.cos()).hypot(state.v[0] + 2.0_f64.sin()))
    }
}

/// Chung & Hulbert 1993 as they write it, on `(d, v, a)` scaled by `(1, ω, ω²)`, h = 1:
/// `(1 − α_m) a₁ + α_m a₀ + (1 − α_f) d₁ + α_f d₀ = 0` with Newmark's formulas.
fn chung_hulbert(z: f64, rho: f64) -> f64 {
    let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
    let (gamma, beta) = (0.5 - am + af, 0.25 * (1.0 - am + af).powi(2));
    #[rustfmt::skip]
    let (new, old) = (
        Matrix3::new(1.0, 0.0, -beta * z * z,  0.0, 1.0, -gamma * z,  1.0 - af, 0.0, 1.0 - am),
        Matrix3::new(1.0, z, (0.5 - beta) * z * z,  0.0, 1.0, (1.0 - gamma) * z,  -af, 0.0, -am),
    );
    new.lu().solve(&old).map_or(f64::NAN, |matrix| radius(DMatrix::from_fn(3, 3, |i, j| matrix[(i, j)])))
}

/// `|R(iz)|` of an L-stable method of order 4 with five implicit stages, `γ = ¼`: the numerator is what `(1 − w/4)⁵ eʷ` has up to `w⁴`.
fn esdirk(z: f64) -> f64 {
    let z2 = z * z;
    let (real, imaginary) = (1.0 + z2 / 8.0 + 7.0 * z2 * z2 / 768.0, -z / 4.0 - z * z2 / 96.0);
    real.hypot(imaginary) / (1.0 + z2 / 16.0).powf(2.5)
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
