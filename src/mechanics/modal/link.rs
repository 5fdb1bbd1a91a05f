//! One link in its own frame: its field `u_f(q)`, its inertia, its elasticity.

use super::elastic::Elastic;
use super::plane::{Vector, add_scaled, cross, dot, quarter};
use super::quartic::Quartic;
use super::shapes::Shapes;
use crate::scene;

/// Least number of sines that carry axial displacement in a bent link: `∫ w'²` of the first mode needs the second sine.
/// Beyond that as many as modes are enough (twice as many, all that there are, change R2s by 6 %).
const LEAST_AXIAL_SINES: usize = 2;
/// Axial coordinates where asked for: the stretch and one half-wave.
const AXIAL_COORDINATES: usize = 2;

/// A link's constants and the present values of its field.
///
/// `u_0 = (c, 0)` is the chord, `u_f = (a_f, η_f)` goes with function `g_f`. The first component depends on the bending
/// coordinates by foreshortening, `u_f,x = L δ_f0 + e_f − ½ ηᵀQ_fη`, with `e_f` only where axial flexibility is asked for.
#[derive(Debug, Clone)]
pub(super) struct Link {
    pub(super) shapes: Shapes,
    pub(super) length_m: f64,
    pub(super) mass_kg: f64,
    /// Place of this link's coordinates in `q`: bending, then axial.
    pub(super) at: usize,
    /// Bending coordinates.
    pub(super) bending: usize,
    /// Axial coordinates `e_0, e_1, …`.
    pub(super) axial: usize,
    pub(super) elastic: Elastic,
    /// What strong bending takes from the chord, `c₄ = −⅛ ∫ w'⁴ ds = −¼ U_ijkl η_i η_j η_k η_l`, and `U_ijkl η_k η_l`,
    /// `U_ijkl η_k η̇_l` at present.
    pub(super) strong: Quartic,
    pub(super) bow: Vec<f64>,
    dbow: Vec<f64>,
    /// The present η and η̇ of the sines.
    eta: Vec<f64>,
    deta: Vec<f64>,
    /// Field, velocities and accelerations in the frame of the chord, as if it stood still.
    pub(super) u: Vec<Vector>,
    pub(super) du: Vec<Vector>,
    pub(super) ddu: Vec<Vector>,
    /// `∂u_f,x/∂η_i = −(Q_fη)_i` at `i (sines + 1) + f`, with its first and second time derivatives.
    pub(super) grad: Vec<f64>,
    pub(super) dgrad: Vec<f64>,
    pub(super) ddgrad: Vec<f64>,
}

impl Link {
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
        let (functions, bending) = (shapes.functions(), shapes.bending());
        let gradient = vec![0.0; (shapes.sines + 1) * bending];
        let mut u = vec![[0.0; 2]; functions];
        let zero = u.clone();
        u[0][0] = length;
        let strong = Quartic::slope(shapes.modes, 0.125 / length.powi(3));
        Self {
            bow: strong.matrix(),
            dbow: strong.matrix(),
            eta: vec![0.0; shapes.modes],
            deta: vec![0.0; shapes.modes],
            strong,
            shapes,
            length_m: length,
            mass_kg: link.mass_kg,
            at,
            bending,
            axial,
            elastic,
            u,
            du: zero.clone(),
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
        let per = self.shapes.sines + 1;
        for x in [&mut self.u, &mut self.du, &mut self.ddu] {
            x[..per].iter_mut().for_each(|x| x[0] = 0.0);
        }
        self.grad.fill(0.0);
        self.dgrad.fill(0.0);
        let taken = self.bow(eta, deta);
        let rows = self.shapes.shortening.chunks_exact((n * per).max(1));
        let gradients = self.grad.chunks_exact_mut(per).zip(self.dgrad.chunks_exact_mut(per));
        for (i, (row, (grad, dgrad))) in rows.zip(gradients).enumerate() {
            for (j, row) in row.chunks_exact(per).enumerate() {
                for ((q, g), dg) in row.iter().zip(grad.iter_mut()).zip(dgrad.iter_mut()) {
                    *g -= q * eta[j];
                    *dg -= q * deta[j];
                }
            }
            let fields = self.u.iter_mut().zip(&mut self.du).zip(&mut self.ddu);
            for (((u, du), ddu), (g, dg)) in fields.zip(grad.iter().zip(dgrad.iter())) {
                u[0] += 0.5 * g * eta[i];
                du[0] += g * deta[i];
                ddu[0] += g * ddeta[i] + dg * deta[i];
            }
        }
        self.u[0][0] += self.length_m + taken;
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

    /// Sets the fourth-order part of the chord's gradient, `∂c₄/∂η = −Bη` with `B = Uηη`, and its rate `−3 Bη̇`.
    /// Returns what makes `½ ∂c₄/∂η · η` into `c₄`.
    #[inline]
    fn bow(&mut self, eta: &[f64], deta: &[f64]) -> f64 {
        let (strong, per, modes) = (&self.strong, self.shapes.sines + 1, self.shapes.modes);
        self.eta.copy_from_slice(&eta[..modes]);
        self.deta.copy_from_slice(&deta[..modes]);
        strong.contract(eta, eta, &mut self.bow);
        strong.apply(&self.bow, eta, |i, x| self.grad[i * per] -= x);
        strong.apply(&self.bow, deta, |i, x| self.dgrad[i * per] -= 3.0 * x);
        -0.25 * self.eta.iter().zip(self.grad.chunks_exact(per)).map(|(eta, grad)| eta * grad[0]).sum::<f64>()
    }

    /// The second time derivative of the gradient, `−Q_fη̈`, and for the chord `−3 (Bη̈ + Ḃη̇)`.
    pub(super) fn deform_gradient(&mut self, a: &[f64]) {
        let (n, per) = (self.bending, self.shapes.sines + 1);
        let ddeta = &a[self.at..self.at + n];
        self.ddgrad.fill(0.0);
        for (row, ddgrad) in self.shapes.shortening.chunks_exact((n * per).max(1)).zip(self.ddgrad.chunks_exact_mut(per)) {
            for (row, ddeta) in row.chunks_exact(per).zip(ddeta) {
                for (q, ddg) in row.iter().zip(ddgrad.iter_mut()) {
                    *ddg -= q * ddeta;
                }
            }
        }
        self.strong.apply(&self.bow, ddeta, |i, x| self.ddgrad[i * per] -= 3.0 * x);
        self.strong.contract(&self.eta, &self.deta, &mut self.dbow);
        self.strong.apply(&self.dbow, &self.deta, |i, x| self.ddgrad[i * per] -= 6.0 * x);
    }

    /// Accelerations `R⁻¹ d²(R u)/dt² = ü + 2ωJu̇ + εJu − ω²u` of all functions, in the frame of the chord.
    #[inline]
    pub(super) fn accelerate(&self, omega: f64, epsilon: f64, out: &mut [Vector]) {
        for (f, out) in out.iter_mut().enumerate() {
            let a = add_scaled(self.ddu[f], 2.0 * omega, quarter(self.du[f]));
            *out = add_scaled(add_scaled(a, epsilon, quarter(self.u[f])), -omega * omega, self.u[f]);
        }
    }

    /// Inertia forces of accelerations `a_first` of the first pin and `a_f` of the functions; returns the one on the pin:
    ///
    /// ```text
    /// F_A = m (a_A + Σ ⟨g_f⟩ a_f)     F_f = m (⟨g_f⟩ a_A + Σ ⟨g_f g_h⟩ a_h)
    /// ```
    #[inline]
    pub(super) fn inertia(&self, first: Vector, a: &[Vector], force: &mut [Vector]) -> Vector {
        let (s, m) = (&self.shapes, self.mass_kg);
        let (mut total, mut chord) = (first, [s.mean[0] * first[0], s.mean[0] * first[1]]);
        let last = a.len() - 1;
        for f in 0..=last {
            total = add_scaled(total, s.mean[f], a[f]);
            chord = add_scaled(chord, s.first[f], a[f]);
            let own = add_scaled([s.square[f] * a[f][0], s.square[f] * a[f][1]], s.mean[f], first);
            let own = add_scaled(own, s.first[f], a[0]);
            force[f] = [m * own[0], m * own[1]];
        }
        force[0] = [m * chord[0], m * chord[1]];
        if s.root {
            for f in s.modes + 1..=s.sines {
                force[f] = add_scaled(force[f], m * s.with_root[f], a[last]);
                force[last] = add_scaled(force[last], m * s.with_root[f], a[f]);
            }
        }
        [m * total[0], m * total[1]]
    }

    /// Moment of the functions' forces about the first pin, `Σ u_f × F_f`.
    #[inline]
    pub(super) fn moment(&self, force: &[Vector]) -> f64 {
        self.u.iter().zip(force).map(|(u, f)| cross(*u, *f)).sum()
    }

    /// Adds what the functions' forces do in this link's own coordinates, `Σ F_f · ∂u_f/∂q_i`.
    #[inline]
    pub(super) fn pull_back(&self, force: &[Vector], r: &mut [f64]) {
        let n = self.bending;
        let r = &mut r[self.at..self.at + self.coordinates()];
        for (i, (r, grad)) in r.iter_mut().zip(self.grad.chunks_exact(self.shapes.sines + 1)).enumerate() {
            let along: f64 = grad.iter().zip(force).map(|(g, force)| g * force[0]).sum();
            *r += along + force[self.shapes.function_of(i)][1];
        }
        for e in 0..self.axial {
            r[n + e] += force[e][0];
        }
    }

    /// Kinetic energy for the velocity of the first pin and those of the functions, in the frame of the chord, J.
    pub(super) fn kinetic_j(&self, first: Vector, velocity: impl Fn(usize) -> Vector) -> f64 {
        let (s, last) = (&self.shapes, self.u.len() - 1);
        let (chord, root) = (velocity(0), velocity(last));
        let mut twice = dot(first, first) - s.first[0] * dot(chord, chord);
        for f in 0..=last {
            let v = velocity(f);
            twice += 2.0 * s.mean[f] * dot(first, v) + 2.0 * s.first[f] * dot(chord, v);
            if f > 0 {
                twice += s.square[f] * dot(v, v) + 2.0 * s.with_root[f] * dot(v, root);
            }
        }
        0.5 * self.mass_kg * twice
    }
}
