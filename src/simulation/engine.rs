//! An engine advances a model in time: model and integrator behind one interface.

use super::drive::DriveLaw;
use super::error_estimate::StepTerms;
use crate::integrate::{StepError, Taken};
use crate::mechanics::{CarriedTurn, Energy, Input, Mechanism, Observation, ROTATIONS};

/// A state of a model that is a system of second order, with its loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Torque and prescribed motion.
    pub input: Input,
    /// Coordinates, n.
    pub q: Vec<f64>,
    /// Velocities, n.
    pub v: Vec<f64>,
    /// Accelerations, n.
    pub a: Vec<f64>,
}

/// A mechanism with its coordinates, velocities and accelerations.
pub(super) struct Dynamics<'a> {
    pub mechanism: &'a mut dyn Mechanism,
    pub q: &'a mut Vec<f64>,
    pub v: &'a mut Vec<f64>,
    pub a: &'a mut Vec<f64>,
}

/// One model of one scene, advanced in steps.
pub(super) trait Engine: Send {
    /// Back to t = 0.
    fn reset(&mut self);
    /// From `t_s` to `t_s + h_s` under `law`. On error the state is unchanged.
    fn step(&mut self, law: &DriveLaw, t_s: f64, h_s: f64) -> Result<Taken, StepError>;
    /// Errors of the last step, of `h_s`, which ended at `t_s`; `None` if the method has no estimate.
    fn local_error(&mut self, law: &DriveLaw, t_s: f64, h_s: f64) -> Option<StepTerms>;
    /// Angles, rad, and rates, rad/s, after the last step, of the links that say where a rigid chain is; `None` if the chain has none.
    fn rotations(&self) -> Option<[[f64; 2]; ROTATIONS]> {
        None
    }
    /// Angle, rad, perhaps up to whole turns, and rate, rad/s, of the first link's chord after the last step, where it is free; `None` if the
    /// model does not tell.
    fn crank(&self) -> Option<[f64; 2]> {
        self.rotations().map(|[crank, _]| crank)
    }
    /// The growth of a small error of those angles and rates over `h_s` from `t_s` on.
    fn carried_turn(&self, _law: &DriveLaw, _t_s: f64, _h_s: f64, _links: [[f64; 2]; ROTATIONS]) -> Option<CarriedTurn> {
        None
    }
    /// Energies at `t_s`, where the last step ended.
    fn energy(&mut self, law: &DriveLaw, t_s: f64) -> Energy;
    /// Number of unknowns; `None` if the model has no such number.
    fn unknowns(&self) -> Option<usize> {
        None
    }
    /// The state and the loads at `t_s`, where the last step ended; `None` if the model is no system of second order, or has no finite
    /// accelerations there.
    fn motion(&mut self, _law: &DriveLaw, _t_s: f64) -> Option<Motion> {
        None
    }
    /// Whether the balance of these energies tells how well a step was taken. The thesis's method drops strain in every step.
    fn keeps_energy(&self) -> bool;
    /// The mechanism and its state, between steps; `None` if the model is no system of second order.
    fn dynamics(&mut self) -> Option<Dynamics<'_>> {
        None
    }
    /// Begins at the present coordinates and velocities, at `t_s`, in steps of `h_s`.
    fn begin(&mut self, _law: &DriveLaw, _t_s: f64, _h_s: f64) -> Result<(), StepError> {
        Ok(())
    }
    /// Begins at the present coordinates, velocities and accelerations, at `t_s`: what they leave over of the equations of motion is no
    /// jump of the load.
    fn begin_as_given(&mut self, _law: &DriveLaw, _t_s: f64) {}
    /// Fills `out` for `t_s`, where the last step ended.
    fn observe(&mut self, law: &DriveLaw, t_s: f64, out: &mut Observation) -> Result<(), StepError>;
    /// Appends everything that is carried from one step to the next.
    fn save(&self, out: &mut Vec<f64>);
    /// Goes back to what `save` gave; `false`, and nothing changed, when it does not fit this model.
    fn restore(&mut self, saved: &[f64]) -> bool;
}
