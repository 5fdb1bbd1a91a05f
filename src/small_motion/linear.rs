//! The variational equations along recorded stages, as a linear system that the schemes integrate.

use nalgebra::DMatrix;

use super::factors::Factors;
use super::periodic::PeriodicSystem;
use super::recorded::{Stage, StageCounter};
use crate::integrate::{Power, Singular, System, Weights};

/// A matrix, and its entries that are not 0 as `(row, column, value)`.
#[derive(Debug, Clone)]
struct Sparse {
    dense: DMatrix<f64>,
    entries: Vec<(usize, usize, f64)>,
    largest: f64,
}

impl Sparse {
    fn zeros(unknowns: usize) -> Self {
        Self { dense: DMatrix::zeros(unknowns, unknowns), entries: Vec::new(), largest: 0.0 }
    }

    /// Collects the entries of `dense`, row by row.
    fn collect(&mut self) {
        let unknowns = self.dense.nrows();
        self.entries.clear();
        for place in 0..unknowns * unknowns {
            let (row, column) = (place / unknowns, place % unknowns);
            let value = self.dense[(row, column)];
            if value != 0.0 {
                self.entries.push((row, column, value));
            }
        }
        self.largest = self.entries.iter().fold(0.0, |most: f64, (_, _, value)| most.max(value.abs()));
    }

    /// Adds its product with the rows of `x`, of `columns` each, to those of `r`.
    fn add_product(&self, x: &[f64], columns: usize, r: &mut [f64]) {
        for (row, column, value) in &self.entries {
            let (x, r) = (&x[column * columns..][..columns], &mut r[row * columns..][..columns]);
            r.iter_mut().zip(x).for_each(|(r, x)| *r += value * x);
        }
    }
}

/// `M = ∂r/∂a`, `D = ∂r/∂v`, `K = ∂r/∂q` and `b = ∂r/∂torque` at one stage.
#[derive(Debug, Clone)]
pub(super) struct Matrices {
    at: Stage,
    /// M, D and K.
    parts: [Sparse; 3],
    load: Vec<f64>,
    factors: Option<(Weights, Factors)>,
}

impl Matrices {
    pub(super) fn new(unknowns: usize) -> Self {
        let zero = Sparse::zeros(unknowns);
        let at = Stage { t_s: f64::NAN, ..Stage::default() };
        Self { at, parts: [zero.clone(), zero.clone(), zero], load: vec![0.0; unknowns], factors: None }
    }

    /// `M⁻¹ D`'s trace, or `None` if M is singular.
    #[cfg(test)]
    pub(super) fn damping_trace(&self) -> Option<f64> {
        self.parts[0].dense.clone().lu().solve(&self.parts[1].dense).map(|matrix| matrix.trace())
    }

    /// Evaluates them at a stage, unless they are known there.
    pub(super) fn evaluate<S: PeriodicSystem>(&mut self, system: &mut S, stage: &Stage) {
        if self.at == *stage {
            return;
        }
        self.at.clone_from(stage);
        self.factors = None;
        let Stage { t_s, q, v, a } = stage;
        let weights = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for (part, [acceleration, velocity, position]) in self.parts.iter_mut().zip(weights) {
            part.dense.fill(0.0);
            let w = Weights { acceleration, velocity, position };
            system.tangent(*t_s, q, v, a, w, &mut |row, column, value| part.dense[(row, column)] += value);
            part.collect();
        }
        set_load(system, stage, &mut self.load);
    }

    fn factor(&mut self, w: Weights) -> Result<&Factors, Singular> {
        let [mass, damping, stiffness] = self.parts.each_ref().map(|part| &part.dense);
        if self.factors.as_ref().is_none_or(|(weights, _)| *weights != w) {
            let matrix = mass * w.acceleration + damping * w.velocity + stiffness * w.position;
            self.factors = Some((w, Factors::new(matrix)?));
        }
        self.factors.as_ref().map(|(_, factors)| factors).ok_or(Singular)
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

/// Several variations at once:
///
/// ```text
/// M δa + D δv + K δq + b δτ = 0      M, D, K, b at the stages recorded in turn
/// ```
///
/// `δq`, `δv` and `δa` hold the first component of every variation, then the second of every one, and so on.
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
    /// Bound of every term of the last residual, for each variation.
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
        let (columns, last) = (self.columns, self.columns.saturating_sub(1));
        r.fill(0.0);
        self.at_work.fill(0.0);
        if self.by_torque {
            for (row, load) in r.chunks_exact_mut(columns).zip(&self.matrices.load) {
                row[last] = *load;
                self.at_work[last] = self.at_work[last].max(load.abs());
            }
        }
        for (part, x) in self.matrices.parts.iter().zip([a, v, q]) {
            part.add_product(x, columns, r);
            for row in x.chunks_exact(columns.max(1)) {
                self.at_work.iter_mut().zip(row).for_each(|(at_work, x)| *at_work = at_work.max(part.largest * x.abs()));
            }
        }
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        let rows = r.chunks_exact(self.columns.max(1));
        let relative = |(r, at_work): (&f64, &f64)| if *r == 0.0 { 0.0 } else { r.abs() / at_work };
        rows.flat_map(|row| row.iter().zip(&self.at_work).map(relative)).fold(0.0, f64::max)
    }

    fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        self.weights = w;
        self.matrices.factor(w).map(|_| ())
    }

    /// With the matrices of the present stage, whichever the scheme factored last: so one correction solves a stage.
    fn solve(&mut self, x: &mut [f64]) {
        match self.matrices.factor(self.weights) {
            Ok(factors) => factors.solve(x, self.columns),
            Err(Singular) => x.fill(f64::NAN),
        }
    }

    fn power(&mut self, t_s: f64, _: &[f64], _: &[f64], _: &[f64]) -> Power {
        self.counter.end(t_s);
        Power::default()
    }
}
