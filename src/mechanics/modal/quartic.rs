//! Terms of fourth order in the bending modes.

use std::f64::consts::PI;

/// A symmetric tensor `T_ijkl` over n modes, kept by pairs `i ≤ j`; contracted with two vectors it gives a symmetric matrix,
/// kept by the same pairs.
#[derive(Debug, Clone)]
pub(super) struct Quartic {
    pub(super) pairs: Vec<[usize; 2]>,
    /// `T_pq` for pairs p and q, row-major.
    entries: Vec<f64>,
}

impl Quartic {
    /// `factor ∫ w''² w'² dξ` of sines `w = Σ η_i sin iπξ`, as `¼ T_ijkl η_i η_j η_k η_l`.
    pub(super) fn curvature(modes: usize, factor: f64) -> Self {
        Self::new(modes, 4.0 * factor, |[i, j, k, l]| wave(i) * wave(j) * sines_cosines(i, j, k, l))
    }

    /// `factor ∫ w'⁴ dξ` of the same sines, as `¼ T_ijkl η_i η_j η_k η_l`.
    pub(super) fn slope(modes: usize, factor: f64) -> Self {
        Self::new(modes, 4.0 * factor, |[i, j, k, l]| cosines(i, j, k, l))
    }

    /// `factor iπ jπ kπ lπ` times `share`, averaged over the ways to share out four modes (counted from 1) into two pairs.
    fn new(modes: usize, factor: f64, share: impl Fn([usize; 4]) -> f64) -> Self {
        let pairs: Vec<[usize; 2]> = (0..modes).flat_map(|i| (i..modes).map(move |j| [i, j])).collect();
        let ways = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 0, 2], [2, 3, 0, 1]];
        let entry = |p: &[usize; 2], q: &[usize; 2]| {
            let n = [p[0] + 1, p[1] + 1, q[0] + 1, q[1] + 1];
            let sum: f64 = ways.iter().map(|way| share(way.map(|w| n[w]))).sum();
            factor * n.iter().map(|n| wave(*n)).product::<f64>() * sum / ways.len() as f64
        };
        let entries = pairs.iter().flat_map(|p| pairs.iter().map(move |q| entry(p, q))).collect();
        Self { pairs, entries }
    }

    /// A matrix by pairs, zero.
    pub(super) fn matrix(&self) -> Vec<f64> {
        vec![0.0; self.pairs.len()]
    }

    /// `out_ij = Σ T_ijkl a_k b_l`.
    #[inline]
    pub(super) fn contract(&self, a: &[f64], b: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let rows = self.entries.chunks_exact(self.pairs.len().max(1)); // T is symmetric in its pairs: row q is column q
        for (&[k, l], row) in self.pairs.iter().zip(rows) {
            let product = if k == l { a[k] * b[k] } else { a[k] * b[l] + a[l] * b[k] };
            for (out, entry) in out.iter_mut().zip(row) {
                *out += entry * product;
            }
        }
    }

    /// `Σ S_ij a_i b_j` of a matrix by pairs.
    #[inline]
    pub(super) fn form(&self, matrix: &[f64], a: &[f64], b: &[f64]) -> f64 {
        let terms = self.pairs.iter().zip(matrix);
        terms.map(|(&[i, j], s)| if i == j { s * a[i] * b[i] } else { s * (a[i] * b[j] + a[j] * b[i]) }).sum()
    }

    /// Calls `add(i, Σ_j S_ij a_j)` in parts.
    #[inline]
    pub(super) fn apply(&self, matrix: &[f64], a: &[f64], mut add: impl FnMut(usize, f64)) {
        for (&[i, j], s) in self.pairs.iter().zip(matrix) {
            add(i, s * a[j]);
            if i != j {
                add(j, s * a[i]);
            }
        }
    }
}

fn wave(k: usize) -> f64 {
    k as f64 * PI
}

/// `∫ cos mπξ cos nπξ dξ`.
fn orthogonal(m: usize, n: usize) -> f64 {
    match (m == n, m) {
        (false, _) => 0.0,
        (true, 0) => 1.0,
        (true, _) => 0.5,
    }
}

/// `∫ sin aπξ sin bπξ cos cπξ cos dπξ dξ`, by sums and differences.
fn sines_cosines(a: usize, b: usize, c: usize, d: usize) -> f64 {
    let with = |m: usize| orthogonal(m, c.abs_diff(d)) + orthogonal(m, c + d);
    0.25 * (with(a.abs_diff(b)) - with(a + b))
}

/// `∫ cos aπξ cos bπξ cos cπξ cos dπξ dξ`, by sums and differences.
fn cosines(a: usize, b: usize, c: usize, d: usize) -> f64 {
    let with = |m: usize| orthogonal(m, c.abs_diff(d)) + orthogonal(m, c + d);
    0.25 * (with(a.abs_diff(b)) + with(a + b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_forms_equal_quadrature() {
        let eta = [0.7, -0.4, 0.3];
        let n = 4000;
        let (mut curvature, mut slope) = (0.0, 0.0);
        for i in 0..n {
            let xi = (i as f64 + 0.5) / n as f64;
            let terms = |f: &dyn Fn(f64) -> f64| -> f64 { (1..=3).map(|k| eta[k - 1] * f(wave(k))).sum() };
            let first = terms(&|w| w * (w * xi).cos());
            let second = terms(&|w| -w * w * (w * xi).sin());
            curvature += (second * first).powi(2) / n as f64;
            slope += first.powi(4) / n as f64;
        }
        for (tensor, expected) in [(Quartic::curvature(3, 1.0), curvature), (Quartic::slope(3, 1.0), slope)] {
            let mut matrix = tensor.matrix();
            tensor.contract(&eta, &eta, &mut matrix);
            let value = 0.25 * tensor.form(&matrix, &eta, &eta);
            assert!((value / expected - 1.0).abs() < 1e-11, "{value} {expected}");
        }
    }
}
