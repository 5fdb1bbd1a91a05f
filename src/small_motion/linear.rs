//! The variational equations along recorded stages, as a linear system that the schemes integrate.

use nalgebra::{DMatrix, DMatrixViewMut, Dyn, LU};

use super::periodic::PeriodicSystem;
use super::recorded::{Stage, StageCounter};
use crate::integrate::{Power, Singular, System, Weights};

/// One place of the three matrices.
#[derive(Debug, Clone, Copy)]
struct Term {
    row: usize,
    column: usize,
    mass: f64,
    damping: f64,
    stiffness: f64,
}

/// `M = ∂r/∂a`, `D = ∂r/∂v`, `K = ∂r/∂q` and `b = ∂r/∂torque` at one stage.
#[derive(Debug, Clone)]
pub(super) struct Matrices {
    at: Stage,
    /// M, D and K.
    dense: [DMatrix<f64>; 3],
    terms: Vec<Term>,
    load: Vec<f64>,
    factors: Option<(Weights, LU<f64, Dyn, Dyn>)>,
}

impl Matrices {
    pub(super) fn new(unknowns: usize) -> Self {
        let zero = DMatrix::zeros(unknowns, unknowns);
        let at = Stage { t_s: f64::NAN, ..Stage::default() };
        Self { at, dense: [zero.clone(), zero.clone(), zero], terms: Vec::new(), load: vec![0.0; unknowns], factors: None }
    }

    /// `M⁻¹ D`'s trace, or `None` if M is singular.
    #[cfg(test)]
    pub(super) fn damping_trace(&self) -> Option<f64> {
        self.dense[0].clone().lu().solve(&self.dense[1]).map(|matrix| matrix.trace())
    }

    /// Evaluates them at a stage, unless they are known there.
    pub(super) fn evaluate<S: PeriodicSystem>(&mut self, system: &mut S, stage: &Stage) {
        if self.at == *stage {
            return;
        }
        self.at.clone_from(stage);
        self.factors = None;
        let Stage { t_s, q, v, a } = stage;
        let parts = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for (matrix, [acceleration, velocity, position]) in self.dense.iter_mut().zip(parts) {
            matrix.fill(0.0);
            let w = Weights { acceleration, velocity, position };
            system.tangent(*t_s, q, v, a, w, &mut |row, column, value| matrix[(row, column)] += value);
        }
        self.set_terms();
        set_load(system, stage, &mut self.load);
    }

    fn set_terms(&mut self) {
        let [mass, damping, stiffness] = &self.dense;
        let unknowns = mass.nrows();
        self.terms.clear();
        for place in 0..unknowns * unknowns {
            let (row, column) = (place / unknowns, place % unknowns);
            let [mass, damping, stiffness] = [mass, damping, stiffness].map(|matrix| matrix[(row, column)]);
            if mass != 0.0 || damping != 0.0 || stiffness != 0.0 {
                self.terms.push(Term { row, column, mass, damping, stiffness });
            }
        }
    }

    fn factor(&mut self, w: Weights) -> Result<&LU<f64, Dyn, Dyn>, Singular> {
        let [mass, damping, stiffness] = &self.dense;
        if self.factors.as_ref().is_none_or(|(weights, _)| *weights != w) {
            let matrix = mass * w.acceleration + damping * w.velocity + stiffness * w.position;
            self.factors = Some((w, matrix.lu()));
        }
        self.factors.as_ref().map(|(_, lu)| lu).filter(|lu| lu.is_invertible()).ok_or(Singular)
    }
}

/// `r` is affine in the torque, so one difference gives its slope.
fn set_load<S: PeriodicSystem>(system: &mut S, stage: &Stage, load: &mut [f64]) {
    let Some(&mut torque_nm) = system.torque_nm() else { return };
    let Stage { t_s, q, v, a } = stage;
    let mut before = vec![0.0; load.len()];
    system.residual(*t_s, q, v, a, &mut before);
    set_torque(system, torque_nm + 1.0);
    system.residual(*t_s, q, v, a, load);
    set_torque(system, torque_nm);
    for (load, before) in load.iter_mut().zip(before) {
        *load -= before;
    }
}

/// Sets the torque where it is unknown.
pub(super) fn set_torque<S: PeriodicSystem>(system: &mut S, torque_nm: f64) {
    if let Some(torque) = system.torque_nm() {
        *torque = torque_nm;
    }
}

/// Several variations at once, one after the other in `δq`, `δv`, `δa`:
///
/// ```text
/// M δa + D δv + K δq + b δτ = 0      M, D, K, b at the stages recorded in turn
/// ```
///
/// Only the last variation has `δτ = 1`, and only where the torque is unknown.
pub(super) struct Linear<'a, S> {
    pub(super) system: &'a mut S,
    pub(super) stages: &'a [Stage],
    pub(super) matrices: &'a mut Matrices,
    /// Variations, the one by the torque included.
    pub(super) columns: usize,
    /// Whether the last variation is by the torque.
    pub(super) by_torque: bool,
    counter: StageCounter,
    /// Largest sum of magnitudes in the last residual, for each variation.
    at_work: Vec<f64>,
    weights: Weights,
    astray: bool,
}

impl<'a, S: PeriodicSystem> Linear<'a, S> {
    pub(super) fn new(system: &'a mut S, stages: &'a [Stage], matrices: &'a mut Matrices, columns: usize) -> Self {
        let by_torque = system.torque_nm().is_some();
        let at_work = vec![0.0; columns];
        let counter = StageCounter::default();
        Self { system, stages, matrices, columns, by_torque, counter, at_work, weights: Weights::MASS, astray: false }
    }

    /// Whether the scheme asked for a stage that was not recorded, and the result is meaningless.
    pub(super) fn is_astray(&self) -> bool {
        self.astray
    }
}

impl<S: PeriodicSystem> System for Linear<'_, S> {
    fn degrees_of_freedom(&self) -> usize {
        self.columns * self.matrices.load.len()
    }

    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let stage = self.counter.evaluate(t_s);
        match self.stages.get(stage).filter(|stage| stage.t_s == t_s) {
            Some(stage) => self.matrices.evaluate(self.system, stage),
            None => self.astray = true,
        }
        let n = self.matrices.load.len();
        let mut sizes = vec![0.0; n];
        for (column, at_work) in self.at_work.iter_mut().enumerate() {
            let of = column * n..(column + 1) * n;
            let (q, v, a, r) = (&q[of.clone()], &v[of.clone()], &a[of.clone()], &mut r[of]);
            r.fill(0.0);
            sizes.fill(0.0);
            if self.by_torque && column + 1 == self.columns {
                r.copy_from_slice(&self.matrices.load);
                sizes.iter_mut().zip(&*r).for_each(|(size, load)| *size = load.abs());
            }
            for term in &self.matrices.terms {
                let inertia = term.mass * a[term.column];
                let rest = [term.damping * v[term.column], term.stiffness * q[term.column]];
                r[term.row] += inertia + rest[0] + rest[1];
                sizes[term.row] += inertia.abs() + rest[0].abs() + rest[1].abs();
            }
            *at_work = sizes.iter().fold(0.0, |most: f64, size| most.max(*size));
        }
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        let n = self.matrices.load.len().max(1);
        let relative = |(r, at_work): (&[f64], &f64)| {
            let largest = r.iter().fold(0.0, |most: f64, r| most.max(r.abs()));
            if largest == 0.0 { 0.0 } else { largest / at_work }
        };
        r.chunks_exact(n).zip(&self.at_work).map(relative).fold(0.0, f64::max)
    }

    fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        self.weights = w;
        self.matrices.factor(w).map(|_| ())
    }

    /// With the matrices of the present stage, whichever the scheme factored last: so one correction solves a stage.
    fn solve(&mut self, x: &mut [f64]) {
        let (n, columns) = (self.matrices.load.len(), self.columns);
        match self.matrices.factor(self.weights) {
            Ok(lu) if lu.solve_mut(&mut DMatrixViewMut::from_slice(x, n, columns)) => (),
            _ => x.fill(f64::NAN),
        }
    }

    fn power(&mut self, t_s: f64, _: &[f64], _: &[f64], _: &[f64]) -> Power {
        self.counter.end(t_s);
        Power::default()
    }
}
