//! Dense LU factorization with partial pivoting, for a handful of unknowns.

use crate::mechanics::mechanism::Singular;

/// `P A = L U`, in place, with the reciprocals of the pivots on the diagonal.
#[derive(Debug, Clone)]
pub(crate) struct Lu {
    n: usize,
    /// Column by column; the matrix to factor goes in here.
    pub(crate) matrix: Vec<f64>,
    pivots: Vec<usize>,
}

impl Lu {
    pub(crate) fn new(n: usize) -> Self {
        Self { n, matrix: vec![0.0; n * n], pivots: vec![0; n] }
    }

    /// Factors `matrix`.
    pub(crate) fn factor(&mut self) -> Result<(), Singular> {
        let n = self.n;
        for k in 0..n {
            let (mut pivot, mut largest) = (k, -1.0);
            for (i, entry) in self.matrix[k * n..(k + 1) * n].iter().enumerate().skip(k) {
                if entry.abs() > largest {
                    (pivot, largest) = (i, entry.abs());
                }
            }
            self.pivots[k] = pivot;
            if pivot != k {
                self.matrix.chunks_exact_mut(n).for_each(|column| column.swap(k, pivot));
            }
            let (before, after) = self.matrix.split_at_mut((k + 1) * n);
            let column = &mut before[k * n..];
            if !column[k].is_normal() {
                return Err(Singular);
            }
            column[k] = 1.0 / column[k];
            let (inverse, below) = (column[k], &mut column[k + 1..]);
            below.iter_mut().for_each(|entry| *entry *= inverse);
            for column in after.chunks_exact_mut(n) {
                let factor = column[k];
                take_off(&mut column[k + 1..], factor, below);
            }
        }
        Ok(())
    }

    /// Solves for `x` in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        for (k, &pivot) in self.pivots.iter().enumerate() {
            x.swap(k, pivot);
        }
        let columns = self.matrix.chunks_exact(self.n.max(1)).enumerate();
        for (k, column) in columns.clone() {
            let factor = x[k];
            take_off(&mut x[k + 1..], factor, &column[k + 1..]);
        }
        for (k, column) in columns.rev() {
            x[k] *= column[k];
            let factor = x[k];
            take_off(&mut x[..k], factor, column);
        }
    }
}

/// `x −= factor · y`.
fn take_off(x: &mut [f64], factor: f64, y: &[f64]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x -= factor * y);
}
