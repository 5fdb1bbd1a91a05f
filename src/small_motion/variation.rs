//! The exact tangent of a scheme's steps: small motion about a discrete trajectory, without differences.

use nalgebra::{DMatrix, DVector};

use super::linear::{Linear, Matrices};
use super::periodic::PeriodicSystem;
use super::recorded::{Recorded, Stage};
use super::scheme::Scheme;
use crate::integrate::{Integrator, NewtonSettings, State, StepError, solve_acceleration};

/// Newton's iteration as tight as rounding permits, so that steps are smooth functions of where they begin.
pub const TIGHT: NewtonSettings = NewtonSettings { tolerance: 1e-12, max_iterations: 50 };
/// One correction solves a linear stage to rounding; the tolerance only guards against useless factors.
const LINEAR: NewtonSettings = NewtonSettings { tolerance: 1e-10, max_iterations: 10 };

/// A trajectory of a scheme, and its derivatives by what it began with.
///
/// The scheme takes each step twice. The step of the system `r(t, q, v, a) = 0` records the state of every stage. The same step of
///
/// ```text
/// M δa + D δv + K δq = 0      M = ∂r/∂a,  D = ∂r/∂v,  K = ∂r/∂q  at the recorded stages
/// ```
///
/// from all unit vectors at once is the derivative of the first: the stages of a Runge–Kutta method differentiate into those of the
/// variational equations (Hairer, Lubich & Wanner, *Geometric Numerical Integration*, VI.4), and so do those of the other schemes.
///
/// Vectors *carried* are those of [`Scheme::carried_vectors`], one after the other: q, v and with generalised-α also α.
pub struct Trajectory {
    scheme: Scheme,
    unknowns: usize,
    integrator: Integrator,
    state: State,
    stages: Vec<Stage>,
    matrices: Matrices,
    /// The scheme for all variations at once, and their state.
    variations: Option<(Integrator, State)>,
}

impl Trajectory {
    /// A trajectory of `unknowns` that has not begun.
    pub fn new(scheme: Scheme, unknowns: usize, newton: NewtonSettings) -> Self {
        let zero = vec![0.0; unknowns];
        Self {
            scheme,
            unknowns,
            integrator: scheme.integrator(unknowns, newton),
            state: State::new(zero.clone(), zero),
            stages: Vec::new(),
            matrices: Matrices::new(unknowns),
            variations: None,
        }
    }

    /// Length of the vector carried.
    pub fn carried_len(&self) -> usize {
        self.scheme.carried_vectors() * self.unknowns
    }

    /// Begins at `t_s` with the vectors `carried`; accelerations are those that the equations ask for.
    ///
    /// # Errors
    /// [`StepError`] when accelerations cannot be solved for.
    pub fn begin<S: PeriodicSystem>(&mut self, system: &mut S, t_s: f64, carried: &[f64]) -> Result<(), StepError> {
        let (n, columns) = (self.unknowns, self.carried_len() + usize::from(system.torque_nm().is_some()));
        let (q, rest) = carried.split_at(n);
        let (v, alpha) = rest.split_at(n);
        self.state = State::new(q.to_vec(), v.to_vec());
        balance(system, t_s, &mut self.state)?;
        if !alpha.is_empty() {
            self.state.alpha.copy_from_slice(alpha);
        }
        self.stages.clear();
        self.stages.push(Stage::default());
        self.stages[0].set(t_s, [&self.state.q, &self.state.v, &self.state.a]);
        let mut variations = unit_vectors(n, self.carried_len(), columns);
        let alpha = std::mem::take(&mut variations.alpha);
        let mut linear = Linear::new(system, &self.stages, &mut self.matrices, columns);
        balance(&mut linear, t_s, &mut variations)?;
        if self.scheme.carried_vectors() == 3 {
            variations.alpha = alpha;
        }
        let keep = self.variations.take().filter(|(_, state)| state.q.len() == n * columns);
        let integrator = keep.map_or_else(|| self.scheme.integrator(n * columns, LINEAR), |(integrator, _)| integrator);
        self.variations = Some((integrator, variations));
        Ok(())
    }

    /// Accelerations that the equations ask for at a state.
    ///
    /// # Errors
    /// [`StepError`] when they cannot be solved for.
    pub fn accelerations<S: PeriodicSystem>(
        &self,
        system: &mut S,
        t_s: f64,
        q: &[f64],
        v: &[f64],
    ) -> Result<Vec<f64>, StepError> {
        let mut state = State::new(q.to_vec(), v.to_vec());
        balance(system, t_s, &mut state)?;
        Ok(state.a)
    }

    /// Takes a step, and differentiates it.
    ///
    /// # Errors
    /// See [`StepError`]. The trajectory must begin anew after one.
    pub fn step<S: PeriodicSystem>(&mut self, system: &mut S, t_s: f64, h_s: f64) -> Result<(), StepError> {
        self.integrator.step(&mut Recorded::new(system, &mut self.stages), t_s, h_s, &mut self.state)?;
        let Some((integrator, variations)) = &mut self.variations else { return Ok(()) };
        let columns = variations.q.len() / self.unknowns.max(1);
        let mut linear = Linear::new(system, &self.stages, &mut self.matrices, columns);
        integrator.step(&mut linear, t_s, h_s, variations)?;
        if linear.is_astray() { Err(StepError::NotFinite) } else { Ok(()) }
    }

    /// The vectors carried at the present time.
    pub fn carried(&self) -> DVector<f64> {
        let alpha = if self.scheme.carried_vectors() == 3 { &self.state.alpha[..] } else { &[] };
        DVector::from_vec([&self.state.q, &self.state.v, alpha].concat())
    }

    /// Derivative of the vectors carried by those at the beginning.
    pub fn map(&self) -> DMatrix<f64> {
        let len = self.carried_len();
        let columns: Vec<DVector<f64>> = (0..len).filter_map(|column| self.column(column)).collect();
        DMatrix::from_fn(len, columns.len(), |row, column| columns[column][row])
    }

    /// Derivative of the vectors carried by the torque, where it is unknown.
    pub fn by_torque(&self) -> Option<DVector<f64>> {
        self.column(self.carried_len())
    }

    /// Trace of `M⁻¹ D` at the last stage linearised.
    #[cfg(test)]
    pub(super) fn damping_trace(&self) -> Option<f64> {
        self.matrices.damping_trace()
    }

    fn column(&self, column: usize) -> Option<DVector<f64>> {
        let (_, State { q, v, alpha, .. }) = self.variations.as_ref()?;
        let columns = q.len() / self.unknowns.max(1);
        let parts = [q, v, alpha].into_iter().take(self.scheme.carried_vectors());
        let of = parts.flat_map(|part| part.chunks_exact(columns.max(1)).filter_map(|row| row.get(column).copied()));
        let of: Vec<f64> = of.collect();
        (of.len() == self.carried_len()).then(|| DVector::from_vec(of))
    }
}

/// Gives a state the accelerations and the residual that the step before would have left.
fn balance<S: crate::integrate::System>(system: &mut S, t_s: f64, state: &mut State) -> Result<(), StepError> {
    let State { q, v, a, alpha, residual } = state;
    solve_acceleration(system, t_s, q, v, a, residual)?;
    system.residual(t_s, q, v, a, residual);
    alpha.clone_from(a);
    Ok(())
}

/// One variation for each of the `carried` components, and others that are nil.
fn unit_vectors(unknowns: usize, carried: usize, columns: usize) -> State {
    let zero = vec![0.0; unknowns * columns];
    let mut state = State::new(zero.clone(), zero);
    for component in 0..carried {
        let part = [&mut state.q, &mut state.v, &mut state.alpha].into_iter().nth(component / unknowns);
        if let Some(part) = part {
            part[component % unknowns * columns + component] = 1.0;
        }
    }
    state
}

#[cfg(test)]
mod tests {
    use super::super::examples::{Hill, chain, finite_elements, modal};
    use super::super::periodic::{CrankDrive, DrivenMechanism};
    use super::*;
    use crate::mechanics::Mechanism;
    use nalgebra::{Complex, DMatrixView};

    type Tested = Result<(), Box<dyn std::error::Error>>;

    const SCHEMES: [Scheme; 5] =
        [Scheme::Esdirk, Scheme::TwoPoint(0.5), Scheme::TwoPoint(1.0), Scheme::GeneralizedAlpha(0.6), Scheme::RungeKutta];

    fn map_of_step<S: PeriodicSystem>(
        system: &mut S,
        scheme: Scheme,
        h_s: f64,
        carried: &[f64],
    ) -> Result<Trajectory, StepError> {
        let mut trajectory = Trajectory::new(scheme, system.degrees_of_freedom(), TIGHT);
        trajectory.begin(system, 0.1, carried)?;
        trajectory.step(system, 0.1, h_s)?;
        Ok(trajectory)
    }

    /// On `ẍ + 0.8 ẋ + 9 x = 0`: eigenvalues of the map are `R(hμ)` of each eigenvalue μ.
    #[test]
    fn val_the_map_of_a_damped_oscillator_has_the_eigenvalues_of_the_theory() -> Tested {
        let h_s = 0.37;
        let mu = Complex::new(-0.4, (9.0_f64 - 0.16).sqrt());
        let z = mu * h_s;
        for (scheme, theory) in [
            (Scheme::Esdirk, {
                let numerator = (((z * (7.0 / 768.0) + 1.0 / 96.0) * z - 1.0 / 8.0) * z - 1.0 / 4.0) * z + 1.0;
                numerator / (-z / 4.0 + 1.0).powi(5)
            }),
            (Scheme::TwoPoint(0.5), (z * 0.5 + 1.0) / (-z * 0.5 + 1.0)),
            (Scheme::TwoPoint(0.8), (z * 0.2 + 1.0) / (-z * 0.8 + 1.0)),
            (Scheme::RungeKutta, (((z / 4.0 + 1.0) * z / 3.0 + 1.0) * z / 2.0 + 1.0) * z + 1.0),
        ] {
            let map = map_of_step(&mut Hill::constant(9.0, 0.8), scheme, h_s, &[0.2, -0.7])?.map();
            let found = map.complex_eigenvalues();
            let error = found.iter().map(|rho| (rho - theory).norm()).fold(f64::INFINITY, f64::min);
            assert!(error < 1e-13, "{scheme:?}: {found} for {theory}");
        }
        Ok(())
    }

    /// Chung & Hulbert's amplification matrix, on `(q, v, a)` scaled by `(1, ω, ω²)`.
    #[test]
    fn val_the_map_of_generalized_alpha_has_the_eigenvalues_of_chung_and_hulbert() -> Tested {
        let (h, k, d, rho) = (0.37, 9.0, 0.8, 0.6);
        let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let (gamma, beta): (f64, f64) = (0.5 - am + af, 0.25 * f64::powi(1.0 - am + af, 2));
        #[rustfmt::skip]
        let (new, old) = (
            DMatrix::from_row_slice(3, 3, &[1.0, 0.0, -beta * h * h,  0.0, 1.0, -gamma * h,  (1.0 - af) * k, (1.0 - af) * d, 1.0 - am]),
            DMatrix::from_row_slice(3, 3, &[1.0, h, (0.5 - beta) * h * h,  0.0, 1.0, (1.0 - gamma) * h,  -af * k, -af * d, -am]),
        );
        let theory = new.lu().solve(&old).ok_or("singular")?.complex_eigenvalues();
        let map = map_of_step(&mut Hill::constant(k, d), Scheme::GeneralizedAlpha(rho), h, &[0.2, -0.7, 0.3])?.map();
        for rho in map.complex_eigenvalues().iter() {
            let error = theory.iter().map(|theory| (rho - theory).norm()).fold(f64::INFINITY, f64::min);
            assert!(error < 1e-12, "{rho} is none of {theory}");
        }
        Ok(())
    }

    /// Differences of the real step, of a crank-slider that turns and vibrates, crank prescribed and free, by both models.
    #[test]
    fn val_the_map_of_a_crank_slider_agrees_with_differences_of_the_step() -> Tested {
        let chain = chain("crank-slider", &["crank.elements=2", "rod.elements=2"])?;
        let drives = [CrankDrive::Speed { start_rad: 0.4, speed_rad_per_s: 20.0 }, CrankDrive::Torque { torque_nm: 3.0 }];
        for (drive, prescribed) in drives.into_iter().zip([true, false]) {
            agrees_with_differences(&mut modal(&chain, prescribed), drive)?;
            agrees_with_differences(&mut finite_elements(&chain, prescribed), drive)?;
        }
        Ok(())
    }

    fn agrees_with_differences<M: Mechanism>(mechanism: &mut M, drive: CrankDrive) -> Tested {
        let n = mechanism.degrees_of_freedom();
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let input = DrivenMechanism::new(mechanism, drive).input(0.1);
        mechanism.start(&input, &mut q, &mut v).map_err(|_| "no start")?;
        mechanism.rigid_motion(&input, 20.0, &q, &mut v, &mut a);
        for (i, q) in q.iter_mut().enumerate() {
            *q += 1e-4 * f64::sin(i as f64);
        }
        let mut system = DrivenMechanism::new(mechanism, drive);
        for scheme in SCHEMES {
            let h_s = if scheme == Scheme::RungeKutta { 1e-6 } else { 1e-4 };
            let mut carried = [&q[..], &v, &a].concat();
            carried.truncate(scheme.carried_vectors() * n);
            let trajectory = map_of_step(&mut system, scheme, h_s, &carried)?;
            let map = trajectory.map();
            let mut differences = DMatrix::zeros(carried.len(), carried.len());
            for column in 0..carried.len() {
                // Steps of rates and accelerations that move positions alike.
                let small = 1e-5 * [1.0, 1.0 / h_s, 1.0 / (h_s * h_s)][column / n] * if column < n { 0.3 } else { 1.0 };
                let mut difference = DVector::zeros(carried.len());
                // Central differences of fourth order.
                for (places, weight) in [(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)] {
                    let mut start = carried.clone();
                    start[column] += places * small;
                    difference += map_of_step(&mut system, scheme, h_s, &start)?.carried() * (weight / (12.0 * small));
                }
                differences.set_column(column, &difference);
            }
            // Columns of one unit together: a column of almost nothing is rounding.
            for of in 0..carried.len() / n {
                let columns = of * n..(of + 1) * n;
                let at = format!("{scheme:?} {drive:?} by vector {of}");
                compare(map.columns_range(columns.clone()), differences.columns_range(columns), n, &at);
            }
            if let Some(by_torque) = trajectory.by_torque() {
                let mut ends = Vec::new();
                for torque in [3.5, 2.5] {
                    super::super::linear::set_torque(&mut system, torque);
                    ends.push(map_of_step(&mut system, scheme, h_s, &carried)?.carried());
                }
                super::super::linear::set_torque(&mut system, 3.0);
                compare(by_torque.columns(0, 1), (&ends[0] - &ends[1]).columns(0, 1), n, &format!("{scheme:?} torque"));
            }
        }
        Ok(())
    }

    /// Each of the vectors carried, relative to the largest component.
    fn compare(found: DMatrixView<'_, f64>, difference: DMatrixView<'_, f64>, n: usize, at: &str) {
        for part in 0..found.nrows() / n {
            let (found, difference) = (found.rows(part * n, n), difference.rows(part * n, n));
            let error = (found - difference).amax() / difference.amax();
            assert!(error < 1e-6, "{at}, part {part}: {error:e}");
        }
    }
}
