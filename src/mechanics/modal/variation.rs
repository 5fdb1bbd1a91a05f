//! Terms of one link in the tangent: variations of its accelerations, and the stiffness of the forces present.

use super::frame::Angle;
use super::link::Link;
use super::plane::{Vector, add, add_scaled, scale};

impl<const W: usize> Link<W> {
    /// `∂c/∂q_i` for own coordinate `i`, with two time derivatives.
    #[inline]
    pub(super) fn chord_derivative(&self, i: usize) -> [f64; 3] {
        match i.checked_sub(self.bending) {
            None => [&self.grad, &self.dgrad, &self.ddgrad].map(|g| g[i][0]),
            Some(0) => [1.0, 0.0, 0.0],
            Some(_) => [0.0; 3],
        }
    }

    /// Sets the variation of `d²(R u_f)/dt²`, in the frame of the chord, by the angle: `R u_f` varies by `J (R u_f)`, so with
    /// weights of that and of its two time derivatives it is `w_0 Ju + w_1 J(u̇ + ωJu) + w_2 Ja`.
    #[inline]
    pub(super) fn vary_angle(&self, chord: Angle, a: &[Vector; W], w: [f64; 3], out: &mut [Vector; W]) {
        let (wu, wj) = (w[0], w[1] * chord.rate);
        *out = std::array::from_fn(|f| {
            let (u, du, a) = (self.u[f], self.du[f], a[f]);
            [-wu * u[1] - w[1] * du[1] - wj * u[0] - w[2] * a[1], wu * u[0] + w[1] * du[0] - wj * u[1] + w[2] * a[0]]
        });
    }

    /// Adds the variation by own coordinate `i`: with `g = ∂u/∂q_i`,
    /// `w_0 g + w_1 (ġ + ωJg) + w_2 (g̈ + 2ωJġ + εJg − ω²g)`.
    #[inline]
    pub(super) fn vary_field(&self, chord: Angle, i: usize, w: [f64; 3], out: &mut [Vector; W]) {
        let (n, omega) = (self.bending, chord.rate);
        let along = w[0] - omega * omega * w[2];
        let across = omega * w[1] + chord.acceleration * w[2];
        if i >= n {
            out[i - n] = add(out[i - n], [along, across]);
            return;
        }
        let f = self.shapes.function_of(i);
        out[f] = add(out[f], [-across, along]);
        let (grad, dgrad, ddgrad) = (&self.grad[i], &self.dgrad[i], &self.ddgrad[i]);
        for (f, out) in out.iter_mut().enumerate() {
            out[0] += along * grad[f] + w[1] * dgrad[f] + w[2] * ddgrad[f];
            out[1] += across * grad[f] + 2.0 * omega * w[2] * dgrad[f];
        }
    }

    /// The variation of the chord `R u_0` and its two time derivatives, in the frame of the chord, by the angle (whose own
    /// variation and time derivatives are `angle`) and by own coordinate `own`.
    #[inline]
    pub(super) fn chord_column(&self, chord: Angle, a: &[Vector; W], angle: [f64; 3], own: Option<usize>) -> [Vector; 3] {
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

    /// Adds `weight (Σ F_f · ∂²(R u_f)/∂q_i∂q_j + ∂²V₄/∂q_i∂q_j)` to the `n × n` matrix `k`; `angle` holds `∂β/∂q_j`.
    ///
    /// V₄ is the energy of strong bending. With `p_j = Σ F_f · J ∂u_f/∂q_j` and `s = −Σ F_f · u_f` it is `p_i β_j + p_j β_i + s β_i β_j − Σ F_f,x Q_f,ij`, but for
    /// `Σ u_f × F_f ∂²β/∂q_i∂q_j`, which is nil: β is linear in `q`, or the force of the guide makes the moment nil.
    pub(super) fn geometric(&mut self, force: &[Vector; W], angle: &[f64], weight: f64, p: &mut [f64], k: &mut [f64]) {
        let (n, all) = (self.bending, angle.len());
        p.fill(0.0);
        for i in 0..self.coordinates() {
            p[self.at + i] = match i.checked_sub(n) {
                Some(e) => force[e][1],
                None => {
                    let along: f64 = self.grad[i].iter().zip(force).map(|(g, force)| g * force[1]).sum();
                    along - force[self.shapes.function_of(i)][0]
                }
            };
        }
        let s: f64 = -self.u.iter().zip(force).map(|(u, f)| u[0] * f[0] + u[1] * f[1]).sum::<f64>();
        for (row, (p_i, angle_i)) in k.chunks_exact_mut(all).zip(p.iter().zip(angle)) {
            let (by_angle, by_p) = (weight * (p_i + s * angle_i), weight * angle_i);
            for (k, (p_j, angle_j)) in row.iter_mut().zip(p.iter().zip(angle)) {
                *k += by_angle * angle_j + by_p * p_j;
            }
        }
        let at = self.at;
        self.shapes.pulled(
            |f| force[f][0],
            &mut self.scratch.pulls,
            |i, j, along| {
                k[(at + i) * all + at + j] -= weight * along;
                if i != j {
                    k[(at + j) * all + at + i] -= weight * along;
                }
            },
        );
        self.strong.stiffness(weight, force[0][0], at, all, k);
    }
}
