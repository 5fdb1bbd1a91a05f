//! Energy and work, counted in every step, and what they say of the steps.

use super::error::Cause;
use crate::integrate::Work;
use crate::mechanics::Energy;

/// Energy over this many times what is accounted for is divergence.
const ENERGY_FACTOR: f64 = 2.0;
/// The same where not all of the energy is known: the thesis's method drops strain in every step, and its kinetic energy alone has
/// passed twice what was put in while it followed the thesis's listing.
const KNOWN_ENERGY_FACTOR: f64 = 100.0;
/// A step whose balance moves by more than this part of the energy that there is and was put in is divergence.
const BALANCE_PART: f64 = 0.5;
/// Energies below this are rounding, J.
const ENERGY_FLOOR_J: f64 = 1e-9;

/// Energy and work since the epoch began.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EnergyLedger {
    /// Energies now, J.
    pub energy: Energy,
    /// Work put in by torque, motion and resistance, J.
    pub work_in_j: f64,
    /// Work dissipated, J.
    pub dissipated_j: f64,
    /// Energy now − energy at the start − work put in + work dissipated, J: what the scheme alone gained or lost. Nothing corrects it.
    pub balance_error_j: f64,
    /// Largest |balance_error_j| so far, J.
    pub worst_balance_j: f64,
    /// The energy in play, J: kinetic and strain energy at the start, what fell in gravity at most, and the magnitudes of the work
    /// put in by every step.
    pub in_play_j: f64,
}

/// What the energy balance says of a run so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EnergyVerdict {
    /// It stayed within its tolerance.
    Balanced,
    /// It left its tolerance: the motion is not to be trusted.
    Unbalanced {
        /// Largest |balance error|, J.
        worst_j: f64,
        /// The energy in play, J.
        in_play_j: f64,
    },
    /// The method does not know all of its energy.
    NotJudged,
}

/// The account of one epoch.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Ledger {
    start: Energy,
    now: Energy,
    work: Work,
    fallen_j: f64,
    worst_balance_j: f64,
}

/// What of an account is not to be had from the state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LedgerEntries {
    /// Work put in and dissipated since the epoch began.
    pub work: Work,
    /// Most that potential energy was below that at the start, J.
    pub fallen_j: f64,
    /// Largest |balance error| so far, J.
    pub worst_balance_j: f64,
}

impl Ledger {
    /// An account that begins with these energies.
    pub(super) fn new(start: Energy) -> Self {
        Ledger { start, now: start, ..Ledger::default() }
    }

    /// The account with one more step; `keeps_energy` says whether the balance tells how well it was taken.
    ///
    /// # Errors
    /// The step is divergence: see [`Cause`].
    pub(super) fn after(&self, work: Work, now: Energy, keeps_energy: bool) -> Result<Ledger, Cause> {
        let mut next = Ledger { now, ..*self };
        next.work += work;
        next.fallen_j = next.fallen_j.max(potential_j(&self.start) - potential_j(&now));
        next.worst_balance_j = next.worst_balance_j.max(next.balance_error_j().abs());
        next.judge_growth(if keeps_energy { ENERGY_FACTOR } else { KNOWN_ENERGY_FACTOR })?;
        if keeps_energy {
            next.judge_balance(self, work)?;
        }
        Ok(next)
    }

    /// Energy is not more than this many times what is accounted for.
    fn judge_growth(&self, factor: f64) -> Result<(), Cause> {
        let (energy_j, accounted_j) = (moving_j(&self.now), self.in_play_j());
        let grew = energy_j > factor * accounted_j + ENERGY_FLOOR_J;
        if grew { Err(Cause::EnergyGrew { energy_j, accounted_j, factor }) } else { Ok(()) }
    }

    /// A step dissipates no more than there was, and moves the balance by no large part of it.
    fn judge_balance(&self, before: &Ledger, work: Work) -> Result<(), Cause> {
        let accounted_j = self.in_play_j();
        if work.dissipated_j > accounted_j + ENERGY_FLOOR_J {
            return Err(Cause::Dissipated { dissipated_j: work.dissipated_j, accounted_j });
        }
        let moved_j = self.balance_error_j() - before.balance_error_j();
        if moved_j.abs() > BALANCE_PART * accounted_j + ENERGY_FLOOR_J {
            return Err(Cause::BalanceMoved { moved_j, accounted_j });
        }
        Ok(())
    }

    fn balance_error_j(&self) -> f64 {
        self.now.total_j() - self.start.total_j() - self.work.put_in_j + self.work.dissipated_j
    }

    fn in_play_j(&self) -> f64 {
        moving_j(&self.start) + self.fallen_j + self.work.magnitude_j
    }

    pub(super) fn energies(&self) -> EnergyLedger {
        EnergyLedger {
            energy: self.now,
            work_in_j: self.work.put_in_j,
            dissipated_j: self.work.dissipated_j,
            balance_error_j: self.balance_error_j(),
            worst_balance_j: self.worst_balance_j,
            in_play_j: self.in_play_j(),
        }
    }

    /// Whether the balance stayed within this part of the energy in play.
    pub(super) fn verdict(&self, tolerance: f64) -> EnergyVerdict {
        let (worst_j, in_play_j) = (self.worst_balance_j, self.in_play_j());
        if worst_j > tolerance * in_play_j + ENERGY_FLOOR_J {
            EnergyVerdict::Unbalanced { worst_j, in_play_j }
        } else {
            EnergyVerdict::Balanced
        }
    }

    pub(super) fn entries(&self) -> LedgerEntries {
        LedgerEntries { work: self.work, fallen_j: self.fallen_j, worst_balance_j: self.worst_balance_j }
    }

    /// The account of the same epoch where it stood at a checkpoint, with the energies of the state there.
    pub(super) fn at(&self, entries: &LedgerEntries, now: Energy) -> Ledger {
        let LedgerEntries { work, fallen_j, worst_balance_j } = *entries;
        Ledger { start: self.start, now, work, fallen_j, worst_balance_j }
    }
}

fn moving_j(energy: &Energy) -> f64 {
    energy.kinetic_j + energy.strain_j.unwrap_or(0.0)
}

fn potential_j(energy: &Energy) -> f64 {
    energy.potential_j.unwrap_or(0.0)
}
