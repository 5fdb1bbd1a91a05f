//! Dense LU factors for many right-hand sides.

use nalgebra::{DMatrix, DMatrixViewMut, Dyn, PermutationSequence};

use crate::integrate::Singular;

/// `P A = L U` with partial pivoting.
#[derive(Debug, Clone)]
pub(super) struct Factors {
    permutation: PermutationSequence<Dyn>,
    lower: DMatrix<f64>,
    upper: DMatrix<f64>,
}

impl Factors {
    /// Factors a square matrix.
    pub(super) fn new(matrix: DMatrix<f64>) -> Result<Self, Singular> {
        let (permutation, lower, upper) = matrix.lu().unpack();
        let usable = upper.diagonal().iter().all(|pivot| pivot.is_normal());
        if usable { Ok(Self { permutation, lower, upper }) } else { Err(Singular) }
    }

    /// Solves `A X = B` in place. `x` holds B's rows one after the other, each of `columns`: so entries that are 0, as outside a band,
    /// cost nothing, and the others work on whole rows.
    pub(super) fn solve(&self, x: &mut [f64], columns: usize) {
        let n = self.lower.nrows();
        self.permutation.permute_columns(&mut DMatrixViewMut::from_slice(x, columns, n));
        for i in 0..n {
            let (above, row) = x.split_at_mut(i * columns);
            for j in (0..i).filter(|&j| self.lower[(i, j)] != 0.0) {
                subtract(&mut row[..columns], self.lower[(i, j)], &above[j * columns..][..columns]);
            }
        }
        for i in (0..n).rev() {
            let (rows, below) = x.split_at_mut((i + 1) * columns);
            let row = &mut rows[i * columns..];
            for j in (i + 1..n).filter(|&j| self.upper[(i, j)] != 0.0) {
                subtract(row, self.upper[(i, j)], &below[(j - i - 1) * columns..][..columns]);
            }
            row.iter_mut().for_each(|x| *x /= self.upper[(i, i)]);
        }
    }
}

fn subtract(row: &mut [f64], factor: f64, other: &[f64]) {
    for (x, other) in row.iter_mut().zip(other) {
        *x -= factor * other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_solutions_satisfy_their_equations() -> Result<(), Singular> {
        let matrix = DMatrix::from_row_slice(3, 3, &[0.0, 2.0, 1.0, 4.0, 0.0, -3.0, 1.0, 5.0, 0.5]);
        let right = DMatrix::from_fn(3, 2, |i, j| (i as f64 - 0.7) * (j as f64 + 0.3));
        let mut x = right.transpose();
        Factors::new(matrix.clone())?.solve(x.as_mut_slice(), 2);
        assert!((matrix * x.transpose() - right).amax() < 1e-14);
        Factors::new(DMatrix::zeros(2, 2)).map_or(Ok(()), |_| Err(Singular))
    }
}
