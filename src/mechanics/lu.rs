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
        // Two columns at a time: the unknowns are read and written half as often.
        let n = self.n;
        for (k, two) in (0..).step_by(2).zip(self.matrix.chunks_exact(2 * n.max(1))) {
            let (first, second) = two.split_at(n);
            x[k + 1] -= x[k] * first[k + 1];
            let factors = [x[k], x[k + 1]];
            take_off_two(&mut x[k + 2..], factors, [&first[k + 2..], &second[k + 2..]]);
        }
        for (k, two) in (1..n).rev().step_by(2).zip(self.matrix.rchunks_exact(2 * n.max(1))) {
            let (second, first) = two.split_at(n);
            x[k] *= first[k];
            x[k - 1] = (x[k - 1] - x[k] * first[k - 1]) * second[k - 1];
            let factors = [x[k], x[k - 1]];
            take_off_two(&mut x[..k - 1], factors, [first, second]);
        }
        if n % 2 == 1 {
            x[0] *= self.matrix[0];
        }
    }
}

/// `x −= factor · y`.
#[inline]
fn take_off(x: &mut [f64], factor: f64, y: &[f64]) {
    let ((pairs_x, rest_x), (pairs_y, rest_y)) = (x.as_chunks_mut::<2>(), y.as_chunks::<2>());
    for (x, y) in pairs_x.iter_mut().zip(pairs_y) {
        *x = [x[0] - factor * y[0], x[1] - factor * y[1]];
    }
    for (x, y) in rest_x.iter_mut().zip(rest_y) {
        *x -= factor * y;
    }
}

/// `x −= factor · y`, for the first, then for the second.
#[inline]
fn take_off_two(x: &mut [f64], factors: [f64; 2], y: [&[f64]; 2]) {
    let y = y.map(|y| &y[..x.len()]);
    for (i, x) in x.iter_mut().enumerate() {
        *x = *x - factors[0] * y[0][i] - factors[1] * y[1][i];
    }
}
