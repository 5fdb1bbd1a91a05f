//! The state of a simulation as its model knows it.

use super::{Motion, Simulation};

impl Simulation {
    /// Number of unknowns, the degrees of freedom; `None` if the model has no such number.
    pub fn unknowns(&self) -> Option<usize> {
        self.engine.unknowns()
    }

    /// The present state and loads; `None` if the model is no system of second order, or has no finite accelerations.
    pub fn motion(&mut self) -> Option<Motion> {
        let time_s = self.time_s();
        self.engine.motion(&self.law, time_s)
    }
}
