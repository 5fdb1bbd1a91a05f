//! Kinematics of a crank-slider as functions of the crank angle θ, with their derivatives.
//!
//! With `λ = l₁/l₂` and φ the rod's angle below the x axis, `sin φ = λ sin θ` (digest 4.3, where the rod points along
//! `(cos φ, −sin φ)`). Differentiating it by θ, again and again, with `s = sin φ`, `c = cos φ > 0` and primes for d/dθ:
//!
//! - `c φ′ = λ cos θ` (4.5)
//! - `c φ″ = s φ′² − λ sin θ` (4.8; the thesis prints its last term twice, and `cos θ` for `cos² θ` where it repeats 4.9)
//! - `c φ‴ = c φ′³ + 3 s φ′ φ″ − λ cos θ`
//!
//! A point's place then follows from [`along`], its velocity and acceleration from [`moving`]: of the slider pin
//! `v_E = −l₁ sin θ θ̇ − …` (4.13; the thesis prints `+l₁ sin θ` there and in 4.14).

/// A vector in the plane and its derivatives by θ, `D` in all: up to the second unless said otherwise.
pub(crate) type Path<const D: usize = 3> = [[f64; 2]; D];

/// An angle β counter-clockwise from x, as a direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn {
    /// `sin β`.
    pub sin: f64,
    /// `cos β`.
    pub cos: f64,
    /// The first three derivatives of β by θ.
    pub slopes: [f64; 3],
}

impl Turn {
    /// Along x whatever θ.
    pub(crate) const STILL: Self = Self { sin: 0.0, cos: 1.0, slopes: [0.0; 3] };
}

/// A point at distance `r_m` along a direction that turns, added to `from`.
///
/// `e = (cos β, sin β)`, `n = (−sin β, cos β)`: `e′ = β′ n`, `e″ = β″ n − β′² e`, `e‴ = (β‴ − β′³) n − 3 β′ β″ e`.
#[inline]
pub(crate) fn along<const D: usize>(from: &Path<D>, turn: &Turn, r_m: f64) -> Path<D> {
    let Turn { sin, cos, slopes: [b1, b2, b3] } = *turn;
    let weights = [(1.0, 0.0), (0.0, b1), (-b1 * b1, b2), (-3.0 * b1 * b2, b3 - b1 * b1 * b1)];
    let mut path = *from;
    for (value, (e, n)) in path.iter_mut().zip(weights) {
        value[0] += r_m * (e * cos - n * sin);
        value[1] += r_m * (e * sin + n * cos);
    }
    path
}

/// Position, velocity and acceleration on a path at a crank rate and acceleration: `p`, `p′ θ̇`, `p″ θ̇² + p′ θ̈` (4.10–4.16).
pub(crate) fn moving(path: &Path, rate: f64, acceleration: f64) -> [[f64; 2]; 3] {
    let [p, p1, p2] = path;
    [*p, p1.map(|p1| p1 * rate), [0, 1].map(|k| p2[k] * rate * rate + p1[k] * acceleration)]
}

/// The crank's own angle.
#[inline]
pub(crate) fn crank_turn(theta_rad: f64) -> Turn {
    let (sin, cos) = theta_rad.sin_cos();
    Turn { sin, cos, slopes: [1.0, 0.0, 0.0] }
}

/// The rod's angle, `β = −φ`, for `ratio = λ < 1`. It stays within a quarter turn of x.
#[inline]
pub(crate) fn rod_turn(crank: &Turn, ratio: f64) -> Turn {
    let s = ratio * crank.sin;
    let c = (1.0 - s * s).sqrt();
    let per_c = 1.0 / c;
    let d1 = ratio * crank.cos * per_c;
    let d2 = (s * d1 * d1 - s) * per_c;
    let d3 = (c * d1 * d1 * d1 + 3.0 * s * d1 * d2 - ratio * crank.cos) * per_c;
    Turn { sin: -s, cos: c, slopes: [-d1, -d2, -d3] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_derivatives_agree_with_central_differences() {
        let (l1, l2, h) = (0.5, 1.5, 1e-4);
        let slider = |theta: f64| {
            let crank = crank_turn(theta);
            along(&along(&[[0.0; 2]; 4], &crank, l1), &rod_turn(&crank, l1 / l2), l2)
        };
        for k in 0..40 {
            let theta = 0.17 * f64::from(k);
            let (before, here, after) = (slider(theta - h), slider(theta), slider(theta + h));
            assert!(here[0][1].abs() < 1e-15, "the slider stays on the x axis");
            for order in 0..3 {
                let difference = (after[order][0] - before[order][0]) / (2.0 * h);
                assert!((difference - here[order + 1][0]).abs() < 1e-7, "order {order} at {theta}");
            }
        }
    }
}
