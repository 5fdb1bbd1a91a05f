//! What advances a model in time: a model and its integrator behind one interface.

use super::drive::DriveLaw;
use crate::integrate::{Effort, StepError};
use crate::mechanics::Observation;

/// A step's works, J: `[put in, dissipated, put in at most]`. The last is the larger of the magnitudes of the first reckoned by
/// the way travelled and by the mean of the rates: they differ where a scheme lets the way lag behind the rates (ϑ = 0 from rest
/// has gained energy before it has moved).
pub(super) type Ledger = [f64; 3];

/// One model of one scene, advanced in steps.
pub(super) trait Engine: Send {
    /// Back to t = 0.
    fn reset(&mut self);
    /// From `t_s`, where there is `energy_j` by the ledger, to `t_s + h_s` under `law`; returns the effort and the work. On error the
    /// state is unchanged.
    fn step(&mut self, law: &DriveLaw, t_s: f64, h_s: f64, energy_j: f64) -> Result<(Effort, Ledger), StepError>;
    /// Fills `out` for `t_s`, where the last step ended.
    fn observe(&mut self, law: &DriveLaw, t_s: f64, out: &mut Observation) -> Result<(), StepError>;
    /// Appends everything that is carried from one step to the next.
    fn save(&self, out: &mut Vec<f64>);
    /// Takes back what `save` gave; `false`, and nothing changed, when it does not fit this model.
    fn restore(&mut self, saved: &[f64]) -> bool;
}
