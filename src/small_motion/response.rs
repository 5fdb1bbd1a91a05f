//! Responses of a linearised mechanism to one input: over frequency, and to a step.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DMatrixView, DVector};

use super::NoModes;
use super::band::Band;
use super::linearised::Linearised;
use super::state_space::{Equations, StateSpace};

impl StateSpace {
    /// `G(iω)` of one input, for all outputs; in discrete time `e^(iωh)` stands for `iω`:
    ///
    /// ```text
    /// G(z) = C (z − A)⁻¹ b + d
    /// ```
    ///
    /// In continuous time the velocities are z times the positions, which leaves half of the equations, `(z² M + z D + K) q = f`. In
    /// A = −M⁻¹K slow motion is rounding beside that of single short elements: of a crank of 36, the response erred by 2e-2.
    ///
    /// # Errors
    /// [`NoModes::NotFound`] at the frequency of a vibration without damping.
    pub fn frequency_response(&self, input: usize, frequency_hz: f64) -> Result<DVector<Complex<f64>>, NoModes> {
        let omega = TAU * frequency_hz;
        let state = match self.step_s {
            None => self.vibrating(input, Complex::new(0.0, omega)),
            Some(step_s) => {
                shifted(&self.a, Complex::new(0.0, omega * step_s).exp()).lu().solve(&complex(&self.b.columns(input, 1)))
            }
        };
        let state = state.ok_or(NoModes::NotFound)?;
        let response = complex(&self.c.as_view()) * state.column(0) + complex(&self.d.columns(input, 1)).column(0);
        if response.iter().all(|entry| entry.is_finite()) { Ok(response) } else { Err(NoModes::NotFound) }
    }

    /// The states that vibrate as `e^(zt)`.
    fn vibrating(&self, input: usize, z: Complex<f64>) -> Option<DMatrix<Complex<f64>>> {
        let Equations { system: Linearised { mass, damping, stiffness, .. }, force } = &self.equations;
        let factors = Band::factor_sum([(mass, z * z), (damping, z), (stiffness, Complex::from(1.0))]).ok()?;
        let mut q: Vec<Complex<f64>> = force.column(input).iter().map(|force| Complex::from(*force)).collect();
        factors.solve(&mut q);
        let v = q.iter().map(|q| q * z);
        Some(DMatrix::from_iterator(2 * q.len(), 1, q.iter().copied().chain(v)))
    }

    /// The outputs of a system in discrete time at `count` samples from 0 on, after one input has gone from 0 to 1: one column a sample, exact.
    ///
    /// # Errors
    /// [`NoModes::NotFound`] where the motion grows beyond all numbers.
    pub fn step_response(&self, input: usize, count: usize) -> Result<DMatrix<f64>, NoModes> {
        self.stepped(DVector::zeros(self.a.nrows()), input, count)
    }

    /// The same within intervals between samples, each given by the number of the sample before it, in increasing order: at the samples of
    /// `finer`, the same system with `parts` steps to one of this. Each with the samples at both ends.
    ///
    /// # Errors
    /// [`NoModes::NotFound`] where the motion grows beyond all numbers.
    pub fn step_response_within(
        &self,
        (finer, parts): (&StateSpace, usize),
        input: usize,
        intervals: &[usize],
    ) -> Result<Vec<DMatrix<f64>>, NoModes> {
        let (mut x, mut sample) = (DVector::zeros(self.a.nrows()), 0);
        let mut within = |interval: &usize| {
            while sample < *interval {
                x = &self.a * &x + self.b.column(input);
                sample += 1;
            }
            finer.stepped(x.clone(), input, parts + 1)
        };
        intervals.iter().map(&mut within).collect()
    }

    /// The outputs at `count` samples from a state on, with one input at 1.
    fn stepped(&self, mut x: DVector<f64>, input: usize, count: usize) -> Result<DMatrix<f64>, NoModes> {
        let mut response = DMatrix::zeros(self.c.nrows(), count);
        for mut sample in response.column_iter_mut() {
            sample.copy_from(&(&self.c * &x + self.d.column(input)));
            x = &self.a * x + self.b.column(input);
        }
        if response.iter().all(|entry| entry.is_finite()) { Ok(response) } else { Err(NoModes::NotFound) }
    }
}

fn complex(matrix: &DMatrixView<'_, f64>) -> DMatrix<Complex<f64>> {
    matrix.map(|entry| Complex::new(entry, 0.0))
}

/// `z − A`.
fn shifted(a: &DMatrix<f64>, z: Complex<f64>) -> DMatrix<Complex<f64>> {
    let mut matrix = -complex(&a.as_view());
    matrix.set_diagonal(&matrix.diagonal().map(|entry| entry + z));
    matrix
}
