//! One link in its own frame: its field `u_f(q)`, its inertia, its elasticity.

use super::elastic::Elastic;
use super::frame::Angle;
use super::plane::{Vector, add, add_scaled, cross, dot, quarter, scale};
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
    strong: Quartic,
    bow: Vec<f64>,
    dbow: Vec<f64>,
    /// The present `η̇`.
    rates: Vec<f64>,
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
            rates: vec![0.0; shapes.modes],
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
        self.bow(&eta[..self.shapes.modes], &deta[..self.shapes.modes], &ddeta[..self.shapes.modes]);
        self.u[0][0] += self.length_m;
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

    /// Adds the fourth-order part of the chord: `∂c₄/∂η = −B η` with `B = Uηη`, `−3 B η̇` its rate.
    #[inline]
    fn bow(&mut self, eta: &[f64], deta: &[f64], ddeta: &[f64]) {
        let (strong, per) = (&self.strong, self.shapes.sines + 1);
        self.rates.copy_from_slice(deta);
        strong.contract(eta, eta, &mut self.bow);
        strong.contract(eta, deta, &mut self.dbow);
        strong.apply(&self.bow, eta, |i, x| self.grad[i * per] -= x);
        strong.apply(&self.bow, deta, |i, x| self.dgrad[i * per] -= 3.0 * x);
        self.u[0][0] -= 0.25 * strong.form(&self.bow, eta, eta);
        self.du[0][0] -= strong.form(&self.bow, eta, deta);
        self.ddu[0][0] -= strong.form(&self.bow, eta, ddeta) + 3.0 * strong.form(&self.bow, deta, deta);
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
        self.strong.apply(&self.dbow, &self.rates, |i, x| self.ddgrad[i * per] -= 6.0 * x);
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

    /// `∂c/∂q_i` for own coordinate `i`, with two time derivatives.
    #[inline]
    pub(super) fn chord_derivative(&self, i: usize) -> [f64; 3] {
        match i.checked_sub(self.bending) {
            None => [&self.grad, &self.dgrad, &self.ddgrad].map(|g| g[i * (self.shapes.sines + 1)]),
            Some(0) => [1.0, 0.0, 0.0],
            Some(_) => [0.0; 3],
        }
    }

    /// Sets the variation of `d²(R u_f)/dt²`, in the frame of the chord, by the angle: `R u_f` varies by `J (R u_f)`, so with
    /// weights of that and of its two time derivatives it is `w_0 Ju + w_1 J(u̇ + ωJu) + w_2 Ja`.
    #[inline]
    pub(super) fn vary_angle(&self, chord: Angle, a: &[Vector], w: [f64; 3], out: &mut [Vector]) {
        let (wu, wj) = (w[0], w[1] * chord.rate);
        for (((out, u), du), a) in out.iter_mut().zip(&self.u).zip(&self.du).zip(a) {
            out[0] = -wu * u[1] - w[1] * du[1] - wj * u[0] - w[2] * a[1];
            out[1] = wu * u[0] + w[1] * du[0] - wj * u[1] + w[2] * a[0];
        }
    }

    /// Adds the variation by own coordinate `i`: with `g = ∂u/∂q_i`,
    /// `w_0 g + w_1 (ġ + ωJg) + w_2 (g̈ + 2ωJġ + εJg − ω²g)`.
    #[inline]
    pub(super) fn vary_field(&self, chord: Angle, i: usize, w: [f64; 3], out: &mut [Vector]) {
        let (n, omega) = (self.bending, chord.rate);
        let along = w[0] - omega * omega * w[2];
        let across = omega * w[1] + chord.acceleration * w[2];
        if i >= n {
            out[i - n] = add(out[i - n], [along, across]);
            return;
        }
        let f = self.shapes.function_of(i);
        out[f] = add(out[f], [-across, along]);
        let per = self.shapes.sines + 1;
        let [grad, dgrad, ddgrad] = [&self.grad, &self.dgrad, &self.ddgrad].map(|g| &g[i * per..(i + 1) * per]);
        for (((out, g), dg), ddg) in out.iter_mut().zip(grad).zip(dgrad).zip(ddgrad) {
            out[0] += along * g + w[1] * dg + w[2] * ddg;
            out[1] += across * g + 2.0 * omega * w[2] * dg;
        }
    }

    /// The variation of the chord `R u_0` and its two time derivatives, in the frame of the chord, by the angle (whose own
    /// variation and time derivatives are `angle`) and by own coordinate `own`.
    #[inline]
    pub(super) fn chord_column(&self, chord: Angle, a: &[Vector], angle: [f64; 3], own: Option<usize>) -> [Vector; 3] {
        let (omega, c, dc) = (chord.rate, self.u[0][0], self.du[0][0]);
        let turned = [[0.0, c], [-omega * c, dc], [-a[0][1], a[0][0]]];
        let [b, db, ddb] = angle;
        let mut column = [
            scale(b, turned[0]),
            add_scaled(scale(b, turned[1]), db, turned[0]),
            add_scaled(add_scaled(scale(b, turned[2]), 2.0 * db, turned[1]), ddb, turned[0]),
        ];
        if let Some(i) = own {
            let [g, dg, ddg] = self.chord_derivative(i);
            column[0] = add(column[0], [g, 0.0]);
            column[1] = add(column[1], [dg, omega * g]);
            column[2] = add(column[2], [ddg - omega * omega * g, 2.0 * omega * dg + chord.acceleration * g]);
        }
        column
    }

    /// Adds `weight Σ F_f · ∂²(R u_f)/∂q_i∂q_j` to the `n × n` matrix `k`; `angle` holds `∂β/∂q_j`.
    ///
    /// With `p_j = Σ F_f · J ∂u_f/∂q_j` and `s = −Σ F_f · u_f` it is `p_i β_j + p_j β_i + s β_i β_j − Σ F_f,x Q_f,ij`, but for
    /// `Σ u_f × F_f ∂²β/∂q_i∂q_j`, which is nil: β is linear in `q`, or the force of the guide makes the moment nil.
    pub(super) fn geometric(&self, force: &[Vector], angle: &[f64], weight: f64, p: &mut [f64], k: &mut [f64]) {
        let (n, per, all) = (self.bending, self.shapes.sines + 1, angle.len());
        p.fill(0.0);
        for i in 0..self.coordinates() {
            p[self.at + i] = match i.checked_sub(n) {
                Some(e) => force[e][1],
                None => {
                    let grad = &self.grad[i * per..(i + 1) * per];
                    let along: f64 = grad.iter().zip(force).map(|(g, force)| g * force[1]).sum();
                    along - force[self.shapes.function_of(i)][0]
                }
            };
        }
        let s: f64 = -self.u.iter().zip(force).map(|(u, f)| u[0] * f[0] + u[1] * f[1]).sum::<f64>();
        for i in 0..all {
            for j in 0..all {
                k[i * all + j] += weight * (p[i] * angle[j] + p[j] * angle[i] + s * angle[i] * angle[j]);
            }
        }
        for (ij, row) in self.shapes.shortening.chunks_exact(per).enumerate() {
            let along: f64 = row.iter().zip(force).map(|(q, force)| q * force[0]).sum();
            k[(self.at + ij / n) * all + self.at + ij % n] -= weight * along;
        }
        for (&[i, j], bow) in self.strong.pairs.iter().zip(&self.bow) {
            k[(self.at + i) * all + self.at + j] -= 3.0 * weight * bow * force[0][0];
            if i != j {
                k[(self.at + j) * all + self.at + i] -= 3.0 * weight * bow * force[0][0];
            }
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
