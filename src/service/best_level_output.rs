//! The output of the shadow at the best level.

use std::time::{Duration, Instant};

use prost::Message as _;

use super::output_worker::OutputWorker;
use crate::runtime::{ModelDifference, Output};
use crate::simulation::Stamp;
use crate::wire::{self, Topic};

impl OutputWorker {
    /// Lets the shadow at the best level follow, if there is one, and publishes the differences that it has found.
    pub(super) fn follow_at_best_level(&mut self, output: &Output) {
        let step_s = self.in_force.scene.source.scene.solver.step_s;
        let Some(thread) = &mut self.beside.best_level else { return };
        thread.take(output, step_s);
        while let Some((difference, stamp)) = self.beside.best_level.as_mut().and_then(|thread| thread.next(Duration::ZERO)) {
            self.send_difference(&difference, &stamp);
        }
    }

    /// Publishes the last differences, at the end of the run: those that are found within `patience`.
    pub(super) fn finish_best_level(&mut self, patience: Duration) {
        let until = Instant::now() + patience;
        let Some(thread) = &mut self.beside.best_level else { return };
        thread.end();
        let mut next = || {
            let thread = self.beside.best_level.as_mut()?;
            thread.next(until.saturating_duration_since(Instant::now()))
        };
        let rest: Vec<(ModelDifference, Stamp)> = std::iter::from_fn(&mut next).collect();
        rest.iter().for_each(|(difference, stamp)| self.send_difference(difference, stamp));
    }

    /// Publishes a difference: after the messages that are there already, with the stamp of the state that it is of.
    fn send_difference(&mut self, difference: &ModelDifference, stamp: &Stamp) {
        let now = self.last_stamp.unwrap_or(*stamp);
        self.send(Topic::Shadow, &now, || wire::shadow(difference, stamp).encode_to_vec());
    }
}
