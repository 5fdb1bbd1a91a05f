//! Block-banded LU factorization: 2 × 2 blocks, three of them to either side of the diagonal.
//!
//! A beam element couples four neighbouring slots (vectors) of the chain, so the tangent has exactly this band and
//! elimination in the chain's order fills nothing outside it; the cost is linear in the number of slots. No pivoting
//! between blocks: the tangent is dominated by the mass or by the stiffness, which are symmetric and positive.
//!
//! The first slot is the pivot, which has no unknowns: its blocks are assembled with those of its element, and left out of the factors.

use nalgebra::{Matrix2, Vector2};

use super::beam::Blocks;
use super::layout::PIVOT;
use super::motion::Window;
use crate::mechanics::mechanism::Singular;

/// Blocks on either side of the diagonal.
const REACH: usize = 3;
/// The first slot with unknowns.
const FIRST: usize = PIVOT + 1;

/// Diagonal block `k`, the blocks to its right `(k, k+1+j)` and those below it `(k+1+j, k)`.
#[derive(Debug, Clone, Copy)]
struct Pivot {
    diagonal: Matrix2<f64>,
    right: [Matrix2<f64>; REACH],
    below: [Matrix2<f64>; REACH],
}

const EMPTY: Pivot = Pivot {
    diagonal: Matrix2::new(0.0, 0.0, 0.0, 0.0),
    right: [Matrix2::new(0.0, 0.0, 0.0, 0.0); REACH],
    below: [Matrix2::new(0.0, 0.0, 0.0, 0.0); REACH],
};

/// A square block-banded matrix, and after [`Band::factor`] its LU factors in the same place.
#[derive(Debug, Clone)]
pub(super) struct Band {
    slots: usize,
    /// `REACH` more than `slots`, so that elimination needs no bounds of its own at the end.
    pivots: Vec<Pivot>,
}

impl Band {
    /// The zero matrix for so many slots.
    pub(super) fn new(slots: usize) -> Self {
        Self { slots, pivots: vec![EMPTY; slots + REACH] }
    }

    /// Back to zero.
    pub(super) fn clear(&mut self) {
        // Those beyond the last slot stay zero.
        self.pivots[..self.slots].fill(EMPTY);
    }

    /// Adds to block (row, column); both in the band.
    #[inline]
    pub(super) fn add(&mut self, row: usize, column: usize, block: Matrix2<f64>) {
        *self.block(row, column) += block;
    }

    /// Adds an element's blocks to the slots of its window.
    #[inline]
    pub(super) fn add_element(&mut self, window: Window, blocks: &Blocks) {
        let order = if window.swapped { [0, 1, 3, 2] } else { [0, 1, 2, 3] };
        let pivots = &mut self.pivots[window.first..window.first + 4];
        for (k, pivot) in pivots.iter_mut().enumerate() {
            pivot.diagonal += blocks[order[k]][order[k]];
            for j in k + 1..4 {
                pivot.right[j - k - 1] += blocks[order[k]][order[j]];
                pivot.below[j - k - 1] += blocks[order[j]][order[k]];
            }
        }
    }

    #[inline]
    fn block(&mut self, row: usize, column: usize) -> &mut Matrix2<f64> {
        if row == column {
            &mut self.pivots[row].diagonal
        } else if row < column {
            &mut self.pivots[row].right[column - row - 1]
        } else {
            &mut self.pivots[column].below[row - column - 1]
        }
    }

    /// Hands every block to `each(row, column, block)`.
    pub(super) fn for_each(&self, mut each: impl FnMut(usize, usize, &Matrix2<f64>)) {
        for (k, pivot) in self.pivots[..self.slots].iter().enumerate() {
            each(k, k, &pivot.diagonal);
            for j in (0..REACH).take_while(|j| k + 1 + j < self.slots) {
                each(k, k + 1 + j, &pivot.right[j]);
                each(k + 1 + j, k, &pivot.below[j]);
            }
        }
    }

    /// Takes one scalar unknown out: its row and column become those of the identity.
    pub(super) fn hold(&mut self, slot: usize, component: usize) {
        for other in slot.saturating_sub(REACH)..(slot + REACH + 1).min(self.slots) {
            self.block(slot, other).row_mut(component).fill(0.0);
            self.block(other, slot).column_mut(component).fill(0.0);
        }
        self.pivots[slot].diagonal[(component, component)] = 1.0;
    }

    /// `A = L U` in place: the diagonal keeps the inverse of U's blocks, `below` the blocks of L.
    pub(super) fn factor(&mut self) -> Result<(), Singular> {
        for k in FIRST..self.slots {
            let [pivot, next @ ..] = &mut self.pivots[k..=k + REACH] else { return Err(Singular) };
            let inverse = inverse(&pivot.diagonal)?;
            pivot.diagonal = inverse;
            if k + 1 == self.slots {
                break;
            }
            for below in &mut pivot.below {
                *below *= inverse;
            }
            let (l, u) = (&pivot.below, &pivot.right);
            next[0].diagonal -= l[0] * u[0];
            next[0].right[0] -= l[0] * u[1];
            next[0].right[1] -= l[0] * u[2];
            next[0].below[0] -= l[1] * u[0];
            next[0].below[1] -= l[2] * u[0];
            next[1].diagonal -= l[1] * u[1];
            next[1].right[0] -= l[1] * u[2];
            next[1].below[0] -= l[2] * u[1];
            next[2].diagonal -= l[2] * u[2];
        }
        Ok(())
    }

    /// Solves `A x = b`, `x` holding `b` on entry; its length is `slots + 3`, the last three zero. The pivot's stays as it is.
    pub(super) fn solve(&self, x: &mut [Vector2<f64>]) {
        for k in FIRST..self.slots - 1 {
            let pivot = &self.pivots[k];
            let known = x[k];
            for (next, below) in x[k + 1..=k + REACH].iter_mut().zip(&pivot.below) {
                *next -= below * known;
            }
        }
        for k in (FIRST..self.slots).rev() {
            let pivot = &self.pivots[k];
            let mut sum = x[k];
            for (next, right) in x[k + 1..=k + REACH].iter().zip(&pivot.right) {
                sum -= right * next;
            }
            x[k] = pivot.diagonal * sum;
        }
    }

    /// Length of the vectors that [`Band::solve`] works on.
    pub(super) fn padded(&self) -> usize {
        self.slots + REACH
    }
}

fn inverse(m: &Matrix2<f64>) -> Result<Matrix2<f64>, Singular> {
    let determinant = m.m11 * m.m22 - m.m12 * m.m21;
    if !determinant.is_normal() {
        return Err(Singular);
    }
    let scale = 1.0 / determinant;
    Ok(Matrix2::new(m.m22 * scale, -m.m12 * scale, -m.m21 * scale, m.m11 * scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn prop_band_solution_equals_the_dense_one() {
        let slots = 9;
        let mut band = Band::new(slots);
        let mut dense = DMatrix::<f64>::zeros(2 * slots, 2 * slots);
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for row in 0..slots {
            for column in row.saturating_sub(3)..(row + 4).min(slots) {
                let strong = if row == column { 8.0 } else { 0.0 };
                let block = Matrix2::new(random() + strong, random(), random(), random() + strong);
                band.add(row, column, block);
                dense.view_mut((2 * row, 2 * column), (2, 2)).copy_from(&block);
            }
        }
        band.hold(4, 1);
        dense.row_mut(9).fill(0.0);
        dense.column_mut(9).fill(0.0);
        dense[(9, 9)] = 1.0;
        let b = DVector::from_fn(2 * slots, |_, _| random());
        let mut x = vec![Vector2::zeros(); band.padded()];
        for k in 0..slots {
            x[k] = Vector2::new(b[2 * k], b[2 * k + 1]);
        }
        band.factor().unwrap();
        band.solve(&mut x);
        let unknowns = 2 * (slots - 1);
        let expected =
            dense.view((2, 2), (unknowns, unknowns)).into_owned().lu().solve(&b.rows(2, unknowns).into_owned()).unwrap();
        for k in 1..slots {
            let (x, expected) = (x[k], [expected[2 * k - 2], expected[2 * k - 1]]);
            assert!((x.x - expected[0]).abs() < 1e-14 && (x.y - expected[1]).abs() < 1e-14);
        }
    }
}
