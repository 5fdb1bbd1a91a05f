//! The energy and error fields of a status.

use super::{Status, status};
use crate::simulation::{EnergyLedger, EnergyVerdict, Simulation};

impl Status {
    /// Sets energies, works, verdict and estimated error from a simulation's present state.
    pub fn with_account(self, simulation: &Simulation) -> Status {
        let EnergyLedger { energy, work_in_j, dissipated_j, balance_error_j, worst_balance_j, in_play_j } = simulation.ledger();
        let error = simulation.error_estimate();
        Status {
            kinetic_j: Some(energy.kinetic_j),
            strain_j: energy.strain_j,
            potential_j: energy.potential_j,
            work_in_j: Some(work_in_j),
            dissipated_j: Some(dissipated_j),
            balance_error_j: Some(balance_error_j),
            worst_balance_j: Some(worst_balance_j),
            energy_in_play_j: Some(in_play_j),
            energy_verdict: verdict(simulation.energy_verdict()).into(),
            estimated_angle_error_rad: error.map(|error| error.angle_rad()),
            estimated_deflection_error_m: error.map(|error| error.deflection_m()),
            ..self
        }
    }
}

fn verdict(verdict: EnergyVerdict) -> status::EnergyVerdict {
    match verdict {
        EnergyVerdict::Balanced => status::EnergyVerdict::Balanced,
        EnergyVerdict::Unbalanced { .. } => status::EnergyVerdict::Unbalanced,
        EnergyVerdict::NotJudged => status::EnergyVerdict::NotJudged,
    }
}
