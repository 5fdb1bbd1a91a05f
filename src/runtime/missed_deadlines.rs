//! Missed deadlines: their number, lateness and likely cause, reported at most once a second on `overruns`.

use std::time::Duration;

use crate::simulation::Stamp;
use crate::wire::{self, Miss, MissCause, Overruns, miss::Cause};

/// Wall time between two reports.
const PERIOD: Duration = Duration::from_secs(1);
/// Missed deadlines that one report lists; further ones are only counted.
const ONE_BY_ONE: usize = 32;

/// When the thread woke to step, and the processor time it had used until then.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct WakeUp {
    /// Wall time, on the clock of the deadlines.
    pub woke: Duration,
    /// Processor time of the thread; zero if the system does not report it.
    pub processor: Duration,
}

/// Times that one simulator spent between two deadlines.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StepTimings {
    /// When it last began to step.
    pub began: WakeUp,
    /// Whether it was ready before the next deadline.
    pub ready: bool,
    /// Wall time spent in the solver.
    pub solving: Duration,
    /// Time spent asleep while another thread computed a step on its processor, which is time of the solver.
    pub elsewhere: Duration,
    /// Wall time spent on commands and on sending samples.
    pub sending: Duration,
    /// Cause of the previous missed deadline, if the simulator is still behind.
    pub before: Option<Cause>,
}

impl StepTimings {
    /// Returns the cause of a step that was due at `due` and begins only `now`.
    pub(super) fn cause(&self, due: Duration, now: Duration, wake_up: WakeUp) -> Cause {
        if self.ready {
            let asleep = wake_up.woke.saturating_sub(due);
            return if asleep * 2 >= now.saturating_sub(due) { Cause::Scheduler } else { Cause::Neighbours };
        }
        if let Some(before) = self.before {
            return before;
        }
        let passed = now.saturating_sub(self.began.woke);
        let working = wake_up.processor.saturating_sub(self.began.processor) + self.elsewhere;
        let away = passed.saturating_sub(working);
        let own = self.solving + self.sending;
        if away * 2 > passed && wake_up.processor > Duration::ZERO {
            Cause::Scheduler
        } else if own * 2 < passed {
            Cause::Neighbours
        } else if self.solving >= self.sending {
            Cause::Solver
        } else {
            Cause::Queue
        }
    }
}

/// Missed deadlines that are not reported yet.
#[derive(Debug, Default)]
pub(super) struct MissedDeadlines {
    pending: Option<Box<Overruns>>,
    next: Duration,
}

impl MissedDeadlines {
    /// Adds the next step, whose deadline was missed by `late`.
    pub(super) fn note(&mut self, stamp: &Stamp, late: Duration, cause: Cause) {
        let step = stamp.step + 1;
        let report = self.pending.get_or_insert_with(|| {
            Box::new(Overruns { first_step: step, misses: Vec::with_capacity(ONE_BY_ONE), ..Overruns::default() })
        });
        let late_s = late.as_secs_f64();
        report.stamp = Some(wire::stamp(stamp));
        report.count += 1;
        report.worst_s = report.worst_s.max(late_s);
        if report.misses.len() < ONE_BY_ONE {
            report.misses.push(Miss { step, late_s, cause: cause.into() });
        }
        match report.causes.iter_mut().find(|sum| sum.cause() == cause) {
            Some(sum) => (sum.count, sum.worst_s) = (sum.count + 1, sum.worst_s.max(late_s)),
            None => report.causes.push(MissCause { cause: cause.into(), count: 1, worst_s: late_s }),
        }
    }

    /// Notes that the deadlines were moved by `late` after the last miss.
    pub(super) fn given_up(&mut self, late: Duration) {
        if let Some(report) = &mut self.pending {
            report.given_up_s += late.as_secs_f64();
        }
    }

    /// Returns the report if there is one and a second has passed since the last.
    pub(super) fn due(&mut self, now: Duration) -> Option<Box<Overruns>> {
        if self.pending.is_none() || now < self.next {
            return None;
        }
        self.next = now + PERIOD;
        self.pending.take()
    }

    /// Returns the pending report at once, before a reset or the end of the run.
    pub(super) fn rest(&mut self) -> Option<Box<Overruns>> {
        self.pending.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn wake_up(woke: u32, processor: u32) -> WakeUp {
        WakeUp { woke: MS * woke, processor: MS * processor }
    }

    #[test]
    fn val_causes_of_missed_deadlines_are_distinguished() {
        let cause = |timings: StepTimings, woke, processor| timings.cause(MS * 10, MS * 20, wake_up(woke, processor));
        let busy = StepTimings { began: wake_up(9, 5), ..StepTimings::default() };
        assert_eq!(cause(StepTimings { ready: true, ..busy }, 20, 6), Cause::Scheduler, "it slept on");
        assert_eq!(cause(StepTimings { ready: true, ..busy }, 11, 6), Cause::Neighbours, "it woke in time, others went first");
        assert_eq!(cause(StepTimings { solving: MS * 9, ..busy }, 20, 16), Cause::Solver);
        assert_eq!(cause(StepTimings { solving: MS, sending: MS * 9, ..busy }, 20, 16), Cause::Queue);
        assert_eq!(cause(StepTimings { solving: MS * 9, ..busy }, 20, 7), Cause::Scheduler, "it was kept from the processor");
        let elsewhere = StepTimings { solving: MS * 9, elsewhere: MS * 8, ..busy };
        assert_eq!(cause(elsewhere, 20, 7), Cause::Solver, "another thread computed the step");
        assert_eq!(cause(busy, 20, 16), Cause::Neighbours);
        assert_eq!(
            cause(StepTimings { before: Some(Cause::Queue), solving: MS * 9, ..busy }, 20, 16),
            Cause::Queue,
            "still behind"
        );
    }

    #[test]
    fn prop_missed_deadlines_are_reported_once_a_second_and_bounded() {
        let mut misses = MissedDeadlines::default();
        let stamp = |step| Stamp { step, epoch: 0, sim_time_s: 0.0, epoch_start_s: 0.0, wall: std::time::SystemTime::UNIX_EPOCH };
        assert!(misses.due(MS).is_none());
        for step in 0..10_000 {
            let cause = if step % 2 == 0 { Cause::Solver } else { Cause::Scheduler };
            misses.note(&stamp(step), MS * (step as u32 + 2), cause);
        }
        misses.given_up(MS * 3);
        let report = misses.due(MS * 2).unwrap_or_default();
        assert_eq!((report.count, report.first_step, report.misses.len(), report.causes.len()), (10_000, 1, ONE_BY_ONE, 2));
        assert_eq!((report.worst_s, report.given_up_s), (10.001, 0.003));
        assert_eq!(report.causes.iter().map(|sum| sum.count).sum::<u64>(), report.count);
        misses.note(&stamp(1), MS, Cause::Queue);
        assert!(misses.due(MS * 1001).is_none() && misses.due(MS * 1002).is_some());
    }
}
