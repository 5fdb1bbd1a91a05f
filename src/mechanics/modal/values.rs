//! All shape functions and their slopes at one place.

use std::f64::consts::PI;

use super::shapes::{Shapes, root_sine};

impl<const W: usize> Shapes<W> {
    /// `[g_f, dg_f/dξ]` for each function at `ξ`, by `sin (f + 1)πξ = sin fπξ cos πξ + cos fπξ sin πξ`.
    pub(super) fn values(&self, xi: f64) -> [[f64; W]; 2] {
        let [mut value, mut slope] = [[0.0; W]; 2];
        (value[0], slope[0]) = (xi, 1.0);
        let (sin, cos) = (PI * xi).sin_cos();
        let (mut s, mut c) = (sin, cos);
        for f in 1..=self.sines {
            (value[f], slope[f]) = (s, f as f64 * PI * c);
            (s, c) = (s * cos + c * sin, c * cos - s * sin);
        }
        if self.root {
            let root = self.sines + 1;
            (value[root], slope[root]) = (xi * (1.0 - xi) * (1.0 - 0.5 * xi), 1.0 + xi * (1.5 * xi - 3.0));
            for m in 1..=self.modes {
                value[root] -= root_sine(m) * value[m];
                slope[root] -= root_sine(m) * slope[m];
            }
        }
        [value, slope]
    }

    /// The part of bending shape `i` in ψ, the static shape of a moment at the first end: `ψ = χ + Σ c_m sin mπξ`.
    pub(super) fn root_part(&self, i: usize) -> f64 {
        if i < self.modes { root_sine(i + 1) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_values_are_the_functions_and_their_derivatives() {
        let shapes = Shapes::<22>::new(0.7, 20, true, 20);
        for xi in [0.0, 0.1, 0.37, 0.5, 0.93, 1.0] {
            let [value, slope] = shapes.values(xi);
            for f in 0..shapes.functions() {
                let [g, dg, _] = shapes.at(f, xi);
                assert!(
                    (value[f] - g).abs() < 2e-14 && (slope[f] - dg).abs() < 2e-12,
                    "{f} {xi}: {} {g} {} {dg}",
                    value[f],
                    slope[f]
                );
            }
        }
    }
}
