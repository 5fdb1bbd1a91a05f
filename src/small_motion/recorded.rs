//! Records the states at which a scheme evaluates a system during one step.

use crate::integrate::{Power, Singular, System, Weights};

/// A state at which equations are linearised.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Stage {
    pub(super) t_s: f64,
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) a: Vec<f64>,
}

impl Stage {
    pub(super) fn set(&mut self, t_s: f64, [q, v, a]: [&[f64]; 3]) {
        self.t_s = t_s;
        for (vector, x) in [(&mut self.q, q), (&mut self.v, v), (&mut self.a, a)] {
            vector.clear();
            vector.extend_from_slice(x);
        }
    }
}

/// Numbers the stages of a step by the calls that the scheme makes: the same calls give the same numbers.
///
/// Evaluations at one time are one stage, a Newton iteration. A call of `power` ends it: then the stage is solved.
/// Runge–Kutta has two stages at one time; `power` separates them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StageCounter {
    started: usize,
    open_at_s: Option<f64>,
}

impl StageCounter {
    /// The stage that a residual at `t_s` belongs to.
    pub(super) fn evaluate(&mut self, t_s: f64) -> usize {
        if self.open_at_s != Some(t_s) {
            self.started += 1;
        }
        self.open_at_s = Some(t_s);
        self.started - 1
    }

    /// The stage that ends with the power at `t_s`.
    pub(super) fn end(&mut self, t_s: f64) -> usize {
        let stage = self.evaluate(t_s);
        self.open_at_s = None;
        stage
    }
}

/// A system that records its stages as a scheme evaluates it.
pub(super) struct Recorded<'a, S> {
    system: &'a mut S,
    stages: &'a mut Vec<Stage>,
    counter: StageCounter,
}

impl<'a, S: System> Recorded<'a, S> {
    /// Records into `stages` from the first on.
    pub(super) fn new(system: &'a mut S, stages: &'a mut Vec<Stage>) -> Self {
        Self { system, stages, counter: StageCounter::default() }
    }

    fn record(&mut self, stage: usize, t_s: f64, state: [&[f64]; 3]) {
        if stage >= self.stages.len() {
            self.stages.push(Stage::default());
        }
        self.stages[stage].set(t_s, state);
    }
}

impl<S: System> System for Recorded<'_, S> {
    fn degrees_of_freedom(&self) -> usize {
        self.system.degrees_of_freedom()
    }
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let stage = self.counter.evaluate(t_s);
        self.record(stage, t_s, [q, v, a]);
        self.system.residual(t_s, q, v, a, r);
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        self.system.residual_size(r)
    }
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.system.factor(t_s, q, v, a, w)
    }
    fn solve(&mut self, x: &mut [f64]) {
        self.system.solve(x);
    }
    fn power(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64]) -> Power {
        let stage = self.counter.end(t_s);
        self.record(stage, t_s, [q, v, a]);
        Power::default()
    }
}
