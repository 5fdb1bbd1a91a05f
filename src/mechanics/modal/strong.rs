//! Terms of fourth order in the bending modes: what strong bending adds to the strain energy and takes from the chord.

use std::array::from_fn;
use std::f64::consts::PI;

/// Strong bending of a link by its sines `w = Σ η_i sin iπξ`, with slopes `σ = dw/dξ` and curvatures `κ = d²w/dξ²`:
///
/// ```text
/// c₄ = −1/(8 L³) ∫ σ⁴ dξ            of the chord: x' = √(1 − w'²) = 1 − ½ w'² − ⅛ w'⁴ …
/// V₄ = EJ/(2 L⁵) ∫ κ² σ² dξ         of the energy: θ'² = w''²/(1 − w'²) = w''² (1 + w'²) …
/// ```
///
/// Both integrands are cosine series up to `4nπξ`, so the midpoint rule over more than `2n` stations is exact: all sums here are
/// closed forms. The stations lie in pairs ξ and 1 − ξ, and only the first half has shapes: at its partner the slope of an even sine is
/// the same and that of an odd one opposite; curvatures the other way round. So the sums over even and over odd sines make both.
#[derive(Debug, Clone)]
pub(super) struct Strong {
    /// `1/(2 L³)` over the number of stations, 1/m³.
    shortening: f64,
    /// `EJ/L⁵` over the number of stations, N/m³.
    stiffness: f64,
    /// `φ_i'` and `φ_i''` of all modes at each group of stations in turn.
    shapes: Vec<[Group; 2]>,
    /// σ, σ̇ and κ at present, m and m/s, at each group and at its partners.
    present: Vec<[[Group; 3]; 2]>,
    /// Room for what is summed over the stations: for even modes, and for odd ones.
    sums: Vec<[[Group; 4]; 2]>,
    /// `∂c₄/∂η_i`, its rate (1/s), and `∂V₄/∂η_i`, N, at present.
    gradients: Vec<[f64; 3]>,
}

/// A value at each of some stations, side by side.
type Group = [f64; 2];

const ZERO: Group = [0.0; 2];

impl Strong {
    /// For `modes` sines on a link of length `length_m` and bending stiffness `ej_nm2`.
    pub(super) fn new(modes: usize, length_m: f64, ej_nm2: f64) -> Self {
        let groups = if modes == 0 { 0 } else { (2 * modes + 1).div_ceil(2 * ZERO.len()) };
        let count = (2 * groups * ZERO.len()).max(1) as f64;
        let at = |i: usize, g: usize| {
            let (wave, xi) = (i as f64 * PI, |s: usize| ((g * ZERO.len() + s) as f64 + 0.5) / count);
            [from_fn(|s| wave * (wave * xi(s)).cos()), from_fn(|s| -wave * wave * (wave * xi(s)).sin())]
        };
        Self {
            shortening: 0.5 / (length_m.powi(3) * count),
            stiffness: ej_nm2 / (length_m.powi(5) * count),
            shapes: (0..groups).flat_map(|g| (1..=modes).map(move |i| at(i, g))).collect(),
            present: vec![[[ZERO; 3]; 2]; groups],
            sums: vec![[[ZERO; 4]; 2]; groups],
            gradients: vec![[0.0; 3]; modes],
        }
    }

    /// Takes the present η and η̇, the sines' first.
    #[inline]
    pub(super) fn advance(&mut self, eta: &[f64], deta: &[f64]) {
        let modes = self.gradients.len();
        let ((eta, last_eta), (deta, last_deta)) = (eta[..modes].as_chunks::<2>(), deta[..modes].as_chunks::<2>());
        for (present, shapes) in self.present.iter_mut().zip(self.shapes.chunks_exact(modes.max(1))) {
            let [mut odd, mut even] = [[ZERO; 3]; 2];
            let (shapes, last) = shapes.as_chunks::<2>();
            for (shapes, (eta, deta)) in shapes.iter().zip(eta.iter().zip(deta)) {
                odd = with_mode(odd, &shapes[0], eta[0], deta[0]);
                even = with_mode(even, &shapes[1], eta[1], deta[1]);
            }
            if let ([shapes], [eta], [deta]) = (last, last_eta, last_deta) {
                odd = with_mode(odd, shapes, *eta, *deta);
            }
            let at = |k: usize| from_fn(|s| even[k][s] + odd[k][s]);
            let across = |k: usize| from_fn(|s| even[k][s] - odd[k][s]);
            *present = [[at(0), at(1), at(2)], [across(0), across(1), across(2).map(|curvature| -curvature)]];
        }
        self.set_gradients();
    }

    #[inline]
    fn set_gradients(&mut self) {
        let (shortening, stiffness) = (self.shortening, self.stiffness);
        for (sums, present) in self.sums.iter_mut().zip(&self.present) {
            let [at, across] = present.each_ref().map(|[slope, rate, curvature]| {
                let square: Group = from_fn(|s| -shortening * slope[s] * slope[s]);
                let product: Group = from_fn(|s| stiffness * slope[s] * curvature[s]);
                [
                    from_fn(|s| square[s] * slope[s]),
                    from_fn(|s| 3.0 * square[s] * rate[s]),
                    from_fn(|s| product[s] * curvature[s]),
                    from_fn(|s| product[s] * slope[s]),
                ]
            });
            *sums = both(at, across, [1.0, 1.0, 1.0, -1.0]);
        }
        let modes = self.gradients.len();
        for (i, gradients) in self.gradients.iter_mut().enumerate() {
            let mut parts = [ZERO; 3];
            for (shapes, sums) in self.shapes.chunks_exact(modes).zip(&self.sums) {
                let ([slopes, curvatures], sums) = (&shapes[i], &sums[parity(i)]);
                parts[0] = from_fn(|s| parts[0][s] + slopes[s] * sums[0][s]);
                parts[1] = from_fn(|s| parts[1][s] + slopes[s] * sums[1][s]);
                parts[2] = from_fn(|s| parts[2][s] + slopes[s] * sums[2][s] + curvatures[s] * sums[3][s]);
            }
            *gradients = parts.map(total);
        }
    }

    /// `∂c₄/∂η_i` of each mode and its rate, 1/s.
    #[inline]
    pub(super) fn gradient(&self) -> impl Iterator<Item = [f64; 2]> {
        self.gradients.iter().map(|[gradient, rate, _]| [*gradient, *rate])
    }

    /// Adds `∂V₄/∂η` to `r`.
    #[inline]
    pub(super) fn force(&self, r: &mut [f64]) {
        for (r, [.., force]) in r.iter_mut().zip(&self.gradients) {
            *r += force;
        }
    }

    /// Calls `add` with the mode and the second time derivative of `∂c₄/∂η_i`, for the accelerations η̈.
    pub(super) fn gradient_acceleration(&mut self, ddeta: &[f64], mut add: impl FnMut(usize, f64)) {
        let (modes, shortening) = (self.gradients.len(), self.shortening);
        let groups = self.shapes.chunks_exact(modes.max(1));
        for ((sums, present), shapes) in self.sums.iter_mut().zip(&self.present).zip(groups) {
            let mut parts = [ZERO; 2];
            for (i, ([slopes, _], ddeta)) in shapes.iter().zip(ddeta).enumerate() {
                let part = &mut parts[parity(i)];
                *part = from_fn(|s| part[s] + ddeta * slopes[s]);
            }
            let [even, odd] = parts;
            let accelerations: [Group; 2] = [from_fn(|s| even[s] + odd[s]), from_fn(|s| even[s] - odd[s])];
            let [at, across] = from_fn(|side| {
                let ([slope, rate, _], acceleration) = (&present[side], &accelerations[side]);
                let along = |s: usize| slope[s] * acceleration[s] + 2.0 * rate[s] * rate[s];
                [from_fn(|s| -3.0 * shortening * slope[s] * along(s))]
            });
            let [[even], [odd]] = both(at, across, [1.0]);
            (sums[0][0], sums[1][0]) = (even, odd);
        }
        for i in 0..modes {
            let mut part = ZERO;
            for (shapes, sums) in self.shapes.chunks_exact(modes).zip(&self.sums) {
                let ([slopes, _], [sum, ..]) = (&shapes[i], &sums[parity(i)]);
                part = from_fn(|s| part[s] + slopes[s] * sum[s]);
            }
            add(i, total(part));
        }
    }

    /// Adds `weight ∂²(V₄ + F c₄)/∂η_i∂η_j`, with the force F along the chord, to the square matrix `k` of `all` rows, at row and
    /// column `at`.
    pub(super) fn stiffness(&mut self, weight: f64, along_n: f64, at: usize, all: usize, k: &mut [f64]) {
        let (bend, chord) = (weight * self.stiffness, 3.0 * weight * along_n * self.shortening);
        // Weights of φ_i' φ_j', of φ_i' φ_j'' with φ_i'' φ_j', and of φ_i'' φ_j'': for modes that are both even or both odd, and for others.
        for (sums, present) in self.sums.iter_mut().zip(&self.present) {
            let [here, across] = present.each_ref().map(|[slope, _, curvature]| {
                [
                    from_fn(|s| bend * curvature[s] * curvature[s] - chord * slope[s] * slope[s]),
                    from_fn(|s| 2.0 * bend * slope[s] * curvature[s]),
                    from_fn(|s| bend * slope[s] * slope[s]),
                    ZERO,
                ]
            });
            *sums = both(here, across, [1.0, -1.0, 1.0, 1.0]);
        }
        let modes = self.gradients.len();
        for i in 0..modes {
            for j in i..modes {
                let mut entry = ZERO;
                for (shapes, sums) in self.shapes.chunks_exact(modes).zip(&self.sums) {
                    let ([slope_i, curvature_i], [slope_j, curvature_j]) = (&shapes[i], &shapes[j]);
                    let [slopes, mixed, curvatures, _] = &sums[(j - i) % 2];
                    entry = from_fn(|s| {
                        let with_slope = slopes[s] * slope_i[s] + mixed[s] * curvature_i[s];
                        let with_curvature = mixed[s] * slope_i[s] + curvatures[s] * curvature_i[s];
                        entry[s] + slope_j[s] * with_slope + curvature_j[s] * with_curvature
                    });
                }
                let entry = total(entry);
                k[(at + i) * all + at + j] += entry;
                if i != j {
                    k[(at + j) * all + at + i] += entry;
                }
            }
        }
    }

    /// `V₄`, J.
    pub(super) fn energy_j(&self) -> f64 {
        let squares = |[slope, _, curvature]: &[Group; 3]| -> f64 {
            slope.iter().zip(curvature).map(|(slope, curvature)| (slope * curvature).powi(2)).sum()
        };
        0.5 * self.stiffness * self.present.iter().flatten().map(squares).sum::<f64>()
    }
}

/// σ, σ̇ and κ with another mode.
#[inline]
fn with_mode([slope, rate, curvature]: [Group; 3], [slopes, curvatures]: &[Group; 2], eta: f64, deta: f64) -> [Group; 3] {
    [
        from_fn(|s| slope[s] + eta * slopes[s]),
        from_fn(|s| rate[s] + deta * slopes[s]),
        from_fn(|s| curvature[s] + eta * curvatures[s]),
    ]
}

/// 0 for an even mode, 1 for an odd one, for its index from 0.
#[inline]
fn parity(i: usize) -> usize {
    (i + 1) % 2
}

/// Sums over stations and their partners, for products with even shapes and with odd ones; `sign` is 1 where even ones are alike at both.
#[inline]
fn both<const N: usize>(at: [Group; N], across: [Group; N], sign: [f64; N]) -> [[Group; N]; 2] {
    let with = |turn: f64| from_fn(|k| from_fn(|s| at[k][s] + turn * sign[k] * across[k][s]));
    [with(1.0), with(-1.0)]
}

/// Sum over the stations of a group.
#[inline]
fn total([a, b]: Group) -> f64 {
    a + b
}

#[cfg(test)]
mod tests {
    use super::*;

    const ETA: [f64; 3] = [0.07, -0.04, 0.03];
    const DETA: [f64; 3] = [0.4, 0.7, -0.9];
    const DDETA: [f64; 3] = [-3.0, 8.0, 5.0];
    const LENGTH_M: f64 = 1.7;
    const EJ_NM2: f64 = 20.0;

    fn bent(eta: [f64; 3], deta: [f64; 3]) -> Strong {
        let mut strong = Strong::new(3, LENGTH_M, EJ_NM2);
        strong.advance(&eta, &deta);
        strong
    }

    /// `c₄`, of fourth degree in η, from its gradient.
    fn shortening_m(strong: &Strong, eta: [f64; 3]) -> f64 {
        0.25 * strong.gradient().zip(eta).map(|([gradient, _], eta)| gradient * eta).sum::<f64>()
    }

    fn moved(by: [f64; 3], t: f64) -> [f64; 3] {
        std::array::from_fn(|i| ETA[i] + t * by[i] + 0.5 * t * t * DDETA[i])
    }

    #[test]
    fn val_shortening_and_energy_equal_quadrature() {
        let n = 4000;
        let (mut shortening, mut energy) = (0.0, 0.0);
        for s in 0..n {
            let xi = (s as f64 + 0.5) / n as f64;
            let terms = |f: &dyn Fn(f64) -> f64| -> f64 { (1..=3).map(|k| ETA[k - 1] * f(k as f64 * PI)).sum() };
            let slope = terms(&|w| w * (w * xi).cos());
            let curvature = terms(&|w| -w * w * (w * xi).sin());
            shortening -= slope.powi(4) / (8.0 * LENGTH_M.powi(3) * n as f64);
            energy += 0.5 * EJ_NM2 * (curvature * slope).powi(2) / (LENGTH_M.powi(5) * n as f64);
        }
        let strong = bent(ETA, DETA);
        let got = shortening_m(&strong, ETA);
        assert!((got / shortening - 1.0).abs() < 1e-12, "{got} {shortening}");
        assert!((strong.energy_j() / energy - 1.0).abs() < 1e-12, "{} {energy}", strong.energy_j());
    }

    #[test]
    fn val_forces_and_stiffness_are_derivatives_of_energy_and_shortening() {
        let (d, along_n) = (1e-5, 30.0);
        let near = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{got} {expected}");
        let force = |eta: [f64; 3]| {
            let mut r = [0.0; 3];
            let strong = bent(eta, DETA);
            strong.force(&mut r);
            (r, strong.gradient().map(|[gradient, _]| gradient).collect::<Vec<_>>())
        };
        let (r, gradient) = force(ETA);
        let mut k = [0.0; 25];
        bent(ETA, DETA).stiffness(2.0, along_n, 1, 5, &mut k);
        for i in 0..3 {
            let mut ends = [ETA; 2];
            ends[0][i] -= d;
            ends[1][i] += d;
            let [low, high] = ends.map(|eta| (bent(eta, DETA).energy_j(), shortening_m(&bent(eta, DETA), eta)));
            near(r[i], (high.0 - low.0) / (2.0 * d));
            near(gradient[i], (high.1 - low.1) / (2.0 * d));
            let [low, high] = ends.map(force);
            for j in 0..3 {
                let expected = (high.0[j] - low.0[j] + along_n * (high.1[j] - low.1[j])) / d;
                near(k[(1 + i) * 5 + 1 + j], expected);
            }
        }
    }

    #[test]
    fn val_rates_of_the_gradient_are_its_time_derivatives() {
        let t = 1e-4;
        let at = |t: f64| {
            let deta = std::array::from_fn(|i| DETA[i] + t * DDETA[i]);
            bent(moved(DETA, t), deta).gradient().collect::<Vec<_>>()
        };
        let (before, after, now) = (at(-t), at(t), at(0.0));
        let near = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{got} {expected}");
        let mut second = [0.0; 3];
        bent(ETA, DETA).gradient_acceleration(&DDETA, |i, x| second[i] = x);
        for i in 0..3 {
            near(now[i][1], (after[i][0] - before[i][0]) / (2.0 * t));
            near(second[i], (after[i][1] - before[i][1]) / (2.0 * t));
        }
    }
}
