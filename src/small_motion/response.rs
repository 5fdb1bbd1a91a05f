//! Responses of a linearised mechanism to one input: over frequency, and to a step.

use nalgebra::{Complex, DMatrix, DVector};

use super::NoModes;
use super::state_space::StateSpace;

impl StateSpace {
    /// `G(iω) = C (iω − A)⁻¹ b + d` of one input, for all outputs; in discrete time `e^(iωh)` stands for `iω`.
    ///
    /// # Errors
    /// [`NoModes::NotFound`] at the frequency of a vibration without damping.
    pub fn frequency_response(&self, input: usize, frequency_hz: f64) -> Result<DVector<Complex<f64>>, NoModes> {
        let omega = std::f64::consts::TAU * frequency_hz;
        let place = self.step_s.map_or(Complex::new(0.0, omega), |step_s| Complex::new(0.0, omega * step_s).exp());
        let complex = |matrix: &DMatrix<f64>| matrix.map(|entry| Complex::new(entry, 0.0));
        let column = complex(&self.b).column(input).into_owned();
        let mut matrix = -complex(&self.a);
        matrix.set_diagonal(&matrix.diagonal().map(|entry| entry + place));
        let state = matrix.lu().solve(&column).ok_or(NoModes::NotFound)?;
        let response = complex(&self.c) * state + complex(&self.d).column(input);
        if response.iter().all(|entry| entry.is_finite()) { Ok(response) } else { Err(NoModes::NotFound) }
    }

    /// The outputs at `count` samples from 0 on, `step_s` apart, after one input has gone from 0 to 1: one column a sample, exact.
    ///
    /// # Errors
    /// [`NoModes::NotFound`] where the motion grows beyond all numbers.
    pub fn step_response(&self, input: usize, step_s: f64, count: usize) -> Result<DMatrix<f64>, NoModes> {
        let sampled = self.zero_order_hold(step_s)?;
        let mut x = DVector::zeros(self.a.nrows());
        let mut response = DMatrix::zeros(self.c.nrows(), count);
        for mut sample in response.column_iter_mut() {
            sample.copy_from(&(&sampled.c * &x + sampled.d.column(input)));
            x = &sampled.a * x + sampled.b.column(input);
        }
        if response.iter().all(|entry| entry.is_finite()) { Ok(response) } else { Err(NoModes::NotFound) }
    }
}
