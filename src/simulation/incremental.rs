//! The thesis's incremental method, which is its own integrator.

use super::drive::DriveLaw;
use super::engine::Engine;
use super::error_estimate::StepTerms;
use crate::integrate::{Effort, StepError, Taken, Work};
use crate::mechanics::{Energy, Incremental, IncrementalState, Observation};

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

    fn step(&mut self, law: &DriveLaw, t_s: f64, h_s: f64) -> Result<Taken, StepError> {
        let input = law.input(t_s);
        let mut after = self.state.clone();
        self.model.step(&input, h_s, &mut after).map_err(|_| StepError::Singular)?;
        if !after.numbers().iter().all(|number| number.is_finite()) {
            return Err(StepError::NotFinite);
        }
        let [put_in_j, dissipated_j] = self.model.work_j(&input, h_s, &self.state, &after);
        let [by_rates, _] = self.model.work_by_mean_rates_j(&input, h_s, &self.state, &after);
        self.state = after;
        let work = Work { put_in_j, dissipated_j, magnitude_j: put_in_j.abs().max(by_rates.abs()) };
        Ok(Taken { effort: Effort { factorizations: 1, ..Effort::default() }, work, left_over: 0.0 })
    }

    fn local_error(&mut self, _law: &DriveLaw, _t_s: f64, _h_s: f64) -> Option<StepTerms> {
        None
    }

    fn energy(&mut self, _law: &DriveLaw, _t_s: f64) -> Energy {
        self.model.energy(&self.state)
    }

    fn keeps_energy(&self) -> bool {
        false
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
