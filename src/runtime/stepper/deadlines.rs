//! Deadlines of steps: when steps are due, their lateness, and the policy for missed deadlines.

use std::time::Duration;

use super::{BURST, Ending, NextAction, Stepper};
use crate::runtime::missed_deadlines::{StepTimings, WakeUp};
use crate::runtime::output::Output;
use crate::runtime::pacer::{Overrun, Pace, Pacer, WAKE_UP_PERIOD};
use crate::wire::Overruns;

impl Stepper {
    /// Number of steps taken per wake-up.
    pub(super) fn batch(&self) -> u64 {
        match self.stepping.pace {
            Pace::Max => BURST,
            Pace::Factor(factor) => batch(self.simulation.step_s() / factor),
        }
    }

    /// Deadline of the next wake-up: the start of the last of its steps, so that none is early.
    pub(super) fn due(&self) -> Option<Duration> {
        let last = self.simulation.step_count() + self.batch() - 1;
        self.deadlines.pacer.deadline(self.epoch_start_s + last as f64 * self.simulation.step_s())
    }

    /// Records the lateness of `count` steps that begin `now`, and applies the policy for missed deadlines.
    pub(super) fn account_lateness(&mut self, now: Duration, wake_up: WakeUp, count: u64) -> Result<(), Ending> {
        let (Pace::Factor(factor), NextAction::Step(due), false) = (self.stepping.pace, self.next, self.run.paused) else {
            return Ok(());
        };
        let late = now.saturating_sub(due);
        self.statistics.lateness.record(late);
        let period = Duration::from_secs_f64(count as f64 * self.simulation.step_s() / factor);
        let mut timings = StepTimings { began: wake_up, ..StepTimings::default() };
        if late > period {
            let cause = self.deadlines.timings.cause(due, now, wake_up);
            timings.before = Some(cause);
            self.deadlines.overruns.missed += count;
            let stamp = self.stamp();
            self.deadlines.misses.note(&stamp, count, late, cause);
            if self.stepping.overrun == Overrun::Stop {
                return Err(Ending::Late { step: stamp.step + 1, late });
            }
            if let Some(late) = Pacer::verdict(self.stepping.overrun, late) {
                self.deadlines.give_up(late);
            }
        }
        self.deadlines.timings = timings;
        Ok(())
    }

    /// Reports missed deadlines if a second has passed since the last report.
    pub(super) fn report_overruns_if_due(&mut self, now: Duration) {
        let overruns = self.deadlines.misses.due(now);
        self.send_overruns(overruns);
    }

    /// Reports missed deadlines at once.
    pub(super) fn report_overruns(&mut self) {
        let overruns = self.deadlines.misses.rest();
        self.send_overruns(overruns);
    }

    fn send_overruns(&mut self, overruns: Option<Box<Overruns>>) {
        if let Some(overruns) = overruns {
            let stamp = self.stamp();
            self.send(Output::Overruns(overruns, stamp));
        }
    }
}

fn batch(wall_step_s: f64) -> u64 {
    // The small margin keeps rounding from losing a step.
    ((WAKE_UP_PERIOD.as_secs_f64() / wall_step_s * (1.0 + 1e-9)) as u64).clamp(1, BURST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_short_steps_are_taken_in_batches() {
        for (wall_step_s, count) in [(1.0, 1), (1e-3, 1), (5e-4, 1), (2.5e-4, 2), (1e-4, 5), (1e-5, 50), (1e-9, 64)] {
            assert_eq!(batch(wall_step_s), count, "{wall_step_s}");
        }
    }
}
