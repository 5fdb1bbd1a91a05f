//! Dense LU factorization with partial pivoting, for a handful of unknowns.

use crate::mechanics::mechanism::Singular;

/// `P A = L U`, in place, with the reciprocals of the pivots on the diagonal.
#[derive(Debug, Clone)]
pub(crate) struct Lu {
    n: usize,
    /// Row-major; the matrix to factor goes in here.
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
            for (i, row) in self.matrix.chunks_exact(n).enumerate().skip(k) {
                if row[k].abs() > largest {
                    (pivot, largest) = (i, row[k].abs());
                }
            }
            self.pivots[k] = pivot;
            if pivot != k {
                let (upper, lower) = self.matrix.split_at_mut(pivot * n);
                upper[k * n..(k + 1) * n].swap_with_slice(&mut lower[..n]);
            }
            let (upper, lower) = self.matrix.split_at_mut((k + 1) * n);
            let row = &mut upper[k * n..];
            if !row[k].is_normal() {
                return Err(Singular);
            }
            row[k] = 1.0 / row[k];
            for below in lower.chunks_exact_mut(n) {
                let factor = below[k] * row[k];
                below[k] = factor;
                for (below, row) in below[k + 1..].iter_mut().zip(&row[k + 1..]) {
                    *below -= factor * row;
                }
            }
        }
        Ok(())
    }

    /// Solves for `x` in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        for (k, &pivot) in self.pivots.iter().enumerate() {
            x.swap(k, pivot);
        }
        let rows = self.matrix.chunks_exact(self.n.max(1));
        for (i, row) in rows.clone().enumerate() {
            x[i] -= product(&row[..i], x);
        }
        for (i, row) in rows.enumerate().rev() {
            x[i] = (x[i] - product(&row[i + 1..], &x[i + 1..])) * row[i];
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
