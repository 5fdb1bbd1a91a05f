//! A trial of the next cheaper level: the run goes on at both levels, until it is known which of the two it keeps.

use super::Ladder;
use crate::simulation::Simulation;

impl Ladder {
    /// The next cheaper level, if there is one.
    pub(in crate::runtime) fn next_cheaper(&self) -> Option<usize> {
        Some(self.present + 1).filter(|level| *level < self.rungs.len())
    }

    /// Lets `running` go on at the next cheaper level, on trial. Returns the simulation of the level in force, as it stands, and the
    /// energy that the change would bring in, J; `None`, and nothing changed, if no change is possible here.
    pub(in crate::runtime) fn try_cheaper(&mut self, running: &mut Simulation) -> Option<(Box<Simulation>, f64)> {
        let to = self.next_cheaper()?;
        let mut other = self.take_spare(to)?;
        let way = self.rungs[self.present].ways.get_mut(to).and_then(Option::as_mut);
        let changed = way.and_then(|way| running.change_to(&mut other, way).ok());
        if changed.is_none() {
            self.rungs[to].spare = Some(other);
            return None;
        }
        changed.map(|changed_j| (other, changed_j))
    }

    /// Ends the trial: `running` goes on at the level in force, as `in_force`.
    pub(in crate::runtime) fn keep_level(&mut self, running: &mut Simulation, mut in_force: Box<Simulation>) {
        std::mem::swap(running, &mut in_force);
        self.put_back(self.present + 1, in_force);
    }

    /// Ends the trial: the next cheaper level is in force.
    pub(in crate::runtime) fn keep_cheaper(&mut self) {
        self.present = self.next_cheaper().unwrap_or(self.present);
    }

    /// Takes back the simulation of a level that does not run.
    pub(in crate::runtime) fn put_back(&mut self, level: usize, simulation: Box<Simulation>) {
        if let Some(rung) = self.rungs.get_mut(level) {
            rung.spare = Some(simulation);
        }
    }
}
