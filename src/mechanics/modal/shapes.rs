//! The displacement field of one link about its chord, and its integrals in closed form.

use std::array::from_fn;
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
    /// `Q_f[χ][j]` for each bending shape j and each of the chord and the sines, 1/m; empty without χ.
    root_shortening: Vec<[f64; W]>,
    /// `1/(2fπL)` for each sine, 1/m.
    per_wave: [f64; W],
    /// `−iπ/(2fπL)` for each mode and each of the sines, and `−iπ/(4L)` for the chord, 1/m.
    shortening: Vec<[f64; W]>,
    /// `d_m` of χ' for each cosine beyond the modes; empty without χ.
    root_cosines: Vec<f64>,
    pub(super) length_m: f64,
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
            root_shortening: Vec::new(),
            per_wave: [0.0; W],
            shortening: Vec::new(),
            root_cosines: if root { (modes + 1..=modes + sines).map(|m| root_sine(m) * wave(m)).collect() } else { Vec::new() },
            length_m,
            curvature: (1..=modes).map(|k| 0.5 * fourth(wave(k))).collect(),
            root_slope: (1..=modes).map(wave).collect(),
        };
        (shapes.mean[0], shapes.first[0], shapes.square[0]) = (0.5, 1.0 / 3.0, 1.0 / 3.0);
        for k in 1..=sines {
            shapes.mean[k] = (1.0 - sign(k)) / wave(k);
            shapes.first[k] = -sign(k) / wave(k);
            shapes.square[k] = 0.5;
            shapes.per_wave[k] = 0.5 / (wave(k) * length_m);
            shapes.with_root[k] = if root && k > modes { 0.5 * root_sine(k) } else { 0.0 };
        }
        let shortening = |i| from_fn(|f| if f == 0 { -0.25 * wave(i) / length_m } else { -wave(i) * shapes.per_wave[f] });
        shapes.shortening = (1..=modes).map(shortening).collect();
        if root {
            shapes.add_root();
            shapes.root_shortening = shapes.root_shortening();
        }
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
            from_fn(|d| chi[d] - c * s[d])
        })
    }

    fn add_root(&mut self) {
        let removed = |term: &dyn Fn(usize) -> f64| (1..=self.modes).map(term).sum::<f64>();
        let mean = 0.125 - removed(&|m| root_sine(m) * (1.0 - sign(m)) / wave(m));
        let first = 7.0 / 120.0 + removed(&|m| root_sine(m) * sign(m) / wave(m));
        let square = 2.0 / 105.0 - removed(&|m| 0.5 * squared(root_sine(m)));
        let curvature = 3.0 - removed(&|m| 0.5 * squared(root_sine(m)) * fourth(wave(m)));
        let slope = 1.0 - removed(&|m| root_sine(m) * wave(m));
        let root = self.sines + 1;
        (self.mean[root], self.first[root], self.square[root]) = (mean, first, square);
        self.curvature.push(curvature);
        self.root_slope.push(slope);
    }

    /// Room, of zeros, that [`Shapes::gradient`] and [`Shapes::pulled`] need, each its own: they set what is not always zero.
    pub(super) fn room(&self) -> Vec<f64> {
        vec![0.0; 2 * self.modes + W]
    }

    /// `−Q_fη` for each bending shape and function.
    ///
    /// With the cosine series `w' = Σ p_m cos mπξ`, `p_m = mπη_m` for the sines and `d_m η_χ` beyond, and `p_−m = p_m`:
    ///
    /// ```text
    /// (Q_0η)_i = iπ p_i/(2L)          (Q_fη)_i = iπ (p_{i+f} + p_{i−f})/(2fπL)
    /// ```
    #[inline]
    pub(super) fn gradient<const N: usize>(&self, eta: [&[f64]; N], p: &mut [Vec<f64>; 2], mut out: [&mut [[f64; W]]; N]) {
        let n = self.modes;
        for (eta, p) in eta.iter().zip(p.iter_mut()) {
            for (m, (slope, eta)) in (1..).zip(self.root_slope[..n].iter().zip(*eta)) {
                let p_m = slope * eta;
                (p[n + m], p[n - m]) = (p_m, p_m);
            }
            for (p, cosine) in p[2 * n + 1..].iter_mut().zip(&self.root_cosines) {
                *p = cosine * eta[n];
            }
        }
        for (i, shortening) in (1..).zip(&self.shortening) {
            for (out, p) in out.iter_mut().zip(p.iter()) {
                let (sum, difference) = (&p[n + i..n + i + W], &p[n - i..n - i + W]);
                out[i - 1] = from_fn(|f| shortening[f] * (sum[f] + difference[f]));
            }
        }
        if self.root {
            for (out, eta) in out.into_iter().zip(eta) {
                let mut of_root = [0.0; W];
                for (row, eta) in self.root_shortening.iter().zip(eta) {
                    of_root = from_fn(|f| of_root[f] - row[f] * eta);
                }
                out[n] = of_root;
            }
        }
    }

    /// Calls `add` with i, j ≥ i and `Σ F_f Q_f[i][j]`, which is symmetric, for forces along the chord.
    ///
    /// With `g_0 = 2F_0/L` and `g_m = 2F_m/(mπL)` it is `¼ iπ jπ (g_{i+j} + g_{i−j})` of the sines.
    pub(super) fn pulled(&self, force: impl Fn(usize) -> f64, g: &mut [f64], mut add: impl FnMut(usize, usize, f64)) {
        let n = self.modes;
        g[0] = 2.0 * force(0) / self.length_m;
        for (m, g) in g.iter_mut().enumerate().take(self.sines + 1).skip(1) {
            *g = 4.0 * self.per_wave[m] * force(m);
        }
        let waves = &self.root_slope[..n];
        for (i, wave) in waves.iter().enumerate() {
            let (quarter, sums, differences) = (0.25 * wave, &g[2 * i + 2..], &g[..n - i]);
            for (j, ((wave, sum), difference)) in (i..).zip(waves[i..].iter().zip(sums).zip(differences)) {
                add(i, j, quarter * wave * (sum + difference));
            }
        }
        for (i, row) in self.root_shortening.iter().enumerate() {
            add(i, n, (0..=self.sines).map(|f| row[f] * force(f)).sum());
        }
    }

    /// `∫ χ' φ_j' dξ/L` and `2/(fπL) ∫ χ' φ_j' cos fπξ dξ` for each bending shape j.
    fn root_shortening(&self) -> Vec<[f64; W]> {
        let row = |j: usize| {
            from_fn(|f| match f {
                0 => self.root_slopes_with_cosine(j, 0) / self.length_m,
                _ if f <= self.sines => 4.0 * self.per_wave[f] * self.root_slopes_with_cosine(j, f),
                _ => 0.0,
            })
        };
        (1..=self.bending()).map(row).collect()
    }

    /// `∫ χ' φ_j' cos fπξ dξ`, from the cosine series of the slopes; j from 1, χ the last.
    fn root_slopes_with_cosine(&self, j: usize, f: usize) -> f64 {
        match (j > self.modes, f) {
            (false, 0) => 0.0,
            (false, _) => 0.25 * wave(j) * (self.root_cosine(j + f) + self.root_cosine(j.abs_diff(f))),
            (true, 0) => {
                let tail = fourth(PI) / 90.0 - (1..=self.modes).map(|m| 1.0 / fourth(m as f64)).sum::<f64>();
                18.0 / fourth(PI) * tail
            }
            (true, _) => {
                let sums = (1..f).map(|m| self.root_cosine(m) * self.root_cosine(f - m)).sum::<f64>();
                0.25 * (sums + 2.0 * 36.0 / fourth(PI) * tail_of_products(self.modes, f))
            }
        }
    }

    /// `d_m` of χ': zero for what the modes already hold.
    fn root_cosine(&self, m: usize) -> f64 {
        if m > self.modes { root_sine(m) * wave(m) } else { 0.0 }
    }
}

/// x², multiplied out. Where a compiler knows x, it may compute `powi` by `pow`, which rounds otherwise: the bits of a motion would depend
/// on the build.
fn squared(x: f64) -> f64 {
    x * x
}

/// x⁴, see [`squared`].
fn fourth(x: f64) -> f64 {
    squared(squared(x))
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
pub(super) fn root_sine(m: usize) -> f64 {
    6.0 / (wave(m) * squared(wave(m)))
}

/// `sin kπξ` and its derivatives; exactly zero at both ends.
fn sine(k: usize, xi: f64) -> [f64; 3] {
    let (w, (s, c)) = (wave(k), (wave(k) * xi).sin_cos());
    let s = if xi == 1.0 { 0.0 } else { s };
    [s, w * c, -w * w * s]
}

/// `Σ_{m > n} 1/(m² (m + k)²)` by partial fractions, `k ≥ 1`.
fn tail_of_products(n: usize, k: usize) -> f64 {
    let squares = |n: usize| PI * PI / 6.0 - (1..=n).map(|m| 1.0 / squared(m as f64)).sum::<f64>();
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
            let (mut room, mut gradient) = ([s.room(), s.room()], vec![[0.0; 8]; s.bending()]);
            for i in 0..s.bending() {
                let fi = s.function_of(i);
                near(s.curvature[i], integral(|x| s.at(fi, x)[2].powi(2)), "curvature");
                near(s.root_slope[i], s.at(fi, 0.0)[1], "slope");
                let mut one = vec![0.0; s.bending()];
                for j in 0..s.bending() {
                    one.fill(0.0);
                    one[j] = 1.0;
                    s.gradient([&one], &mut room, [&mut gradient]);
                    for (f, got) in gradient[i].iter().enumerate().take(s.sines + 1) {
                        let cosine = |x: f64| if f == 0 { 1.0 } else { 2.0 / wave(f) * (wave(f) * x).cos() };
                        let expected = integral(|x| s.at(fi, x)[1] * s.at(s.function_of(j), x)[1] * cosine(x)) / length;
                        near(-got, expected, "gradient");
                        let only = |g: usize| if g == f { 1.0 } else { 0.0 };
                        s.pulled(only, &mut s.room(), |a, b, got| {
                            if (a, b) == (i, j) {
                                near(got, expected, "pulled");
                            }
                        });
                    }
                }
            }
        }
    }
}
