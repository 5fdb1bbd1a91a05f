//! The beam element: absolute nodal coordinates, cubic Hermite in position and slope.
//!
//! `r(ξ) = N₁ r₁ + ℓ N₂ t₁ + N₃ r₂ + ℓ N₄ t₂`, `t = r′`, so the mass matrix is constant (Berzeri & Shabana 2000).
//! Strain energy `½∫ EA ε² + EJ κ² ds` with Simpson's points for the membrane and Gauss's two for bending: as many points
//! as the element has modes of strain (3 + 2 of its 8 − 3), so it neither locks nor has a mode without energy
//! (Gerstmayr & Irschik 2008). In `d = (r₂ − r₁)/ℓ`, `b = t₂ − t₁`, `c = 2d − t₁ − t₂` the points are
//! `r′ = d ∓ b/√12`, `ℓ r″ = b ± √3 c` (Gauss) and `r′ = d + c/4` (middle).
//!
//! **Mass.** With cubics alone a vibration `e^{iks}` of an unloaded beam has `ω² = (EJ/ρA) k⁴ (1 + (kℓ)⁴/720 + …)`, since the elements'
//! best approximation of r lacks the strain energy `½ EJ ℓ⁴/720 ∫ |r⁗|² ds` of a clamped beam under uniform load, and `EJ r⁗ = ω² ρA r`.
//! So kinetic energy has a second part, which gives every element the inertia that its strain energy asks for:
//!
//! ```text
//! T = ½ ρA ∫ |ṙ|² + ℓ⁴/720 |ṙ″|² ds      ω² = (EJ/ρA) k⁴ (1 − (kℓ)⁶/25200 + …)
//! ```
//!
//! It is nil in the rigid motion of a straight element, costs nothing, and leaves the mass matrix constant. Along the axis, where Simpson's
//! points gave `(EA/ρA) k² (1 + (kℓ)⁴/1200)`, it gives `1 − (kℓ)⁴/1800`. (Matrices of this kind: Felippa, Guo & Park, *Mass Matrix Templates*,
//! Arch. Comput. Methods Eng. 22, 2015.)
//!
//! **Tension.** `∫ |r′|² ds/ℓ` of an element is `d² + b²/12 + c²/20`; Simpson's points have `c²/8`. In a beam under tension N that is
//! `N k² (1 + (kℓ)⁴/480)` for `N k²`, while mass and bending have `1 + (kℓ)⁴/720` alike. With `c²/10` tension has it, too:
//!
//! ```text
//! ε = |r′| − 1 − 3/160 |c|²  in the middle      ω² = (EJ k⁴ + N k²)/ρA (1 + O((kℓ)⁶))  under uniform tension
//! ```
//!
//! In an arc of the angle φ an element's cubic is too short by `φ⁴/2880`, with this measure by twice that.
//!
//! Where N is uniform, eigenvalues err by `ℓ⁴/720 N ∫ w‴² + w″ w⁗ ds`: nil for waves, `N w″ w‴` at a clamp (`hub`).

use nalgebra::{Matrix2, Vector2};

use super::strain::{Axial, Bending, Middle, Pair, PairTangent, StiffnessWeights};

/// `1/√12`: from the middle to a Gauss point, over ℓ.
const GAUSS: f64 = 0.288_675_134_594_812_9;
const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// Vectors of an element's slots, in the order `r₁, t₁, r₂, t₂`.
pub(super) type Four = [Vector2<f64>; 4];
/// 2 × 2 blocks of an element's matrix, rows first.
pub(super) type Blocks = [[Matrix2<f64>; 4]; 4];

/// One element of a uniform beam.
#[derive(Debug, Clone)]
pub(super) struct Beam {
    pub(super) length_m: f64,
    /// At a node.
    pub(super) axial: Axial,
    middle: Middle,
    bending: Bending,
    /// Mass matrix of the module's documentation: each entry stands for that multiple of the 2 × 2 identity.
    pub(super) mass: [[f64; 4]; 4],
}

/// `d`, `b`, `c` of the module's documentation, their rates, or forces that work on them.
struct Modes {
    d: Vector2<f64>,
    b: Vector2<f64>,
    c: Vector2<f64>,
}

impl Beam {
    /// An element of this length with `EA`, `EJ`, mass per length and damping time.
    pub(super) fn new(length_m: f64, bar: &crate::scene::Bar, damping_s: f64) -> Self {
        let (l, unit) = (length_m, bar.mass_per_length_kg_per_m() * length_m / 420.0);
        let consistent = [
            [156.0, 22.0 * l, 54.0, -13.0 * l],
            [22.0 * l, 4.0 * l * l, 13.0 * l, -3.0 * l * l],
            [54.0, 13.0 * l, 156.0, -22.0 * l],
            [-13.0 * l, -3.0 * l * l, -22.0 * l, 4.0 * l * l],
        ];
        // ℓ³ ∫ N″ N″ᵀ ds
        let bent = [
            [12.0, 6.0 * l, -12.0, 6.0 * l],
            [6.0 * l, 4.0 * l * l, -6.0 * l, 2.0 * l * l],
            [-12.0, -6.0 * l, 12.0, -6.0 * l],
            [6.0 * l, 2.0 * l * l, -6.0 * l, 4.0 * l * l],
        ];
        let mass = std::array::from_fn(|i| std::array::from_fn(|j| (consistent[i][j] + bent[i][j] * (420.0 / 720.0)) * unit));
        let axial = Axial { stiffness: bar.axial_stiffness_n() * length_m / 6.0, damping_s };
        Self {
            length_m,
            axial,
            middle: Middle(Axial { stiffness: 4.0 * axial.stiffness, ..axial }),
            bending: Bending { stiffness: bar.bending_stiffness_nm2() * length_m / 2.0, damping_s },
            mass,
        }
    }

    fn modes(&self, x: &Four) -> Modes {
        let d = (x[2] - x[0]) / self.length_m;
        Modes { d, b: x[3] - x[1], c: d * 2.0 - x[1] - x[3] }
    }

    /// The Gauss points.
    fn bent(&self, m: &Modes) -> [Pair; 2] {
        let (shift, twist) = (m.b * GAUSS, m.c * SQRT_3);
        [Pair { p: m.d - shift, w: (m.b + twist) / self.length_m }, Pair { p: m.d + shift, w: (m.b - twist) / self.length_m }]
    }

    fn middle(m: &Modes) -> Pair {
        Pair { p: m.d + m.c * 0.25, w: m.c }
    }

    /// Elastic and damping forces on the slots (resisting: they stand on the left of the equation of motion).
    #[inline]
    pub(super) fn force(&self, x: &Four, dx: &Four) -> Four {
        let (m, dm) = (self.modes(x), self.modes(dx));
        let (points, rates) = (self.bent(&m), self.bent(&dm));
        let first = self.bending.force(&points[0], &rates[0]);
        let second = self.bending.force(&points[1], &rates[1]);
        let middle = self.middle.force(&Self::middle(&m), &Self::middle(&dm));
        let d = first.p + second.p + middle.p;
        let b = (second.p - first.p) * GAUSS + (first.w + second.w) / self.length_m;
        let c = (first.w - second.w) * (SQRT_3 / self.length_m) + middle.p * 0.25 + middle.w;
        let end = (d + c * 2.0) / self.length_m;
        [-end, self.axial.force(&x[1], &dx[1]) - b - c, end, self.axial.force(&x[3], &dx[3]) + b - c]
    }

    /// `position ∂force/∂x + velocity ∂force/∂ẋ`.
    #[inline]
    pub(super) fn tangent(&self, x: &Four, dx: &Four, weights: StiffnessWeights) -> Blocks {
        let (m, dm) = (self.modes(x), self.modes(dx));
        let (points, rates) = (self.bent(&m), self.bent(&dm));
        let first = self.bending.tangent(&points[0], &rates[0], weights);
        let second = self.bending.tangent(&points[1], &rates[1], weights);
        let middle = self.middle.tangent(&Self::middle(&m), &Self::middle(&dm), weights);
        let mut blocks = self.nodal(&first, &second, &middle);
        blocks[1][1] += self.axial.tangent(&x[1], &dx[1], weights);
        blocks[3][3] += self.axial.tangent(&x[3], &dx[3], weights);
        blocks
    }

    /// From derivatives at the points to derivatives by the slots, by way of `d`, `b`, `c`.
    #[inline]
    fn nodal(&self, first: &PairTangent, second: &PairTangent, middle: &PairTangent) -> Blocks {
        let (g, s) = (GAUSS, SQRT_3 / self.length_m);
        let inverse = 1.0 / self.length_m;
        let (pp, pp_) = (first.pp + second.pp, second.pp - first.pp);
        let (pw, pw_) = (first.pw + second.pw, first.pw - second.pw);
        let (wp, wp_) = (first.wp + second.wp, first.wp - second.wp);
        let (ww, ww_) = (first.ww + second.ww, first.ww - second.ww);
        let quarter = middle.pp * 0.25;
        let dd = pp + middle.pp;
        let db = pp_ * g + pw * inverse;
        let bd = pp_ * g + wp * inverse;
        let dc = pw_ * s + quarter + middle.pw;
        let cd = wp_ * s + quarter + middle.wp;
        let bb = pp * (g * g) - (pw_ + wp_) * (g * inverse) + ww * (inverse * inverse);
        let bc = (ww_ * inverse - pw * g) * s;
        let cb = (ww_ * inverse - wp * g) * s;
        let cc = ww * (s * s) + quarter * 0.25 + (middle.pw + middle.wp) * 0.25 + middle.ww;
        // Columns by r₂, t₁, t₂ of the rows d + 2c (at r₂), −b − c (at t₁) and b − c (at t₂).
        let (ed, eb, ec) = (dd + cd * 2.0, db + cb * 2.0, dc + cc * 2.0);
        let ee = (ed + ec * 2.0) * (inverse * inverse);
        let e1 = (eb + ec) * -inverse;
        let e2 = (eb - ec) * inverse;
        let (bl, cl) = ((bd + bc * 2.0) * inverse, (cd + cc * 2.0) * inverse);
        let (one_e, two_e) = (-bl - cl, bl - cl);
        let (sum, mixed) = (bb + cc, bc + cb);
        let (unlike, skew) = (cc - bb, bc - cb);
        [
            [ee, -e1, -ee, -e2],
            [-one_e, sum + mixed, one_e, unlike + skew],
            [-ee, e1, ee, e2],
            [-two_e, unlike - skew, two_e, sum - mixed],
        ]
    }

    /// Inertia forces for these accelerations.
    #[inline]
    pub(super) fn inertia(&self, a: &Four) -> Four {
        self.mass.map(|row| a[0] * row[0] + a[1] * row[1] + a[2] * row[2] + a[3] * row[3])
    }

    /// Strain energy, J.
    pub(super) fn strain_energy_j(&self, x: &Four) -> f64 {
        let m = self.modes(x);
        let bent: f64 = self.bent(&m).iter().map(|point| self.bending.energy(point)).sum();
        let nodes = self.axial.energy(&x[1]) + self.axial.energy(&x[3]);
        bent + nodes + self.middle.energy(&Self::middle(&m))
    }

    /// Power that material damping takes, W.
    pub(super) fn dissipation_w(&self, x: &Four, dx: &Four) -> f64 {
        let (m, dm) = (self.modes(x), self.modes(dx));
        let bent: f64 = (self.bent(&m).iter().zip(&self.bent(&dm))).map(|(x, dx)| self.bending.dissipation(x, dx)).sum();
        let nodes = self.axial.dissipation(&x[1], &dx[1]) + self.axial.dissipation(&x[3], &dx[3]);
        bent + nodes + self.middle.dissipation(&Self::middle(&m), &Self::middle(&dm))
    }

    /// Whether it has material damping.
    pub(super) fn damped(&self) -> bool {
        self.axial.damping_s != 0.0
    }

    /// Rounding of the resisting forces `[force, moment]` when positions are known to round-off of `reach_m`.
    pub(super) fn rounding(&self, reach_m: f64) -> [f64; 2] {
        let strain = f64::EPSILON * (2.0 + 3.0 * reach_m / self.length_m);
        let membrane = 6.0 * self.axial.stiffness / self.length_m * strain;
        let bending = 24.0 * self.bending.stiffness / self.length_m.powi(2) * strain;
        [1.0 * (membrane + bending), 1.0 * self.length_m * (membrane + bending)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Bar;
    use proptest::prelude::*;

    const BAR: Bar = Bar {
        area_m2: 1e-4,
        second_moment_m4: 8.333e-10,
        density_kg_per_m3: 7700.0,
        youngs_modulus_pa: 2.1e11,
        extreme_fibre_m: None,
    };

    fn straight(length: f64) -> Four {
        let along = Vector2::new(0.8, 0.6);
        [Vector2::new(0.3, -0.2), along, Vector2::new(0.3, -0.2) + along * length, along]
    }

    fn vectors(values: &[f64]) -> Four {
        std::array::from_fn(|i| Vector2::new(values[2 * i], values[2 * i + 1]))
    }

    /// The straight element disturbed: strains to some 15 %.
    fn disturbed(values: &[f64]) -> Four {
        let (x, by) = (straight(0.25), vectors(values));
        [x[0] + by[0] * 0.2, x[1] + by[1], x[2] + by[2] * 0.2, x[3] + by[3]]
    }

    /// The forces of the element, at the pivot or elsewhere.
    fn force(beam: &Beam, at_hub: bool, x: &Four, dx: &Four) -> Four {
        let hub = if at_hub { beam.hub_force(x, dx) } else { [Vector2::zeros(); 4] };
        let force = beam.force(x, dx);
        std::array::from_fn(|k| force[k] + hub[k])
    }

    fn shifted(x: &Four, slot: usize, component: usize, by: f64) -> Four {
        let mut moved = *x;
        moved[slot][component] += by;
        moved
    }

    /// The error of the lowest `ω²` of waves `e^{iks}` across an endless straight beam of elements, with `EJ`, mass per length and element
    /// length 1. Exactly it is `EJ k⁴/λ² + N k²/λ` with the stretch λ.
    fn error_of_a_wave(k: f64, tension: f64) -> f64 {
        let (stiffness, strain) = (1e4, tension / 1e4);
        let bar = Bar {
            area_m2: 1.0,
            second_moment_m4: 1.0 / stiffness,
            density_kg_per_m3: 1.0,
            youngs_modulus_pa: stiffness,
            extreme_fibre_m: None,
        };
        let beam = Beam::new(1.0, &bar, 0.0);
        let along = Vector2::new(1.0 + strain, 0.0);
        let x = [Vector2::zeros(), along, along, along];
        let tangent = beam.tangent(&x, &[Vector2::zeros(); 4], StiffnessWeights { velocity: 0.0, position: 1.0 });
        // Of r and t, with r₂ = e^{ik} r₁ and t₂ = e^{ik} t₁; the entry between them is imaginary.
        let reduced = |a: &dyn Fn(usize, usize) -> f64| {
            let own = |i: usize| a(i, i) + a(i + 2, i + 2) + 2.0 * a(i, i + 2) * k.cos();
            [own(0), own(1), (a(0, 3) - a(2, 1)) * k.sin()]
        };
        let (s, m) = (reduced(&|i, j| tangent[i][j].m22), reduced(&|i, j| beam.mass[i][j]));
        let (square, linear) = (m[0] * m[1] - m[2] * m[2], 0.5 * (s[0] * m[1] + s[1] * m[0]) - s[2] * m[2]);
        let constant = s[0] * s[1] - s[2] * s[2];
        let found = constant / (linear + (linear * linear - square * constant).sqrt());
        found / (k.powi(4) / along.x.powi(2) + tension * k * k / along.x) - 1.0
    }

    /// `ω² = EJ k⁴ + N k²` to sixth order in the element's length. An error of fourth order in the tension alone would be `(kℓ)⁴/1440` of its
    /// part, as with Simpson's points without the shift in the middle.
    #[test]
    fn order_of_a_beam_under_tension_is_six() {
        // The tension's part in ω², over that of bending.
        for part in [0.0, 0.1, 1.0] {
            let [long, short] = [0.5, 0.25].map(|k: f64| error_of_a_wave(k, part * k * k));
            let order = (long / short).abs().log2();
            assert!((order - 6.0).abs() < 0.1 && short.abs() < 2e-8, "{part}: {long:e} and {short:e}, order {order}");
        }
    }

    proptest! {
        #[test]
        fn prop_force_is_the_gradient_of_energy(values in prop::collection::vec(-0.1..0.1_f64, 8), at_hub: bool) {
            let beam = Beam::new(0.25, &BAR, 0.0);
            let x = disturbed(&values);
            let energy_j = |x: &Four| beam.strain_energy_j(x) + if at_hub { beam.hub_energy_j(x) } else { 0.0 };
            let force = force(&beam, at_hub, &x, &[Vector2::zeros(); 4]);
            let scale = force.iter().map(|f| f.amax()).fold(0.0, f64::max);
            for (slot, component) in (0..4).flat_map(|s| [(s, 0), (s, 1)]) {
                let h = 1e-4;
                let at = |steps: f64| energy_j(&shifted(&x, slot, component, steps * h));
                let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
                prop_assert!((difference - force[slot][component]).abs() < 1e-7 * scale);
            }
        }

        #[test]
        fn prop_tangent_is_the_derivative_of_force(
            values in prop::collection::vec(-0.1..0.1_f64, 8),
            rates in prop::collection::vec(-3.0..3.0_f64, 8),
            damping in 0.0..0.01_f64,
            at_hub: bool,
        ) {
            let beam = Beam::new(0.25, &BAR, damping);
            let x = disturbed(&values);
            let dx = vectors(&rates);
            let weights = StiffnessWeights { velocity: 0.3, position: 0.7 };
            let mut tangent = beam.tangent(&x, &dx, weights);
            if at_hub {
                beam.add_hub_tangent(&x, &dx, weights, &mut tangent);
            }
            let scale = tangent.iter().flatten().map(|b| b.amax()).fold(0.0, f64::max);
            for (slot, component) in (0..4).flat_map(|s| [(s, 0), (s, 1)]) {
                let h = 1e-6;
                let at = |by: f64| force(
                    &beam,
                    at_hub,
                    &shifted(&x, slot, component, by * weights.position),
                    &shifted(&dx, slot, component, by * weights.velocity),
                );
                let (up, down) = (at(h), at(-h));
                for row in 0..4 {
                    let difference = (up[row] - down[row]) / (2.0 * h);
                    let column = tangent[row][slot].column(component).into_owned();
                    prop_assert!((difference - column).amax() < 1e-7 * scale);
                }
            }
        }

        #[test]
        fn prop_damping_forces_take_the_power_that_is_dissipated(
            values in prop::collection::vec(-0.1..0.1_f64, 8),
            rates in prop::collection::vec(-3.0..3.0_f64, 8),
            at_hub: bool,
        ) {
            let beam = Beam::new(0.25, &BAR, 0.01);
            let (x, dx) = (disturbed(&values), vectors(&rates));
            let power = |of: &Four| force(&beam, at_hub, &x, of).iter().zip(&dx).map(|(force, rate)| force.dot(rate)).sum::<f64>();
            let taken = power(&dx) - power(&[Vector2::zeros(); 4]);
            let dissipated = beam.dissipation_w(&x, &dx) + if at_hub { beam.hub_dissipation_w(&x, &dx) } else { 0.0 };
            prop_assert!((taken - dissipated).abs() < 1e-9 * dissipated);
        }

        #[test]
        fn prop_rigid_motion_makes_no_strain(angle in -10.0..10.0_f64, x in -1.0..1.0_f64, y in -1.0..1.0_f64) {
            let beam = Beam::new(0.25, &BAR, 0.0);
            let (sin, cos) = angle.sin_cos();
            let turn = Matrix2::new(cos, -sin, sin, cos);
            let mut moved = straight(0.25).map(|v| turn * v);
            moved[0] += Vector2::new(x, y);
            moved[2] += Vector2::new(x, y);
            let force = beam.force(&moved, &[Vector2::zeros(); 4]);
            let bound = beam.rounding(2.0);
            prop_assert!(force[2].amax() < bound[0] && force[1].amax() < bound[1] && force[3].amax() < bound[1]);
        }
    }
}
