//! The energy and error fields of a status.

use super::{Status, status};
use crate::scene::Level;
use crate::simulation::{Account, EnergyLedger, EnergyVerdict};

impl Status {
    /// States the level of detail in force.
    pub fn at_level(self, level: Option<&Level>) -> Status {
        let name = level.map_or(String::new(), |level| level.name.clone());
        Status { level: name, level_error_rad: level.and_then(|level| level.error_rad), ..self }
    }

    /// Sets energies, works, verdict and estimated error.
    pub fn with_account(self, Account { ledger, verdict, error }: Account) -> Status {
        let EnergyLedger { energy, work_in_j, dissipated_j, changed_j, balance_error_j, worst_balance_j, in_play_j } = ledger;
        let verdict = match verdict {
            EnergyVerdict::Balanced => status::EnergyVerdict::Balanced,
            EnergyVerdict::Unbalanced { .. } => status::EnergyVerdict::Unbalanced,
            EnergyVerdict::NotJudged => status::EnergyVerdict::NotJudged,
        };
        Status {
            kinetic_j: Some(energy.kinetic_j),
            strain_j: energy.strain_j,
            potential_j: energy.potential_j,
            work_in_j: Some(work_in_j),
            dissipated_j: Some(dissipated_j),
            changed_j: (changed_j != 0.0).then_some(changed_j),
            balance_error_j: Some(balance_error_j),
            worst_balance_j: Some(worst_balance_j),
            energy_in_play_j: Some(in_play_j),
            energy_verdict: verdict.into(),
            estimated_angle_error_rad: error.map(|error| error.angle_rad()),
            estimated_deflection_error_m: error.map(|error| error.deflection_m()),
            ..self
        }
    }
}
