//! Verdicts on the energy balance, through resets.

use super::Simulation;
use super::error::Diverged;
use super::ledger::EnergyVerdict;

impl Simulation {
    /// Verdict of the energy balance on the epoch so far.
    pub fn energy_verdict(&self) -> EnergyVerdict {
        if self.engine.keeps_energy() { self.ledger.verdict(self.solver.balance_tolerance) } else { EnergyVerdict::NotJudged }
    }

    /// The same on all epochs: that on this one, or, unless its balance is off, that on the first whose balance was off when it was reset.
    /// Checkpoints do not hold it.
    pub fn session_verdict(&self) -> EnergyVerdict {
        match self.energy_verdict() {
            off @ EnergyVerdict::Unbalanced { .. } => off,
            verdict => self.distrusted.unwrap_or(verdict),
        }
    }

    /// Takes over the verdict on the epochs before that of another simulation of the same session.
    #[cfg(feature = "service")]
    pub(crate) fn keep_distrust_of(&mut self, other: &Simulation) {
        self.distrusted = other.distrusted;
    }

    /// Back to t = 0 with the scene's own pulses; raises the epoch.
    ///
    /// # Errors
    /// Never returned in practice: the same start was observed when the simulation was built.
    pub fn reset(&mut self) -> Result<(), Diverged> {
        let verdict = self.energy_verdict();
        if matches!(verdict, EnergyVerdict::Unbalanced { .. }) {
            self.distrusted.get_or_insert(verdict);
        }
        self.epoch += 1;
        self.begin()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{EnergyVerdict, Simulation};
    use crate::scene::SceneSource;

    /// A run that was not to be trusted was forgotten with its reset.
    #[test]
    fn regress_a_session_is_judged_by_all_its_runs() -> Result<(), Box<dyn std::error::Error>> {
        let coarse = ["solver.step_s=0.02", "solver.balance_tolerance=1e-9"].map(str::to_owned);
        let mut simulation = Simulation::new(&SceneSource::open("crank-slider", &coarse)?.scene)?;
        let is_off = |verdict| matches!(verdict, EnergyVerdict::Unbalanced { .. });
        while !is_off(simulation.energy_verdict()) {
            simulation.step()?;
        }
        let off = simulation.energy_verdict();
        assert_eq!(simulation.session_verdict(), off);
        for _ in 0..2 {
            simulation.reset()?;
            assert_eq!((simulation.energy_verdict(), simulation.session_verdict()), (EnergyVerdict::Balanced, off));
        }
        Ok(())
    }
}
