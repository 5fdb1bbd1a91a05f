//! Discrete time: inputs that are constant during each step.

use nalgebra::{DMatrix, linalg::balancing::balance_parlett_reinsch};

use super::NoModes;
use super::state_space::StateSpace;

impl StateSpace {
    /// The exact motion from sample to sample, `step_s` apart, under inputs that are constant in between (Van Loan 1978):
    ///
    /// ```text
    /// exp([A h, B h; 0, 0]) = [A_d, B_d; 0, 1]
    /// ```
    ///
    /// by scaling and squaring (Al-Mohy & Higham 2009) of A balanced by powers of 2 (Parlett & Reinsch 1969): positions and velocities
    /// in one unit leave far fewer squarings.
    ///
    /// # Errors
    /// [`NoModes::NotFound`] where the result is not finite: a step so long that an unstable motion grows beyond all numbers.
    pub fn zero_order_hold(&self, step_s: f64) -> Result<StateSpace, NoModes> {
        let (n, m) = (self.a.nrows(), self.b.ncols());
        let mut balanced = self.a.clone();
        let scale = balance_parlett_reinsch(&mut balanced);
        let mut whole = DMatrix::zeros(n + m, n + m);
        whole.view_mut((0, 0), (n, n)).copy_from(&balanced);
        let mut inputs = DMatrix::from_fn(n, m, |i, j| self.b[(i, j)] / scale[i]);
        // The unit of an input is free: none may outweigh A.
        let unit = if inputs.amax() > 0.0 { balanced.amax() / inputs.amax() } else { 1.0 };
        let unit = if unit > 0.0 { unit } else { 1.0 };
        inputs *= unit;
        whole.view_mut((0, n), (n, m)).copy_from(&inputs);
        let whole = (whole * step_s).exp();
        let a = DMatrix::from_fn(n, n, |i, j| whole[(i, j)] * (scale[i] / scale[j]));
        let b = DMatrix::from_fn(n, m, |i, j| whole[(i, n + j)] * (scale[i] / unit));
        let finite = a.iter().chain(&b).all(|entry| entry.is_finite());
        if finite { Ok(StateSpace { a, b, step_s: Some(step_s), ..self.clone() }) } else { Err(NoModes::NotFound) }
    }
}
