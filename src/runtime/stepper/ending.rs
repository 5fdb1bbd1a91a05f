//! The end of a run.

use std::time::Duration;

use crate::simulation::{Diverged, EnergyVerdict, PassedLoad};

/// The end of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The simulation reached `until_s`.
    Finished,
    /// A command, a signal or a lost receiver stopped the run.
    Stopped,
    /// The simulation diverged.
    Diverged(Diverged),
    /// A step missed its deadline under [`Overrun::Stop`](crate::runtime::Overrun::Stop).
    Late {
        /// The step that missed its deadline.
        step: u64,
        /// The lateness.
        late: Duration,
    },
}

/// The result of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSummary {
    /// The end of the run.
    pub ending: Ending,
    /// Number of dropped samples.
    pub dropped: u64,
    /// Verdict on the energy balance of all epochs.
    pub verdict: EnergyVerdict,
    /// Steps of fixed cost that left more than the scene's tolerance.
    pub unconverged: u64,
    /// Largest published slope of a link from its chord that exceeded the model's range, rad; 0 if none did.
    pub worst_out_of_range: f64,
    /// The load that a crank under a torque passed in the fewest steps, if in few.
    pub passed_load: Option<PassedLoad>,
}
