//! The exact tangent `a ∂r/∂q̈ + v ∂r/∂q̇ + q ∂r/∂q`, by columns.
//!
//! All inertia forces are `f = M z̈` in global vectors `z = (A, R u_f)` with a constant `M`. For `z = z(q)`, `z_j = ∂z/∂q_j`,
//!
//! ```text
//! ∂z̈/∂q̈_j = z_j      ∂z̈/∂q̇_j = 2 ż_j      ∂z̈/∂q_j = z̈_j
//! ```
//!
//! so column j of the tangent is what `M (a z_j + 2v ż_j + q z̈_j)` does in each coordinate, plus `q Σ f · ∂²z/∂q_i∂q_j`.

use super::chain::{Chain, ChordAngle, LinkForces, combine};
use super::frame::Closure;
use super::plane::{Vector, add, scale};
use crate::mechanics::lu::Lu;
use crate::mechanics::mechanism::{Singular, Weights};

/// Preallocated room for the tangent and its factors.
#[derive(Debug, Clone)]
pub(super) struct Tangent<const W: usize> {
    lu: Lu,
    column: Vec<f64>,
    variations: Vec<[Vector; W]>,
    forces: Vec<LinkForces<W>>,
    angle_rows: Vec<Vec<f64>>,
    scratch: Vec<f64>,
}

/// `z_j`, `ż_j`, `z̈_j` of a point in global axes.
type Column = [Vector; 3];

impl<const W: usize> Tangent<W> {
    pub(super) fn new(chain: &Chain<W>) -> Self {
        let n = chain.degrees_of_freedom;
        Self {
            lu: Lu::new(n),
            column: vec![0.0; n],
            variations: chain.accelerations.clone(),
            forces: chain.forces.clone(),
            angle_rows: chain.angle_rows.clone(),
            scratch: vec![0.0; n],
        }
    }

    /// The matrix, column by column, for the motion and forces that the chain holds.
    pub(super) fn assemble(&mut self, chain: &mut Chain<W>, a: &[f64], w: Weights) -> &[f64] {
        let n = chain.degrees_of_freedom;
        let still = w.velocity == 0.0 && w.position == 0.0;
        if !still {
            for link in &mut chain.links {
                link.deform_gradient(a);
            }
        }
        let closure = match (chain.links.last(), chain.frames.last()) {
            (Some(link), Some(frame)) if chain.tip.slides => Some(Closure::new(link, frame)),
            _ => None,
        };
        for j in 0..n {
            self.column(chain, closure.as_ref(), j, w);
            self.lu.matrix[j * n..(j + 1) * n].copy_from_slice(&self.column);
        }
        if !still {
            self.stiffness(chain, w);
        }
        &self.lu.matrix
    }

    /// Factors the last matrix.
    pub(super) fn factor(&mut self) -> Result<(), Singular> {
        self.lu.factor()
    }

    /// Solves with the last factors.
    pub(super) fn solve(&self, x: &mut [f64]) {
        self.lu.solve(x);
    }

    /// Column `j` of the inertia and end forces.
    fn column(&mut self, chain: &Chain<W>, closure: Option<&Closure>, j: usize, w: Weights) {
        let weights = [w.acceleration, 2.0 * w.velocity, w.position];
        let mut pin: Column = [[0.0; 2]; 3];
        for (b, link) in chain.links.iter().enumerate() {
            let (frame, forces, variation) = (&chain.frames[b], &mut self.forces[b], &mut self.variations[b]);
            let own = j.checked_sub(link.at).filter(|i| *i < link.coordinates());
            let angle = match (chain.angles[b], closure) {
                (ChordAngle::Closed, Some(closure)) => closure.angle(pin, own.map(|i| link.chord_derivative(i))),
                _ => [chain.angle_rows[b][j], 0.0, 0.0],
            };
            self.angle_rows[b][j] = angle[0];
            if b == 0 && own.is_none() && angle[0] == 0.0 {
                forces.first = [0.0; 2];
                forces.functions = [[0.0; 2]; W];
                continue;
            }
            link.vary_angle(frame.chord, &chain.accelerations[b], convolve(weights, angle), variation);
            if let Some(i) = own {
                link.vary_field(frame.chord, i, weights, variation);
            }
            let first = frame.direction.to_local(combine(weights, pin));
            forces.first = link.inertia(first, variation, &mut forces.functions);
            let chord = link.chord_column(frame.chord, &chain.accelerations[b], angle, own);
            for (pin, own) in pin.iter_mut().zip(chord) {
                *pin = add(*pin, frame.direction.to_global(own));
            }
        }
        let [_, resistance] = chain.tip.resistance(chain.frames[0].chord.angle);
        let mut end = scale(chain.tip.mass_kg, combine(weights, pin));
        end[0] += chain.tip.friction_n_s_per_m * (w.velocity * pin[0][0] + w.position * pin[1][0]);
        end[0] += resistance * w.position * self.angle_rows[0][j];
        self.column.fill(0.0);
        chain.pull_back(end, &mut self.forces, &mut self.column);
    }

    /// Adds the stiffness of elasticity, of the base, and of the forces present, which is symmetric.
    fn stiffness(&mut self, chain: &mut Chain<W>, w: Weights) {
        let n = chain.degrees_of_freedom;
        let k = &mut self.lu.matrix;
        for (b, link) in chain.links.iter_mut().enumerate() {
            link.geometric(&chain.forces[b].functions, &self.angle_rows[b], w.position, &mut self.scratch, k);
            link.elastic.tangent(w.position, w.velocity, link.at, n, k);
        }
        let base = chain.base.torsion_spring_nm_per_rad * w.position + chain.base.damper_nm_s_per_rad * w.velocity;
        for (i, row) in chain.tangent_row.iter().enumerate() {
            for (j, column) in chain.tangent_row.iter().enumerate() {
                k[i * n + j] += base * row * column;
            }
        }
    }
}

/// Weights of `(x, ẋ, ẍ)` in `w · (x b, (x b)˙, (x b)¨)`.
fn convolve(w: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [w[0] * b[0] + w[1] * b[1] + w[2] * b[2], w[1] * b[0] + 2.0 * w[2] * b[1], w[2] * b[0]]
}
