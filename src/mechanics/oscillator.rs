//! Masses on a line joined by springs (thesis 5.2): `M ẍ + K x = F`, with its exact solution beside it.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::lu::Lu;
use super::mechanism::{Coordinate, Input, Measure, Mechanism, NoEquilibrium, ROTATIONS, Singular, Weights};
use super::observation::{Energy, Observation};
use crate::scene;

/// The masses, their springs and constant forces.
pub struct Oscillator {
    masses_kg: Vec<f64>,
    /// Row by row.
    stiffness: Vec<f64>,
    forces_n: Vec<f64>,
    start_m: Vec<f64>,
    exact: Modes,
    lu: Lu,
    scale_n: f64,
}

impl Oscillator {
    /// The oscillator of a scene.
    pub fn new(scene: &scene::Oscillator) -> Self {
        let n = scene.masses_kg.len();
        let mut stiffness = vec![0.0; n * n];
        for spring in &scene.springs {
            let ends = spring.ends.map(|end| end.checked_sub(1));
            for (one, other) in [(ends[0], ends[1]), (ends[1], ends[0])] {
                let Some(i) = one else { continue };
                stiffness[i * n + i] += spring.stiffness_n_per_m;
                if let Some(j) = other {
                    stiffness[i * n + j] -= spring.stiffness_n_per_m;
                }
            }
        }
        let (masses_kg, forces_n, start_m) = (scene.masses_kg.clone(), scene.forces_n.clone(), scene.start_m.clone());
        let exact = Modes::new(&masses_kg, &stiffness, &forces_n, &start_m);
        Oscillator { masses_kg, stiffness, forces_n, start_m, exact, lu: Lu::new(n), scale_n: 0.0 }
    }

    fn elastic_n(&self, i: usize, q: &[f64]) -> f64 {
        let n = q.len();
        self.stiffness[i * n..(i + 1) * n].iter().zip(q).map(|(k, q)| k * q).sum()
    }
}

impl Mechanism for Oscillator {
    fn degrees_of_freedom(&self) -> usize {
        self.masses_kg.len()
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        (1..=self.masses_kg.len()).map(|i| Coordinate::displacement(format!("mass_{i}_m"), 1.0)).collect()
    }

    fn start(&mut self, _input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium> {
        q.copy_from_slice(&self.start_m);
        v.fill(0.0);
        Ok(())
    }

    fn residual(&mut self, _input: &Input, q: &[f64], _v: &[f64], a: &[f64], r: &mut [f64]) {
        self.scale_n = 0.0;
        for i in 0..q.len() {
            let (inertia, elastic, force) = (self.masses_kg[i] * a[i], self.elastic_n(i, q), self.forces_n[i]);
            r[i] = inertia + elastic - force;
            self.scale_n = self.scale_n.max(inertia.abs() + elastic.abs() + force.abs());
        }
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        let largest = r.iter().fold(0.0, |most: f64, r| most.max(r.abs()));
        if largest == 0.0 { 0.0 } else { largest / self.scale_n }
    }

    fn factor(&mut self, _input: &Input, q: &[f64], _v: &[f64], _a: &[f64], w: Weights) -> Result<(), Singular> {
        let n = q.len();
        for (entry, k) in self.lu.matrix.iter_mut().zip(&self.stiffness) {
            *entry = w.position * k;
        }
        for (i, mass_kg) in self.masses_kg.iter().enumerate() {
            self.lu.matrix[i * n + i] += w.acceleration * mass_kg;
        }
        self.lu.factor()
    }

    fn tangent(
        &mut self,
        _input: &Input,
        q: &[f64],
        _v: &[f64],
        _a: &[f64],
        w: Weights,
        entry: &mut dyn FnMut(usize, usize, f64),
    ) {
        let n = q.len();
        self.stiffness.iter().enumerate().for_each(|(place, k)| entry(place / n, place % n, w.position * k));
        self.masses_kg.iter().enumerate().for_each(|(i, mass_kg)| entry(i, i, w.acceleration * mass_kg));
    }

    fn rigid_motion(&mut self, _input: &Input, _rate_rad_per_s: f64, _q: &[f64], v: &mut [f64], a: &mut [f64]) {
        v.fill(0.0);
        a.fill(0.0);
    }

    fn solve(&mut self, x: &mut [f64]) {
        self.lu.solve(x);
    }

    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation) {
        let Some(masses) = out.links.first_mut() else { return };
        for (i, (node, exact_x_m)) in masses.nodes.iter_mut().zip(&mut masses.exact_x_m).enumerate() {
            node.position_m = [q[i], 0.0];
            node.velocity_m_per_s = [v[i], 0.0];
            *exact_x_m = self.exact.position_m(i, input.time_s);
        }
        out.energy = self.energy(input, q, v, a);
    }

    fn energy(&mut self, _input: &Input, q: &[f64], v: &[f64], _a: &[f64]) -> Energy {
        let kinetic_j = self.masses_kg.iter().zip(v).map(|(m, v)| 0.5 * m * v * v).sum();
        let strain_j = (0..q.len()).map(|i| 0.5 * q[i] * self.elastic_n(i, q)).sum();
        Energy { kinetic_j, strain_j: Some(strain_j), potential_j: None }
    }

    fn measure(&self, _q: &[f64], _dq: &[f64]) -> Option<Measure> {
        None
    }

    fn chords(&self, _q: &[f64], _v: &[f64]) -> [[f64; 2]; ROTATIONS] {
        [[0.0; 2]; ROTATIONS]
    }

    fn power(&mut self, _input: &Input, _q: &[f64], v: &[f64], _a: &[f64]) -> [f64; 2] {
        [self.forces_n.iter().zip(v).map(|(f, v)| f * v).sum(), 0.0]
    }
}

/// The exact solution: with `M^½ x = Σ φₖ yₖ` and `M^−½ K M^−½ φₖ = ωₖ² φₖ`, each mode obeys `ÿₖ + ωₖ² yₖ = fₖ`, so from rest
/// `yₖ = fₖ/ωₖ² + (yₖ(0) − fₖ/ωₖ²) cos ωₖt`, or `yₖ(0) + ½ fₖ t²` where `ωₖ = 0`.
struct Modes {
    /// Amplitude of each mass in each mode, `m^−½ φ`, column by mode.
    shapes: DMatrix<f64>,
    frequencies: Vec<f64>,
    forces: DVector<f64>,
    start: DVector<f64>,
}

impl Modes {
    fn new(masses_kg: &[f64], stiffness: &[f64], forces_n: &[f64], start_m: &[f64]) -> Self {
        let n = masses_kg.len();
        let root = DVector::from_iterator(n, masses_kg.iter().map(|m| m.sqrt()));
        let scaled = DMatrix::from_fn(n, n, |i, j| stiffness[i * n + j] / (root[i] * root[j]));
        let largest = scaled.amax();
        let eigen = SymmetricEigen::new(scaled);
        let floor = 1e-14 * largest;
        Modes {
            forces: eigen.eigenvectors.tr_mul(&DVector::from_fn(n, |i, _| forces_n[i] / root[i])),
            start: eigen.eigenvectors.tr_mul(&DVector::from_fn(n, |i, _| start_m[i] * root[i])),
            frequencies: eigen.eigenvalues.iter().map(|&square| if square > floor { square.sqrt() } else { 0.0 }).collect(),
            shapes: DMatrix::from_fn(n, n, |i, k| eigen.eigenvectors[(i, k)] / root[i]),
        }
    }

    fn position_m(&self, mass: usize, t_s: f64) -> f64 {
        let mode = |(k, &omega): (usize, &f64)| {
            let (force, start) = (self.forces[k], self.start[k]);
            let y = if omega > 0.0 {
                let rest = force / (omega * omega);
                rest + (start - rest) * (omega * t_s).cos()
            } else {
                start + 0.5 * force * t_s * t_s
            };
            self.shapes[(mass, k)] * y
        };
        self.frequencies.iter().enumerate().map(mode).sum()
    }
}
