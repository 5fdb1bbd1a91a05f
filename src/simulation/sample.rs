//! One sample of a running simulation, ready to be sent.

use std::time::SystemTime;

use super::error_estimate::ErrorEstimate;
use super::ledger::{EnergyLedger, EnergyVerdict};
use super::{Diverged, Simulation};
use crate::mechanics::Observation;

/// When a sample was true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamp {
    /// Steps since the epoch began.
    pub step: u64,
    /// Resets so far.
    pub epoch: u64,
    /// Simulated time since the epoch began, s.
    pub sim_time_s: f64,
    /// Simulated time of the session at which the epoch began, s.
    pub epoch_start_s: f64,
    /// Wall clock.
    pub wall: SystemTime,
}

impl Stamp {
    /// Simulated time since the session began, through all resets, s.
    pub fn session_s(&self) -> f64 {
        self.epoch_start_s + self.sim_time_s
    }
}

/// State of the mechanism at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Step, epoch and times of the sample.
    pub stamp: Stamp,
    /// Mean driving torque since the sample before, N·m; of a prescribed motion, the torque it needs now.
    pub driving_torque_nm: f64,
    /// The model's observation.
    pub observation: Observation,
    /// Energies and works.
    pub ledger: EnergyLedger,
}

/// Energies, works and estimated error of a simulation's present state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Account {
    /// Energies and works.
    pub ledger: EnergyLedger,
    /// Verdict of the energy balance on the epoch so far.
    pub verdict: EnergyVerdict,
    /// Estimated error; `None` if the method has no estimate.
    pub error: Option<ErrorEstimate>,
}

impl Simulation {
    /// The stamp of the present instant, in an epoch that began at `epoch_start_s`.
    pub fn stamp(&self, epoch_start_s: f64, wall: SystemTime) -> Stamp {
        Stamp { step: self.step, epoch: self.epoch, sim_time_s: self.time_s(), epoch_start_s, wall }
    }

    /// A sample with room for an observation, to be filled by [`Simulation::sample`].
    pub fn blank_sample(&self) -> Sample {
        let stamp = self.stamp(0.0, SystemTime::UNIX_EPOCH);
        Sample { stamp, driving_torque_nm: 0.0, observation: self.observation().clone(), ledger: self.ledger() }
    }

    /// Fills a sample with the present state, except for the driving torque.
    ///
    /// # Errors
    /// As of [`Simulation::observe`].
    pub fn sample(&mut self, sample: &mut Sample, stamp: Stamp) -> Result<(), Diverged> {
        sample.observation.clone_from(self.observe()?);
        (sample.stamp, sample.ledger) = (stamp, self.ledger());
        Ok(())
    }
}
