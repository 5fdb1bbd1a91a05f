//! The displacement field of one link about its chord, and its integrals in closed form.

use std::f64::consts::PI;

/// Shape functions of `ξ = s/L` and their integrals over `0 ≤ ξ ≤ 1`.
///
/// The field in the chord's frame, with the chord's length `c` and functions `g_f`, is
///
/// ```text
/// x(ξ) = c ξ + Σ a_f sin fπξ            y(ξ) = Σ_{f ≤ modes} η_f sin fπξ + η_χ χ(ξ)
/// ```
///
/// that is, a vector `u_f = (a_f, η_f)` for each function: `g_0 = ξ` carries `(c, 0)`, then the sines, then χ.
/// χ is what the sines leave of the static shape `ψ = ξ − 3ξ²/2 + ξ³/2` of a moment at `ξ = 0`,
///
/// ```text
/// χ = ψ − Σ_{m ≤ modes} c_m sin mπξ = Σ_{m > modes} c_m sin mπξ,   c_m = 6/(mπ)³,   χ' = Σ d_m cos mπξ,   d_m = 6/(mπ)²
/// ```
///
/// so that it is orthogonal to them in mass and stiffness. Foreshortening (`x' = 1 − ½ w'²`, von Kármán) sets
/// `c = L − ½ ηᵀQ_0η`, `a_f = −½ ηᵀQ_fη`, the sine series of `∫ w'²`, with `(·)' = d/dξ` and
///
/// ```text
/// Q_0 = (1/L) ∫ φ_i' φ_j' dξ          Q_f = (2/(fπL)) ∫ φ_i' φ_j' cos fπξ dξ
/// ```
///
/// Tables have room for `W` functions, so that the compiler knows the length of loops over them; the rest is zero.
#[derive(Debug, Clone)]
pub(super) struct Shapes<const W: usize> {
    /// Sine modes of bending.
    pub(super) modes: usize,
    /// Whether χ is there.
    pub(super) root: bool,
    /// Sines that carry displacement, axial or transverse: functions 1 to `sines`; χ is function `sines + 1`.
    pub(super) sines: usize,
    /// `∫ g_f` for each function.
    pub(super) mean: [f64; W],
    /// `∫ ξ g_f` for each function.
    pub(super) first: [f64; W],
    /// `∫ g_f²` for each function.
    pub(super) square: [f64; W],
    /// `∫ χ sin fπξ` for each sine; zero without χ.
    pub(super) with_root: [f64; W],
    /// `Q_f[i][j]` at `i n + j` for each of the chord and the sines, 1/m.
    pub(super) shortening: Vec<[f64; W]>,
    /// `∫ φ_i''² dξ` for each bending shape.
    pub(super) curvature: Vec<f64>,
    /// `φ_i'(0)` (d/dξ) for each bending shape.
    pub(super) root_slope: Vec<f64>,
}

impl<const W: usize> Shapes<W> {
    /// `modes` sines, χ if `root`, and axial displacement in `axial` sines, for a link of length `length_m`.
    pub(super) fn new(length_m: f64, modes: usize, root: bool, axial: usize) -> Self {
        let sines = if modes == 0 && !root { 0 } else { modes.max(axial) };
        let mut shapes = Self {
            modes,
            root,
            sines,
            mean: [0.0; W],
            first: [0.0; W],
            square: [0.0; W],
            with_root: [0.0; W],
            shortening: Vec::new(),
            curvature: (1..=modes).map(|k| 0.5 * wave(k).powi(4)).collect(),
            root_slope: (1..=modes).map(wave).collect(),
        };
        (shapes.mean[0], shapes.first[0], shapes.square[0]) = (0.5, 1.0 / 3.0, 1.0 / 3.0);
        for k in 1..=sines {
            shapes.mean[k] = (1.0 - sign(k)) / wave(k);
            shapes.first[k] = -sign(k) / wave(k);
            shapes.square[k] = 0.5;
            shapes.with_root[k] = if root && k > modes { 0.5 * root_sine(k) } else { 0.0 };
        }
        if root {
            shapes.add_root();
        }
        shapes.shortening = shapes.shortening(length_m);
        shapes
    }

    /// Number of bending shapes.
    pub(super) fn bending(&self) -> usize {
        self.modes + usize::from(self.root)
    }

    /// Number of functions, the chord's included.
    pub(super) fn functions(&self) -> usize {
        1 + self.sines + usize::from(self.root)
    }

    /// The function that bending shape `i` is.
    pub(super) fn function_of(&self, i: usize) -> usize {
        if i < self.modes { i + 1 } else { self.sines + 1 }
    }

    /// `g_f`, `g_f'`, `g_f''` at `ξ`.
    pub(super) fn at(&self, f: usize, xi: f64) -> [f64; 3] {
        if f == 0 {
            return [xi, 1.0, 0.0];
        }
        if f <= self.sines {
            return sine(f, xi);
        }
        let psi = [xi * (1.0 - xi) * (1.0 - 0.5 * xi), 1.0 + xi * (-3.0 + 1.5 * xi), 3.0 * (xi - 1.0)];
        (1..=self.modes).fold(psi, |chi, m| {
            let (c, s) = (root_sine(m), sine(m, xi));
            std::array::from_fn(|d| chi[d] - c * s[d])
        })
    }

    fn add_root(&mut self) {
        let removed = |term: &dyn Fn(usize) -> f64| (1..=self.modes).map(term).sum::<f64>();
        let mean = 0.125 - removed(&|m| root_sine(m) * (1.0 - sign(m)) / wave(m));
        let first = 7.0 / 120.0 + removed(&|m| root_sine(m) * sign(m) / wave(m));
        let square = 2.0 / 105.0 - removed(&|m| 0.5 * root_sine(m).powi(2));
        let curvature = 3.0 - removed(&|m| 0.5 * root_sine(m).powi(2) * wave(m).powi(4));
        let slope = 1.0 - removed(&|m| root_sine(m) * wave(m));
        let root = self.sines + 1;
        (self.mean[root], self.first[root], self.square[root]) = (mean, first, square);
        self.curvature.push(curvature);
        self.root_slope.push(slope);
    }

    fn shortening(&self, length_m: f64) -> Vec<[f64; W]> {
        let n = self.bending();
        let entry = |f: usize, i: usize, j: usize| {
            let factor = if f == 0 { 1.0 } else { 2.0 / wave(f) } / length_m;
            if f <= self.sines { factor * self.slopes_with_cosine(f, i, j) } else { 0.0 }
        };
        (0..n * n).map(|ij| std::array::from_fn(|f| entry(f, ij / n, ij % n))).collect()
    }

    /// `∫ φ_i' φ_j' cos fπξ dξ`, from the cosine series of the slopes.
    fn slopes_with_cosine(&self, f: usize, i: usize, j: usize) -> f64 {
        let (i, j) = (i.min(j) + 1, i.max(j) + 1);
        let is = |a: usize, b: usize| if a == b { 1.0 } else { 0.0 };
        match (i > self.modes, j > self.modes, f) {
            (false, false, 0) => 0.5 * wave(i) * wave(j) * is(i, j),
            (false, false, _) => 0.25 * wave(i) * wave(j) * (is(f, i + j) + is(f, j - i)),
            (false, true, 0) => 0.0,
            (false, true, _) => 0.25 * wave(i) * (self.root_cosine(i + f) + self.root_cosine(i.abs_diff(f))),
            (true, _, 0) => {
                let tail = PI.powi(4) / 90.0 - (1..=self.modes).map(|m| (m as f64).powi(-4)).sum::<f64>();
                18.0 / PI.powi(4) * tail
            }
            (true, _, _) => {
                let sums = (1..f).map(|m| self.root_cosine(m) * self.root_cosine(f - m)).sum::<f64>();
                0.25 * (sums + 2.0 * 36.0 / PI.powi(4) * tail_of_products(self.modes, f))
            }
        }
    }

    /// `d_m` of χ': zero for what the modes already hold.
    fn root_cosine(&self, m: usize) -> f64 {
        if m > self.modes { root_sine(m) * wave(m) } else { 0.0 }
    }
}

/// `kπ`.
fn wave(k: usize) -> f64 {
    k as f64 * PI
}

/// `(−1)^k`.
fn sign(k: usize) -> f64 {
    if k.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// `c_m` of ψ.
fn root_sine(m: usize) -> f64 {
    6.0 / wave(m).powi(3)
}

/// `sin kπξ` and its derivatives; exactly zero at both ends.
fn sine(k: usize, xi: f64) -> [f64; 3] {
    let (w, (s, c)) = (wave(k), (wave(k) * xi).sin_cos());
    let s = if xi == 1.0 { 0.0 } else { s };
    [s, w * c, -w * w * s]
}

/// `Σ_{m > n} 1/(m² (m + k)²)` by partial fractions, `k ≥ 1`.
fn tail_of_products(n: usize, k: usize) -> f64 {
    let squares = |n: usize| PI * PI / 6.0 - (1..=n).map(|m| (m as f64).powi(-2)).sum::<f64>();
    let differences: f64 = (n + 1..=n + k).map(|m| 1.0 / m as f64).sum(); // Σ 1/m − 1/(m + k)
    let k2 = (k * k) as f64;
    (squares(n) + squares(n + k) - 2.0 * differences / k as f64) / k2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Composite Gauss quadrature, five points an interval.
    fn integral(f: impl Fn(f64) -> f64) -> f64 {
        let points = [(0.0, 128.0 / 225.0), (0.538469310105683, 0.478628670499366), (0.906179845938664, 0.236926885056189)];
        let n = 40;
        (0..n)
            .map(|i| {
                let at = |x: f64| f((i as f64 + 0.5 + 0.5 * x) / n as f64);
                points.iter().map(|&(x, w)| if x == 0.0 { w * at(0.0) } else { w * (at(x) + at(-x)) }).sum::<f64>()
            })
            .sum::<f64>()
            / (2 * n) as f64
    }

    #[test]
    fn val_integrals_equal_quadrature() {
        let near = |a: f64, b: f64, what: &str| assert!((a - b).abs() < 1e-11 * (1.0 + b.abs()), "{what}: {a} {b}");
        for (modes, root, axial) in [(2, true, 4), (3, false, 6), (1, true, 0), (0, true, 3)] {
            let (length, s) = (1.7, Shapes::<8>::new(1.7, modes, root, axial));
            for f in 0..s.functions() {
                near(s.mean[f], integral(|x| s.at(f, x)[0]), "mean");
                near(s.first[f], integral(|x| x * s.at(f, x)[0]), "first");
                near(s.square[f], integral(|x| s.at(f, x)[0].powi(2)), "square");
                for g in 1..f {
                    let expected = integral(|x| s.at(f, x)[0] * s.at(g, x)[0]);
                    let is_root = root && f == s.sines + 1;
                    near(if is_root { s.with_root[g] } else { 0.0 }, expected, "product");
                }
            }
            for i in 0..s.bending() {
                let fi = s.function_of(i);
                near(s.curvature[i], integral(|x| s.at(fi, x)[2].powi(2)), "curvature");
                near(s.root_slope[i], s.at(fi, 0.0)[1], "slope");
                for j in 0..s.bending() {
                    for f in 0..=s.sines {
                        let cosine = |x: f64| if f == 0 { 1.0 } else { 2.0 / wave(f) * (wave(f) * x).cos() };
                        let expected = integral(|x| s.at(fi, x)[1] * s.at(s.function_of(j), x)[1] * cosine(x)) / length;
                        near(s.shortening[i * s.bending() + j][f], expected, "shortening");
                    }
                }
            }
        }
    }
}
