//! One link in its own frame: its field `u_f(q)`, its inertia, its elasticity.

use std::array::from_fn;

use super::elastic::Elastic;
use super::plane::{Vector, add_scaled, cross, dot, quarter};
use super::shapes::Shapes;
use super::strong::Strong;
use crate::scene;

/// Least number of sines that carry axial displacement in a bent link: `∫ w'²` of the first mode needs the second sine.
/// Beyond that as many as modes are enough (twice as many, all that there are, change R2s by 6 %).
const LEAST_AXIAL_SINES: usize = 2;
/// Axial coordinates where asked for: the stretch and one half-wave.
const AXIAL_COORDINATES: usize = 2;

/// Memory for the sums of the shapes.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    series: [Vec<f64>; 2],
    pub(super) pulls: Vec<f64>,
}

/// A link's constants and the present values of its field.
///
/// `u_0 = (c, 0)` is the chord, `u_f = (a_f, η_f)` goes with function `g_f`. The first component depends on the bending
/// coordinates by foreshortening, `u_f,x = L δ_f0 + e_f − ½ ηᵀQ_fη`, with `e_f` only where axial flexibility is asked for.
#[derive(Debug, Clone)]
pub(super) struct Link<const W: usize> {
    pub(super) shapes: Shapes<W>,
    /// The length's reciprocal, 1/m.
    pub(super) per_length: f64,
    pub(super) mass_kg: f64,
    /// Place of this link's coordinates in `q`: bending, then axial.
    pub(super) at: usize,
    /// Bending coordinates.
    pub(super) bending: usize,
    /// Axial coordinates `e_0, e_1, …`.
    pub(super) axial: usize,
    pub(super) elastic: Elastic,
    /// Terms of strong bending, in the energy and in the chord's length.
    pub(super) strong: Strong,
    pub(super) scratch: Scratch,
    /// Field, velocities and accelerations in the frame of the chord, as if it stood still.
    pub(super) u: [Vector; W],
    pub(super) du: [Vector; W],
    pub(super) ddu: [Vector; W],
    /// `∂u_f,x/∂η_i = −(Q_fη)_i` for each η, with its first and second time derivatives.
    pub(super) grad: Vec<[f64; W]>,
    pub(super) dgrad: Vec<[f64; W]>,
    pub(super) ddgrad: Vec<[f64; W]>,
}

/// Functions that a link of the scene may need, at most.
pub(super) fn functions(link: &scene::Link) -> usize {
    if link.rigid || link.bar.is_none() { 1 } else { 2 + link.modes.max(LEAST_AXIAL_SINES) }
}

impl<const W: usize> Link<W> {
    /// A link whose coordinates begin at `at`; `root` if a moment can act on its first end.
    pub(super) fn new(link: &scene::Link, at: usize, root: bool) -> Self {
        let (bar, modes, axial) = match link.bar {
            Some(bar) if !link.rigid => (Some(bar), link.modes, if link.axial { AXIAL_COORDINATES } else { 0 }),
            _ => (None, 0, 0),
        };
        let length = link.length_m;
        let mut shapes = Shapes::new(length, modes, root && bar.is_some(), modes.max(LEAST_AXIAL_SINES));
        if bar.is_none() {
            // A massless link has no inertia either, by validation.
            let own = if link.mass_kg > 0.0 { link.inertia_kg_m2 / link.mass_kg } else { 0.0 };
            let about_pin = own + link.centre_of_mass_m.powi(2);
            shapes.mean[0] = link.centre_of_mass_m / length;
            shapes.first[0] = about_pin / (length * length);
            shapes.square[0] = shapes.first[0];
        }
        let elastic = Elastic::new(&shapes, bar, length, axial, link.damping_s);
        let bending = shapes.bending();
        let gradient = vec![[0.0; W]; bending];
        let zero = [[0.0; 2]; W];
        let mut u = zero;
        u[0][0] = length;
        let strong = Strong::new(shapes.modes, length, bar.map_or(0.0, |bar| bar.bending_stiffness_nm2()));
        Self {
            scratch: Scratch { series: [shapes.room(), shapes.room()], pulls: shapes.room() },
            strong,
            shapes,
            per_length: 1.0 / length,
            mass_kg: link.mass_kg,
            at,
            bending,
            axial,
            elastic,
            u,
            du: zero,
            ddu: zero,
            grad: gradient.clone(),
            dgrad: gradient.clone(),
            ddgrad: gradient,
        }
    }

    /// Number of coordinates of this link's own.
    pub(super) fn coordinates(&self) -> usize {
        self.bending + self.axial
    }

    /// The places of this link's own coordinates.
    pub(super) fn own(&self) -> std::ops::Range<usize> {
        self.at..self.at + self.coordinates()
    }

    /// The field for coordinates, velocities and accelerations of the chain.
    #[inline]
    pub(super) fn deform(&mut self, q: &[f64], v: &[f64], a: &[f64]) {
        let n = self.bending;
        let own = self.at..self.at + n;
        let (eta, deta, ddeta) = (&q[own.clone()], &v[own.clone()], &a[own]);
        self.shapes.gradient([eta, deta], &mut self.scratch.series, [&mut self.grad, &mut self.dgrad]);
        self.strong.advance(eta, deta);
        let mut taken = 0.0;
        for (i, [gradient, rate]) in self.strong.gradient().enumerate() {
            taken += gradient * eta[i];
            self.grad[i][0] += gradient;
            self.dgrad[i][0] += rate;
        }
        let [mut u, mut du, mut ddu] = [[0.0; W]; 3];
        for (i, (grad, dgrad)) in self.grad.iter().zip(&self.dgrad).enumerate() {
            u = from_fn(|f| u[f] + 0.5 * grad[f] * eta[i]);
            du = from_fn(|f| du[f] + grad[f] * deta[i]);
            ddu = from_fn(|f| ddu[f] + grad[f] * ddeta[i] + dgrad[f] * deta[i]);
        }
        for (vectors, along) in [(&mut self.u, u), (&mut self.du, du), (&mut self.ddu, ddu)] {
            vectors.iter_mut().zip(along).for_each(|(vector, along)| vector[0] = along);
        }
        // Of c₄, of fourth degree in η, half the gradient along η is 2c₄.
        self.u[0][0] += self.shapes.length_m - 0.25 * taken;
        for i in 0..n {
            let f = self.shapes.function_of(i);
            self.u[f][1] = eta[i];
            self.du[f][1] = deta[i];
            self.ddu[f][1] = ddeta[i];
        }
        for e in 0..self.axial {
            let k = self.at + n + e;
            self.u[e][0] += q[k];
            self.du[e][0] += v[k];
            self.ddu[e][0] += a[k];
        }
    }

    /// The second time derivative of the gradient, `−Q_fη̈` and, for the chord, that of strong bending's.
    pub(super) fn deform_gradient(&mut self, a: &[f64]) {
        let ddeta = &a[self.at..self.at + self.bending];
        self.shapes.gradient([ddeta], &mut self.scratch.series, [&mut self.ddgrad]);
        let ddgrad = &mut self.ddgrad;
        self.strong.gradient_acceleration(ddeta, |i, x| ddgrad[i][0] += x);
    }

    /// Accelerations `R⁻¹ d²(R u)/dt² = ü + 2ωJu̇ + εJu − ω²u` of all functions, in the frame of the chord.
    #[inline]
    pub(super) fn accelerate(&self, omega: f64, epsilon: f64, out: &mut [Vector; W]) {
        *out = from_fn(|f| {
            let a = add_scaled(self.ddu[f], 2.0 * omega, quarter(self.du[f]));
            add_scaled(add_scaled(a, epsilon, quarter(self.u[f])), -omega * omega, self.u[f])
        });
    }

    /// Inertia forces of accelerations `a_first` of the first pin and `a_f` of the functions; returns the one on the pin:
    ///
    /// ```text
    /// F_A = m (a_A + Σ ⟨g_f⟩ a_f)     F_f = m (⟨g_f⟩ a_A + Σ ⟨g_f g_h⟩ a_h)
    /// ```
    #[inline]
    pub(super) fn inertia(&self, first: Vector, a: &[Vector; W], force: &mut [Vector; W]) -> Vector {
        let (s, m) = (&self.shapes, self.mass_kg);
        let (mut total, mut chord) = (first, [s.mean[0] * first[0], s.mean[0] * first[1]]);
        for (f, a) in a.iter().enumerate() {
            total = add_scaled(total, s.mean[f], *a);
            chord = add_scaled(chord, s.first[f], *a);
        }
        *force = from_fn(|f| {
            let own = add_scaled([s.square[f] * a[f][0], s.square[f] * a[f][1]], s.mean[f], first);
            let own = add_scaled(own, s.first[f], a[0]);
            [m * own[0], m * own[1]]
        });
        force[0] = [m * chord[0], m * chord[1]];
        if s.root {
            let root = s.sines + 1;
            for f in s.modes + 1..root {
                force[f] = add_scaled(force[f], m * s.with_root[f], a[root]);
                force[root] = add_scaled(force[root], m * s.with_root[f], a[f]);
            }
        }
        [m * total[0], m * total[1]]
    }

    /// Moment of the functions' forces about the first pin, `Σ u_f × F_f`.
    #[inline]
    pub(super) fn moment(&self, force: &[Vector; W]) -> f64 {
        self.u.iter().zip(force).map(|(u, f)| cross(*u, *f)).sum()
    }

    /// Adds what the functions' forces do in this link's own coordinates, `Σ F_f · ∂u_f/∂q_i`.
    #[inline]
    pub(super) fn pull_back(&self, force: &[Vector; W], r: &mut [f64]) {
        let n = self.bending;
        let r = &mut r[self.at..self.at + self.coordinates()];
        let along = force.map(|force| force[0]);
        for (i, (r, grad)) in r.iter_mut().zip(&self.grad).enumerate() {
            *r += product(grad, &along) + force[self.shapes.function_of(i)][1];
        }
        for e in 0..self.axial {
            r[n + e] += force[e][0];
        }
    }

    /// Kinetic energy for the velocity of the first pin and those of the functions, in the frame of the chord, J.
    pub(super) fn kinetic_j(&self, first: Vector, velocity: impl Fn(usize) -> Vector) -> f64 {
        let s = &self.shapes;
        let (chord, root) = (velocity(0), velocity(s.functions() - 1));
        let mut twice = dot(first, first) - s.first[0] * dot(chord, chord);
        for f in 0..s.functions() {
            let v = velocity(f);
            twice += 2.0 * s.mean[f] * dot(first, v) + 2.0 * s.first[f] * dot(chord, v);
            if f > 0 {
                twice += s.square[f] * dot(v, v) + 2.0 * s.with_root[f] * dot(v, root);
            }
        }
        0.5 * self.mass_kg * twice
    }
}

/// `a · b`, by the sums over even and over odd functions; W is even.
#[inline]
fn product<const W: usize>(a: &[f64; W], b: &[f64; W]) -> f64 {
    let (a, b) = (a.as_chunks::<2>().0, b.as_chunks::<2>().0);
    let sums = a.iter().zip(b).fold([0.0; 2], |sums, (a, b)| [sums[0] + a[0] * b[0], sums[1] + a[1] * b[1]]);
    sums[0] + sums[1]
}
