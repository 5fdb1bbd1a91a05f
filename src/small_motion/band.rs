//! Square matrices with entries near the diagonal, and their factors.

use nalgebra::{Complex, ComplexField, DMatrix};

use crate::mechanics::Singular;

/// A square matrix of `n` rows with entries up to `below` places under and `above` places over the diagonal.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    n: usize,
    below: usize,
    above: usize,
    /// Row by row, `below + 1 + above` entries each, the diagonal at `below`.
    entries: Vec<f64>,
}

impl Band {
    /// The matrix with these entries `(row, column, value)`; those of one place add up.
    pub fn new(n: usize, entries: &[(usize, usize, f64)]) -> Self {
        let present = || entries.iter().filter(|(_, _, value)| *value != 0.0);
        let below = present().map(|(i, j, _)| i.saturating_sub(*j)).max().unwrap_or(0);
        let above = present().map(|(i, j, _)| j.saturating_sub(*i)).max().unwrap_or(0);
        let width = below + 1 + above;
        let mut band = Band { n, below, above, entries: vec![0.0; n * width] };
        for &(i, j, value) in present() {
            band.entries[i * width + j + below - i] += value;
        }
        band
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.n
    }

    /// Its entries `(row, column, value)`, those that are 0 in the band among them.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let width = self.below + 1 + self.above;
        self.entries.iter().enumerate().filter_map(move |(place, value)| {
            let (i, k) = (place / width, place % width);
            let j = (i + k).checked_sub(self.below)?;
            (j < self.n).then_some((i, j, *value))
        })
    }

    /// `a self + b other`.
    pub fn combine(&self, a: f64, other: &Self, b: f64) -> Self {
        let own = self.iter().map(|(i, j, value)| (i, j, a * value));
        let entries: Vec<_> = own.chain(other.iter().map(|(i, j, value)| (i, j, b * value))).collect();
        Band::new(self.n, &entries)
    }

    /// `self other`.
    pub fn product(&self, other: &Self) -> Self {
        let width = other.below + 1 + other.above;
        let mut entries = Vec::new();
        for (i, k, value) in self.iter().filter(|(_, _, value)| *value != 0.0) {
            let row = other.entries[k * width..(k + 1) * width].iter().enumerate().filter(|(_, entry)| **entry != 0.0);
            entries.extend(row.map(|(place, entry)| (i, k + place - other.below, value * entry)));
        }
        Band::new(self.n, &entries)
    }

    /// `self x`.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let width = self.below + 1 + self.above;
        let row = |(i, row): (usize, &[f64])| -> f64 {
            let (first, skipped) = (i.saturating_sub(self.below), self.below.saturating_sub(i));
            row[skipped..].iter().zip(&x[first..]).map(|(entry, x)| entry * x).sum()
        };
        self.entries.chunks_exact(width).enumerate().map(row).collect()
    }

    /// The whole matrix.
    pub fn dense(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.n, self.n);
        self.iter().for_each(|(i, j, value)| dense[(i, j)] = value);
        dense
    }

    /// Its factors.
    ///
    /// # Errors
    /// [`Singular`] where a pivot is 0 or not finite.
    pub fn factor(&self) -> Result<BandLu, Singular> {
        BandLu::new(self.n, [self.below, self.above], self.iter())
    }

    /// Factors of a sum of matrices of one size, each times a complex number.
    ///
    /// # Errors
    /// [`Singular`] where a pivot is 0 or not finite.
    pub fn factor_sum<const N: usize>(terms: [(&Self, Complex<f64>); N]) -> Result<BandLu<Complex<f64>>, Singular> {
        let widest = |width: fn(&Self) -> usize| terms.iter().map(|(band, _)| width(band)).max().unwrap_or(0);
        let rows = terms.first().map_or(0, |(band, _)| band.n);
        let entries = terms.iter().flat_map(|(band, factor)| band.iter().map(move |(i, j, value)| (i, j, factor * value)));
        BandLu::new(rows, [widest(|band| band.below), widest(|band| band.above)], entries)
    }
}

/// `P A = L U` by elimination with row exchanges; the work is linear in the number of rows.
#[derive(Debug, Clone)]
pub struct BandLu<T = f64> {
    n: usize,
    below: usize,
    /// Entries to the right of the diagonal: exchanges add `below` to those of the matrix.
    above: usize,
    entries: Vec<T>,
    pivots: Vec<usize>,
}

impl<T: ComplexField<RealField = f64> + Copy> BandLu<T> {
    /// Of entries `(row, column, value)` so far below and above the diagonal; those of one place add up.
    fn new(n: usize, [below, above]: [usize; 2], entries: impl Iterator<Item = (usize, usize, T)>) -> Result<Self, Singular> {
        let above = below + above;
        let mut lu = BandLu { n, below, above, entries: vec![T::zero(); n * (below + 1 + above)], pivots: vec![0; n] };
        for (i, j, value) in entries {
            let place = lu.place(i, j);
            lu.entries[place] += value;
        }
        (0..n).try_for_each(|k| lu.eliminate(k))?;
        Ok(lu)
    }

    fn place(&self, i: usize, j: usize) -> usize {
        i * (self.below + 1 + self.above) + j + self.below - i
    }

    /// Column `k`: the largest entry becomes the pivot, and the rows below lose theirs.
    fn eliminate(&mut self, k: usize) -> Result<(), Singular> {
        let last_row = (k + self.below).min(self.n - 1);
        let last_column = (k + self.above).min(self.n - 1);
        let magnitude = |lu: &Self, i: usize| lu.entries[lu.place(i, k)].modulus();
        let pivot = (k..=last_row).fold(k, |best, i| if magnitude(self, i) > magnitude(self, best) { i } else { best });
        self.pivots[k] = pivot;
        if pivot != k {
            for j in k..=last_column {
                let (one, other) = (self.place(k, j), self.place(pivot, j));
                self.entries.swap(one, other);
            }
        }
        let diagonal = self.entries[self.place(k, k)];
        if !diagonal.modulus().is_normal() {
            return Err(Singular);
        }
        for i in k + 1..=last_row {
            let first = self.place(i, k);
            let factor = self.entries[first] / diagonal;
            self.entries[first] = factor;
            if factor != T::zero() {
                let (upper, lower) = self.entries.split_at_mut(first);
                let row = &upper[k * (self.below + 1 + self.above) + self.below..][1..=last_column - k];
                lower[1..].iter_mut().zip(row).for_each(|(entry, row)| *entry -= factor * *row);
            }
        }
        Ok(())
    }

    /// Solves for `x` in place.
    pub fn solve(&self, x: &mut [T]) {
        for k in 0..self.n {
            x.swap(k, self.pivots[k]);
            for i in k + 1..=(k + self.below).min(self.n - 1) {
                let carried = self.entries[self.place(i, k)] * x[k];
                x[i] -= carried;
            }
        }
        for k in (0..self.n).rev() {
            let (diagonal, last) = (self.place(k, k), (k + self.above).min(self.n - 1));
            let row = &self.entries[diagonal + 1..=diagonal + last - k];
            let sum = row.iter().zip(&x[k + 1..]).fold(T::zero(), |sum, (entry, x)| sum + *entry * *x);
            x[k] = (x[k] - sum) / self.entries[diagonal];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn prop_a_band_solves_as_the_dense_matrix_does() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for (n, below, above) in [(1, 0, 0), (12, 2, 3), (12, 11, 11), (40, 5, 1)] {
            let mut entries = Vec::new();
            for i in 0..n {
                for j in 0..n {
                    if i <= j + below && j <= i + above {
                        entries.push((i, j, random()));
                    }
                }
            }
            let band = Band::new(n, &entries);
            let b: Vec<f64> = (0..n).map(|_| random()).collect();
            let mut x = b.clone();
            band.factor().unwrap().solve(&mut x);
            let again = band.times(&x);
            assert!(again.iter().zip(&b).all(|(again, b)| (again - b).abs() < 1e-10), "{n} {below} {above}");
            let dense = band.dense().lu().solve(&DVector::from_vec(b)).unwrap();
            assert!(dense.iter().zip(&x).all(|(dense, x)| (dense - x).abs() < 1e-9 * (1.0 + x.abs())));
        }
    }

    #[test]
    fn prop_a_singular_band_is_refused() {
        assert_eq!(Band::new(2, &[(0, 0, 1.0), (0, 1, 1.0)]).factor().err(), Some(Singular));
    }
}
