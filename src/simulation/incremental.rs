//! The thesis's incremental method, which is its own integrator.

use super::drive::DriveLaw;
use super::engine::{Engine, Ledger};
use crate::integrate::{Effort, StepError};
use crate::mechanics::{Incremental, IncrementalState, Observation};

/// The incremental model and its state.
pub(super) struct IncrementalEngine {
    model: Incremental,
    state: IncrementalState,
}

impl IncrementalEngine {
    pub(super) fn new(model: Incremental) -> Self {
        IncrementalEngine { state: model.start(), model }
    }
}

impl Engine for IncrementalEngine {
    fn reset(&mut self) {
        self.state = self.model.start();
    }

    fn step(&mut self, law: &DriveLaw, t_s: f64, h_s: f64, _energy_j: f64) -> Result<(Effort, Ledger), StepError> {
        let input = law.input(t_s);
        let mut after = self.state.clone();
        self.model.step(&input, h_s, &mut after).map_err(|_| StepError::Singular)?;
        if !after.numbers().iter().all(|number| number.is_finite()) {
            return Err(StepError::NotFinite);
        }
        let [put_in, dissipated] = self.model.work_j(&input, h_s, &self.state, &after);
        let [by_rates, _] = self.model.work_by_mean_rates_j(&input, h_s, &self.state, &after);
        self.state = after;
        let work = [put_in, dissipated, put_in.abs().max(by_rates.abs())];
        Ok((Effort { newton_iterations: 0, factorizations: 1 }, work))
    }

    fn observe(&mut self, _law: &DriveLaw, _t_s: f64, out: &mut Observation) -> Result<(), StepError> {
        self.model.observe(&self.state, out);
        Ok(())
    }

    fn save(&self, out: &mut Vec<f64>) {
        out.extend_from_slice(&self.state.numbers());
    }

    fn restore(&mut self, saved: &[f64]) -> bool {
        saved.try_into().map(|numbers| self.state = IncrementalState::from_numbers(numbers)).is_ok()
    }
}
