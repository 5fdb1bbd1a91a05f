//! Strain measures at a point of the axis, and the generalized forces and tangents that follow from them.
//!
//! With `p = r′` and `w = r″` (derivatives by undeformed length): axial strain `ε = |p| − 1` and bending measure
//! `κ = θ′ = (p × w)/|p|²`. Stress resultants `N = EA (ε + c ε̇)`, `M = EJ (κ + c κ̇)`, with the damping time `c`.

use nalgebra::{Matrix2, Vector2};

/// Weights of the rate and of the position in a tangent.
#[derive(Debug, Clone, Copy)]
pub(super) struct StiffnessWeights {
    pub(super) velocity: f64,
    pub(super) position: f64,
}

/// A quarter turn to the left: `J p = (−p_y, p_x)`.
pub(super) fn left(p: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-p.y, p.x)
}

/// `a × b`.
pub(super) fn cross(a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Elongation at a point: stiffness already multiplied by the quadrature weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axial {
    pub(super) stiffness: f64,
    pub(super) damping_s: f64,
}

impl Axial {
    /// `N p/|p|`.
    #[inline]
    pub(super) fn force(self, p: &Vector2<f64>, dp: &Vector2<f64>) -> Vector2<f64> {
        self.force_beyond(p, dp, 0.0, 0.0).0
    }

    /// `(N p/|p|, N)` of `ε = |p| − 1 − shift`.
    #[inline]
    fn force_beyond(self, p: &Vector2<f64>, dp: &Vector2<f64>, shift: f64, shift_rate: f64) -> (Vector2<f64>, f64) {
        let length = p.norm();
        let mut strain = length - 1.0 - shift;
        if self.damping_s != 0.0 {
            strain += self.damping_s * (p.dot(dp) / length - shift_rate);
        }
        let force = self.stiffness * strain;
        (p * (force / length), force)
    }

    /// `∂force/∂p · position + ∂force/∂ṗ · velocity = N (1 − u uᵀ)/|p| · position + u ρᵀ`, `u = p/|p|`,
    /// `ρ = EA [(position + c velocity) u + c position (ṗ − u u·ṗ)/|p|]`.
    #[inline]
    pub(super) fn tangent(self, p: &Vector2<f64>, dp: &Vector2<f64>, weights: StiffnessWeights) -> Matrix2<f64> {
        self.tangent_beyond(p, dp, weights, 0.0, 0.0).pp
    }

    /// Tangent, u, ρ and `N · position` of `ε = |p| − 1 − shift`.
    #[inline]
    fn tangent_beyond(
        self,
        p: &Vector2<f64>,
        dp: &Vector2<f64>,
        weights: StiffnessWeights,
        shift: f64,
        shift_rate: f64,
    ) -> AxialTangent {
        let inverse = 1.0 / p.norm();
        let u = p * inverse;
        let mut strain = 1.0 / inverse - 1.0 - shift;
        let mut row = u * (self.stiffness * (weights.position + self.damping_s * weights.velocity));
        if self.damping_s != 0.0 {
            let rate = u.dot(dp);
            strain += self.damping_s * (rate - shift_rate);
            row += (dp - u * rate) * (self.stiffness * self.damping_s * weights.position * inverse);
        }
        let force = weights.position * self.stiffness * strain;
        let across = force * inverse;
        AxialTangent { pp: Matrix2::new(across, 0.0, 0.0, across) + u * (row - u * across).transpose(), u, row, force }
    }

    /// `½ EA ε²`.
    pub(super) fn energy(self, p: &Vector2<f64>) -> f64 {
        0.5 * self.stiffness * (p.norm() - 1.0).powi(2)
    }

    /// `c EA ε̇²`.
    pub(super) fn dissipation(self, p: &Vector2<f64>, dp: &Vector2<f64>) -> f64 {
        self.damping_s * self.stiffness * (p.dot(dp)).powi(2) / p.norm_squared()
    }
}

/// See [`Axial::tangent_beyond`].
struct AxialTangent {
    pp: Matrix2<f64>,
    u: Vector2<f64>,
    row: Vector2<f64>,
    force: f64,
}

/// Elongation in the middle of an element, `ε = |p| − 1 − 3/160 |w|²`, with `w` the vector c of the element: see `beam.rs`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Middle(pub(super) Axial);

impl Middle {
    /// Twice the factor of `|w|²`.
    const TWICE: f64 = 3.0 / 80.0;

    /// `3/160 |w|²`.
    pub(super) fn shift(w: &Vector2<f64>) -> f64 {
        0.5 * Self::TWICE * w.norm_squared()
    }

    fn shift_rate(x: &Pair, dx: &Pair) -> f64 {
        Self::TWICE * x.w.dot(&dx.w)
    }

    /// `(N u, −3/80 N w)`.
    #[inline]
    pub(super) fn force(self, x: &Pair, dx: &Pair) -> Pair {
        let (p, force) = self.0.force_beyond(&x.p, &dx.p, Self::shift(&x.w), Self::shift_rate(x, dx));
        Pair { p, w: x.w * (-Self::TWICE * force) }
    }

    /// `N ∂²ε · position + ∇ε ρᵀ`, with `ε_w = −3/80 w`, `ρ_w = −3/80 EA [(position + c velocity) w + c position ẇ]`.
    #[inline]
    pub(super) fn tangent(self, x: &Pair, dx: &Pair, weights: StiffnessWeights) -> PairTangent {
        let Axial { stiffness, damping_s } = self.0;
        let AxialTangent { pp, u, row, force } =
            self.0.tangent_beyond(&x.p, &dx.p, weights, Self::shift(&x.w), Self::shift_rate(x, dx));
        let mut along = x.w * (weights.position + damping_s * weights.velocity);
        if damping_s != 0.0 {
            along += dx.w * (damping_s * weights.position);
        }
        let (gradient, along) = (x.w * -Self::TWICE, along * (-Self::TWICE * stiffness));
        let curved = -Self::TWICE * force;
        PairTangent {
            pp,
            pw: u * along.transpose(),
            wp: gradient * row.transpose(),
            ww: Matrix2::new(curved, 0.0, 0.0, curved) + gradient * along.transpose(),
        }
    }

    /// `½ EA ε²`.
    pub(super) fn energy(self, x: &Pair) -> f64 {
        0.5 * self.0.stiffness * (x.p.norm() - 1.0 - Self::shift(&x.w)).powi(2)
    }

    /// `c EA ε̇²`.
    pub(super) fn dissipation(self, x: &Pair, dx: &Pair) -> f64 {
        self.0.damping_s * self.0.stiffness * (x.p.dot(&dx.p) / x.p.norm() - Self::shift_rate(x, dx)).powi(2)
    }
}

/// Bending at a point: stiffness already multiplied by the quadrature weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bending {
    pub(super) stiffness: f64,
    pub(super) damping_s: f64,
}

/// A point's `r′` and `r″`, or `r′` and the vector c of `beam.rs` in an element's middle; their rates, or forces that work on them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) p: Vector2<f64>,
    pub(super) w: Vector2<f64>,
}

/// Derivatives of the two generalized forces by `p` and `w`.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairTangent {
    pub(super) pp: Matrix2<f64>,
    pub(super) pw: Matrix2<f64>,
    pub(super) wp: Matrix2<f64>,
    pub(super) ww: Matrix2<f64>,
}

/// `κ` and its gradient.
struct Curvature {
    value: f64,
    gradient: Pair,
    inverse_square: f64,
}

/// `κ_p = −(J w + 2 κ p)/|p|²`, `κ_w = J p/|p|²`.
#[inline]
fn curvature(x: &Pair) -> Curvature {
    let inverse_square = 1.0 / x.p.norm_squared();
    let value = cross(&x.p, &x.w) * inverse_square;
    let gradient = Pair { p: (left(&x.w) + x.p * (2.0 * value)) * -inverse_square, w: left(&x.p) * inverse_square };
    Curvature { value, gradient, inverse_square }
}

impl Curvature {
    fn rate(&self, dx: &Pair) -> f64 {
        self.gradient.p.dot(&dx.p) + self.gradient.w.dot(&dx.w)
    }

    /// `κ_pp = −2 (p κ_pᵀ + κ_p pᵀ + κ 1)/|p|² `, from `|p|² κ = p × w` differentiated twice.
    fn second_pp(&self, p: &Vector2<f64>) -> Matrix2<f64> {
        let outer = p * self.gradient.p.transpose();
        (outer + outer.transpose() + Matrix2::from_diagonal_element(self.value)) * (-2.0 * self.inverse_square)
    }

    /// `κ_pw = (−J − 2 p κ_wᵀ)/|p|²` with rows by `p`, columns by `w`; from the same identity.
    fn second_pw(&self, p: &Vector2<f64>) -> Matrix2<f64> {
        let outer = p * self.gradient.w.transpose() * 2.0;
        (Matrix2::new(0.0, 1.0, -1.0, 0.0) - outer) * self.inverse_square
    }
}

impl Bending {
    /// `(M κ_p, M κ_w)`.
    #[inline]
    pub(super) fn force(self, x: &Pair, dx: &Pair) -> Pair {
        let k = curvature(x);
        let mut bent = k.value;
        if self.damping_s != 0.0 {
            bent += self.damping_s * k.rate(dx);
        }
        let moment = self.stiffness * bent;
        Pair { p: k.gradient.p * moment, w: k.gradient.w * moment }
    }

    /// `M ∂²κ · position + ∇κ ρᵀ`, `ρ = EJ [(position + c velocity) ∇κ + c position ∇κ̇]`.
    #[inline]
    pub(super) fn tangent(self, x: &Pair, dx: &Pair, weights: StiffnessWeights) -> PairTangent {
        let k = curvature(x);
        let (pp, pw) = (k.second_pp(&x.p), k.second_pw(&x.p));
        let direct = self.stiffness * (weights.position + self.damping_s * weights.velocity);
        let mut row = Pair { p: k.gradient.p * direct, w: k.gradient.w * direct };
        let mut bent = k.value;
        if self.damping_s != 0.0 {
            bent += self.damping_s * k.rate(dx);
            let follow = self.stiffness * self.damping_s * weights.position;
            row.p += (pp * dx.p + pw * dx.w) * follow;
            row.w += pw.transpose() * dx.p * follow;
        }
        let moment = weights.position * self.stiffness * bent;
        let (pp, pw) = (pp * moment, pw * moment);
        PairTangent {
            pp: pp + k.gradient.p * row.p.transpose(),
            pw: pw + k.gradient.p * row.w.transpose(),
            wp: pw.transpose() + k.gradient.w * row.p.transpose(),
            ww: k.gradient.w * row.w.transpose(),
        }
    }

    /// `½ EJ κ²`.
    pub(super) fn energy(self, x: &Pair) -> f64 {
        0.5 * self.stiffness * curvature(x).value.powi(2)
    }

    /// `c EJ κ̇²`.
    pub(super) fn dissipation(self, x: &Pair, dx: &Pair) -> f64 {
        self.damping_s * self.stiffness * curvature(x).rate(dx).powi(2)
    }
}
