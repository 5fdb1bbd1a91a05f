//! Energy and work, counted in every step, and what they say of the steps.

use super::error::Cause;
use crate::integrate::Work;
use crate::mechanics::Energy;

/// Energy over this many times what is accounted for is divergence, and so is dissipation in one step: the quadrature of a step that a
/// damper nearly stops may overshoot what there was.
const ENERGY_FACTOR: f64 = 2.0;
/// The same where not all of the energy is known: the thesis's method drops strain in every step, and its kinetic energy alone has
/// passed twice what was put in while it followed the thesis's listing.
const KNOWN_ENERGY_FACTOR: f64 = 100.0;
/// A step whose balance moves by more than this part of the energy that there is and was put in is divergence.
const BALANCE_PART: f64 = 0.5;
/// The same of a step that itself brought most of the energy in play, as where a load begins from rest: the step's error is then of the
/// size of that energy. The work of a raised cosine grows with the sixth power of the time since its beginning, 64 times from the first
/// step to the second. Energy that grows by itself passes this too, a few steps later.
const BEGINNING_FACTOR: f64 = 100.0;
/// A step that brought more than this part of the energy in play belongs to a beginning, as where a load begins from rest. The first
/// steps err by a part of the little energy that there is, whatever their length: 2e-2 of it after a raised cosine's first steps by
/// `generalized-alpha`, of 4 ms as of 0.5 ms.
const BEGINNING_PART: f64 = 0.25;
/// Balance that is allowed to what errs in a beginning, over the energy in play, where the tolerance is less.
const BEGINNING_TOLERANCE: f64 = 5e-2;
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
    /// Energy that changes of the scene brought in, less what they took, J.
    pub changed_j: f64,
    /// Energy now − energy at the start − energy changed − work put in + work dissipated, J: what the scheme alone gained or lost.
    /// Nothing corrects it.
    pub balance_error_j: f64,
    /// Largest |balance_error_j| so far, J.
    pub worst_balance_j: f64,
    /// The energy in play, J: kinetic and strain energy at the start, what fell in gravity at most, and the magnitudes of the work
    /// put in by every step and of the energy that every change of the scene brought in or took.
    pub in_play_j: f64,
}

/// Energy that changes of the scene brought in, less what they took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ChangedEnergy {
    /// Kinetic and strain energy, J.
    pub moving_j: f64,
    /// Potential energy, J.
    pub potential_j: f64,
    /// Magnitudes of the kinetic and strain energy of every change, summed, J.
    pub magnitude_j: f64,
}

impl ChangedEnergy {
    /// All of it, J.
    pub fn total_j(&self) -> f64 {
        self.moving_j + self.potential_j
    }

    /// With one more change.
    fn with(self, before: &Energy, after: &Energy) -> Self {
        let moving_j = after.moving_j() - before.moving_j();
        ChangedEnergy {
            moving_j: self.moving_j + moving_j,
            potential_j: self.potential_j + (potential_j(after) - potential_j(before)),
            magnitude_j: self.magnitude_j + moving_j.abs(),
        }
    }
}

/// Verdict of the energy balance on a run so far.
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
    changed: ChangedEnergy,
    fallen_j: f64,
    worst_balance_j: f64,
    /// Largest |balance error| before the present beginning, J; `None` while there is none.
    settled_balance_j: Option<f64>,
    /// Energies below this are no divergence, J.
    least_j: f64,
}

/// Entries of an account that the state does not determine.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LedgerEntries {
    /// Work put in and dissipated since the epoch began.
    pub work: Work,
    /// Most that potential energy was below that at the start, J.
    pub fallen_j: f64,
    /// Largest |balance error| so far, J.
    pub worst_balance_j: f64,
    /// Largest |balance error| before the present beginning, J; `None` if the last step was not part of one.
    pub settled_balance_j: Option<f64>,
}

impl Ledger {
    /// An account that begins with these energies.
    pub(super) fn new(start: Energy) -> Self {
        Ledger { start, now: start, least_j: ENERGY_FLOOR_J, ..Ledger::default() }
    }

    /// The account in which energies up to this, J, are no divergence, if that is more than rounding.
    pub(super) fn with_least(self, least_j: f64) -> Self {
        Ledger { least_j: least_j.max(ENERGY_FLOOR_J), ..self }
    }

    /// The account with one more step; `keeps_energy` says whether the balance tells how well it was taken.
    ///
    /// # Errors
    /// The step is divergence: see [`Cause`].
    pub(super) fn after(&self, work: Work, now: Energy, keeps_energy: bool) -> Result<Ledger, Cause> {
        let mut next = Ledger { now, ..*self };
        next.work += work;
        next.fallen_j = next.fallen_j.max(potential_j(&self.start) + self.changed.potential_j - potential_j(&now));
        next.worst_balance_j = next.worst_balance_j.max(next.balance_error_j().abs());
        if !keeps_energy {
            next.judge_growth(KNOWN_ENERGY_FACTOR)?;
            return Ok(next);
        }
        let is_beginning = next.in_play_j() - self.in_play_j() > BEGINNING_PART * next.in_play_j();
        next.settled_balance_j = is_beginning.then(|| self.settled_balance_j.unwrap_or(self.worst_balance_j));
        let begins = 2.0 * self.in_play_j() < next.in_play_j();
        let [energy_factor, balance_part] = if begins { [BEGINNING_FACTOR; 2] } else { [ENERGY_FACTOR, BALANCE_PART] };
        next.judge_growth(energy_factor)?;
        next.judge_balance(self, work, energy_factor, balance_part)?;
        Ok(next)
    }

    /// Energy is not more than this many times what is accounted for.
    fn judge_growth(&self, factor: f64) -> Result<(), Cause> {
        let (energy_j, accounted_j) = (self.now.moving_j(), self.in_play_j());
        let grew = energy_j > factor * accounted_j + self.least_j;
        if grew { Err(Cause::EnergyGrew { energy_j, accounted_j, factor }) } else { Ok(()) }
    }

    /// A step does not dissipate far more than there was, nor move the balance by a large part of it.
    fn judge_balance(&self, before: &Ledger, work: Work, energy_factor: f64, balance_part: f64) -> Result<(), Cause> {
        let accounted_j = self.in_play_j();
        if work.dissipated_j > energy_factor * accounted_j + self.least_j {
            return Err(Cause::Dissipated { dissipated_j: work.dissipated_j, accounted_j });
        }
        let moved_j = self.balance_error_j() - before.balance_error_j();
        if moved_j.abs() > balance_part * accounted_j + self.least_j {
            return Err(Cause::BalanceMoved { moved_j, accounted_j });
        }
        Ok(())
    }

    /// The account where a change of the scene leaves these energies.
    pub(super) fn changed(&self, now: Energy) -> Ledger {
        Ledger { now, changed: self.changed.with(&self.now, &now), ..*self }
    }

    /// Energies at the start of the epoch, and those that changes of the scene brought in since.
    pub(super) fn start_and_changed(&self) -> (Energy, ChangedEnergy) {
        (self.start, self.changed)
    }

    fn balance_error_j(&self) -> f64 {
        self.now.total_j() - self.start.total_j() - self.changed.total_j() - self.work.put_in_j + self.work.dissipated_j
    }

    fn in_play_j(&self) -> f64 {
        self.start.moving_j() + self.fallen_j + self.work.magnitude_j + self.changed.magnitude_j
    }

    pub(super) fn energies(&self) -> EnergyLedger {
        EnergyLedger {
            energy: self.now,
            work_in_j: self.work.put_in_j,
            dissipated_j: self.work.dissipated_j,
            changed_j: self.changed.total_j(),
            balance_error_j: self.balance_error_j(),
            worst_balance_j: self.worst_balance_j,
            in_play_j: self.in_play_j(),
        }
    }

    /// Whether the balance stayed within this part of the energy in play, or, what erred in a beginning, within that of beginnings.
    pub(super) fn verdict(&self, tolerance: f64) -> EnergyVerdict {
        let (worst_j, in_play_j) = (self.worst_balance_j, self.in_play_j());
        let is_beyond = |error_j: f64, tolerance: f64| error_j > tolerance * in_play_j + ENERGY_FLOOR_J;
        let is_off = match self.settled_balance_j {
            None => is_beyond(worst_j, tolerance),
            Some(settled_j) => is_beyond(settled_j, tolerance) || is_beyond(worst_j, tolerance.max(BEGINNING_TOLERANCE)),
        };
        if is_off { EnergyVerdict::Unbalanced { worst_j, in_play_j } } else { EnergyVerdict::Balanced }
    }

    pub(super) fn entries(&self) -> LedgerEntries {
        let Ledger { work, fallen_j, worst_balance_j, settled_balance_j, .. } = *self;
        LedgerEntries { work, fallen_j, worst_balance_j, settled_balance_j }
    }

    /// The account where it stood at a checkpoint, with the energies of the state there.
    pub(super) fn at((start, changed): (Energy, ChangedEnergy), entries: &LedgerEntries, now: Energy) -> Ledger {
        let LedgerEntries { work, fallen_j, worst_balance_j, settled_balance_j } = *entries;
        Ledger { start, now, work, changed, fallen_j, worst_balance_j, settled_balance_j, least_j: ENERGY_FLOOR_J }
    }
}

fn potential_j(energy: &Energy) -> f64 {
    energy.potential_j.unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinetic(kinetic_j: f64) -> Energy {
        Energy { kinetic_j, ..Energy::default() }
    }

    fn work(put_in_j: f64, dissipated_j: f64) -> Work {
        Work { put_in_j, dissipated_j, magnitude_j: put_in_j.abs() }
    }

    /// An account that began with 10 J.
    fn ten() -> Ledger {
        Ledger::new(kinetic(10.0))
    }

    #[test]
    fn prop_a_balanced_step_is_taken_and_counted() -> Result<(), Cause> {
        let ledger = ten().after(work(3.0, 1.0), kinetic(12.0), true)?.after(work(-2.0, 0.5), kinetic(9.4), true)?;
        let energies = ledger.energies();
        assert_eq!((energies.work_in_j, energies.dissipated_j, energies.in_play_j), (1.0, 1.5, 15.0));
        assert!((energies.balance_error_j + 0.1).abs() < 1e-12 && (energies.worst_balance_j - 0.1).abs() < 1e-12, "{energies:?}");
        Ok(())
    }

    #[test]
    fn prop_energy_that_more_than_doubles_is_divergence() {
        assert!(matches!(ten().after(work(0.0, 0.0), kinetic(20.1), true), Err(Cause::EnergyGrew { .. })));
        // It is when it is put in that is not.
        assert!(ten().after(work(10.1, 0.0), kinetic(20.1), true).is_ok());
        // Of an energy that is known in part only, a hundred times.
        assert!(ten().after(work(0.0, 0.0), kinetic(999.0), false).is_ok());
        assert!(matches!(ten().after(work(0.0, 0.0), kinetic(1001.0), false), Err(Cause::EnergyGrew { .. })));
    }

    #[test]
    fn prop_a_step_that_dissipates_far_more_than_there_was_is_divergence() {
        assert!(matches!(ten().after(work(0.0, 20.1), kinetic(0.0), true), Err(Cause::Dissipated { .. })));
        // Below that, the balance tells.
        assert!(matches!(ten().after(work(0.0, 19.9), kinetic(0.0), true), Err(Cause::BalanceMoved { .. })));
        assert!(ten().after(work(0.0, 10.1), kinetic(0.0), true).is_ok());
        assert!(ten().after(work(0.0, 20.1), kinetic(0.0), false).is_ok());
    }

    #[test]
    fn regress_a_step_that_brings_most_of_the_energy_may_err_by_as_much() {
        let rest = Ledger::new(Energy::default());
        // Erring by 9 of 1 J: a load that begins. By 101, or behind the beginning, it is divergence.
        let begun = rest.after(work(1.0, 0.0), kinetic(10.0), true);
        assert!(begun.is_ok(), "{begun:?}");
        assert!(matches!(rest.after(work(1.0, 0.0), kinetic(102.0), true), Err(Cause::EnergyGrew { .. })));
        assert!(rest.after(work(1.0, 9.0), kinetic(1.0), true).is_ok());
        assert!(matches!(rest.after(work(1.0, 101.0), kinetic(1.0), true), Err(Cause::Dissipated { .. })));
        let behind =
            rest.after(work(1.0, 0.0), kinetic(1.0), true).and_then(|ledger| ledger.after(work(0.5, 0.0), kinetic(4.0), true));
        assert!(matches!(behind, Err(Cause::EnergyGrew { .. })), "{behind:?}");
    }

    #[test]
    fn prop_a_balance_that_moves_by_half_the_energy_in_one_step_is_divergence() {
        for (energy_j, moves) in [(15.1, true), (14.9, false), (5.1, false), (4.9, true)] {
            let judged = ten().after(work(0.0, 0.0), kinetic(energy_j), true);
            assert_eq!(matches!(judged, Err(Cause::BalanceMoved { .. })), moves, "{energy_j} J: {judged:?}");
        }
        // It is the step that is judged, not where the balance stands.
        let drifted =
            ten().after(work(0.0, 0.0), kinetic(5.1), true).and_then(|ledger| ledger.after(work(0.0, 0.0), kinetic(0.2), true));
        assert!(drifted.is_ok_and(|ledger| matches!(ledger.verdict(0.5), EnergyVerdict::Unbalanced { .. })));
    }

    #[test]
    fn prop_the_verdict_remembers_the_worst_balance() -> Result<(), Cause> {
        let away = ten().after(work(0.0, 0.0), kinetic(10.2), true)?;
        let back = away.after(work(0.0, 0.0), kinetic(10.0), true)?;
        assert!(
            matches!(back.verdict(1e-2), EnergyVerdict::Unbalanced { worst_j, in_play_j } if (worst_j - 0.2).abs() < 1e-12 && in_play_j == 10.0)
        );
        assert_eq!(back.verdict(3e-2), EnergyVerdict::Balanced);
        assert_eq!(ten().verdict(1e-2), EnergyVerdict::Balanced);
        Ok(())
    }

    #[test]
    fn regress_a_beginning_may_err_by_more_than_the_tolerance() -> Result<(), Cause> {
        // Verdicts after steps that put in some energy and lose some of it for good.
        let balanced = |begin: Ledger, steps: &[[f64; 2]]| {
            let mut ledger = begin;
            let mut verdicts = Vec::new();
            for [put_in_j, lost_j] in steps {
                let now = kinetic(ledger.now.kinetic_j + put_in_j - lost_j);
                ledger = ledger.after(work(*put_in_j, 0.0), now, true)?;
                verdicts.push(ledger.verdict(1e-2) == EnergyVerdict::Balanced);
            }
            Ok::<_, Cause>(verdicts)
        };
        let rest = Ledger::new(Energy::default());
        // Steps bring 1/1, 2/3 and 1/4 of the energy in play: the last is part of no beginning. 0.045 of 4 J.
        assert_eq!(balanced(rest, &[[1.0, 0.045], [2.0, 0.0], [1.0, 0.0]])?, [true, true, false]);
        // Beyond what is allowed to a beginning.
        assert_eq!(balanced(rest, &[[1.0, 0.06], [0.1, 0.0]])?, [false, false]);
        // An error from before the beginning counts as ever: 0.2 of 10, and then of 15 J.
        assert_eq!(balanced(ten(), &[[0.0, 0.2], [5.0, 0.0]])?, [false, false]);
        Ok(())
    }

    #[test]
    fn prop_what_falls_in_gravity_is_in_play() -> Result<(), Cause> {
        let at = |kinetic_j, potential_j| Energy { kinetic_j, potential_j: Some(potential_j), ..Energy::default() };
        let fallen = Ledger::new(at(0.0, 5.0)).after(work(0.0, 0.0), at(5.0, 0.0), true)?;
        assert_eq!(fallen.energies().in_play_j, 5.0);
        let risen = fallen.after(work(0.0, 0.0), at(0.0, 5.0), true)?;
        assert_eq!((risen.energies().in_play_j, risen.energies().balance_error_j), (5.0, 0.0));
        Ok(())
    }

    #[test]
    fn regress_an_account_goes_on_from_its_entries() -> Result<(), Cause> {
        // The step brought 3 of 13 J, or 30 of 40.
        for (put_in_j, is_beginning) in [(3.0, false), (30.0, true)] {
            let now = kinetic(9.3 + put_in_j);
            let before = ten().after(work(put_in_j, 1.0), now, true)?;
            let resumed = Ledger::at(ten().start_and_changed(), &before.entries(), now);
            assert_eq!((resumed, resumed.settled_balance_j.is_some()), (before, is_beginning));
        }
        Ok(())
    }

    #[test]
    fn prop_a_change_of_the_scene_is_booked_under_its_own_name() -> Result<(), Cause> {
        let at = |kinetic_j, potential_j| Energy { kinetic_j, potential_j: Some(potential_j), ..Energy::default() };
        let before = Ledger::new(at(10.0, 1.0)).after(work(3.0, 1.0), at(12.3, 1.0), true)?;
        let ledger = before.changed(at(32.3, 6.0)).changed(at(30.3, 6.0));
        let energies = ledger.energies();
        assert_eq!(energies.changed_j, 23.0);
        assert!((energies.in_play_j - (10.0 + 3.0 + 20.0 + 2.0)).abs() < 1e-13, "{energies:?}");
        // It neither opens the balance nor closes it.
        assert!((energies.balance_error_j - before.energies().balance_error_j).abs() < 1e-14);
        // Nothing has fallen because the scene changed; it has when it falls.
        let fallen = ledger.after(work(0.0, 0.0), at(34.3, 2.0), true)?.energies();
        assert!((fallen.in_play_j - (35.0 + 4.0)).abs() < 1e-13, "{fallen:?}");
        Ok(())
    }
}
