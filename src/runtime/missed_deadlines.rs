//! Missed deadlines: their number, lateness and likely cause, reported at most once a second on `overruns`.

use std::time::Duration;

use crate::simulation::Stamp;

/// Wall time between two reports.
const PERIOD: Duration = Duration::from_secs(1);
/// Missed deadlines that one report lists; further ones are only counted.
const ONE_BY_ONE: usize = 32;

/// Cause of a missed deadline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissCause {
    /// The solver took too long.
    Solver,
    /// The operating system woke or scheduled the thread too late.
    Scheduler,
    /// Commands, or sending samples, took too long.
    Queue,
    /// Other simulators on the same thread took too long.
    Neighbours,
}

/// A missed deadline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Miss {
    /// The step.
    pub step: u64,
    /// Its lateness.
    pub late: Duration,
    /// Its cause; that of the first of several late steps in a row.
    pub cause: MissCause,
}

/// Missed deadlines of one cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CauseCount {
    /// The cause.
    pub cause: MissCause,
    /// Number of misses.
    pub count: u64,
    /// Largest lateness.
    pub worst: Duration,
}

/// Missed deadlines since the last report.
#[derive(Debug, Clone, PartialEq)]
pub struct MissReport {
    /// Stamp of the last one.
    pub last: Stamp,
    /// Step of the first one.
    pub first_step: u64,
    /// Number of misses.
    pub count: u64,
    /// Largest lateness.
    pub worst: Duration,
    /// All misses, by cause.
    pub causes: Vec<CauseCount>,
    /// The first 32 misses.
    pub misses: Vec<Miss>,
    /// Total shift of the deadlines after them.
    pub given_up: Duration,
}

impl MissReport {
    fn new(stamp: &Stamp, first_step: u64) -> Self {
        let (causes, misses) = (Vec::new(), Vec::with_capacity(ONE_BY_ONE));
        let (worst, given_up) = (Duration::ZERO, Duration::ZERO);
        MissReport { last: *stamp, first_step, count: 0, worst, causes, misses, given_up }
    }
}

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
    pub before: Option<MissCause>,
}

impl StepTimings {
    /// Returns the cause of a step that was due at `due` and begins only `now`.
    pub(super) fn cause(&self, due: Duration, now: Duration, wake_up: WakeUp) -> MissCause {
        if self.ready {
            let asleep = wake_up.woke.saturating_sub(due);
            return if asleep * 2 >= now.saturating_sub(due) { MissCause::Scheduler } else { MissCause::Neighbours };
        }
        if let Some(before) = self.before {
            return before;
        }
        let passed = now.saturating_sub(self.began.woke);
        let working = wake_up.processor.saturating_sub(self.began.processor) + self.elsewhere;
        let away = passed.saturating_sub(working);
        let own = self.solving + self.sending;
        if away * 2 > passed && wake_up.processor > Duration::ZERO {
            MissCause::Scheduler
        } else if own * 2 < passed {
            MissCause::Neighbours
        } else if self.solving >= self.sending {
            MissCause::Solver
        } else {
            MissCause::Queue
        }
    }
}

/// Missed deadlines that are not reported yet.
#[derive(Debug, Default)]
pub(super) struct MissedDeadlines {
    pending: Option<Box<MissReport>>,
    next: Duration,
}

impl MissedDeadlines {
    /// Adds the next step, whose deadline was missed by `late`.
    pub(super) fn note(&mut self, stamp: &Stamp, late: Duration, cause: MissCause) {
        let step = stamp.step + 1;
        let report = self.pending.get_or_insert_with(|| Box::new(MissReport::new(stamp, step)));
        report.last = *stamp;
        report.count += 1;
        report.worst = report.worst.max(late);
        if report.misses.len() < ONE_BY_ONE {
            report.misses.push(Miss { step, late, cause });
        }
        match report.causes.iter_mut().find(|sum| sum.cause == cause) {
            Some(sum) => (sum.count, sum.worst) = (sum.count + 1, sum.worst.max(late)),
            None => report.causes.push(CauseCount { cause, count: 1, worst: late }),
        }
    }

    /// Notes that the deadlines were moved by `late` after the last miss.
    pub(super) fn given_up(&mut self, late: Duration) {
        if let Some(report) = &mut self.pending {
            report.given_up += late;
        }
    }

    /// Returns the report if there is one and a second has passed since the last.
    pub(super) fn due(&mut self, now: Duration) -> Option<Box<MissReport>> {
        if self.pending.is_none() || now < self.next {
            return None;
        }
        self.next = now + PERIOD;
        self.pending.take()
    }

    /// Returns the pending report at once, before a reset or the end of the run.
    pub(super) fn rest(&mut self) -> Option<Box<MissReport>> {
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
        assert_eq!(cause(StepTimings { ready: true, ..busy }, 20, 6), MissCause::Scheduler, "it slept on");
        assert_eq!(
            cause(StepTimings { ready: true, ..busy }, 11, 6),
            MissCause::Neighbours,
            "it woke in time, others went first"
        );
        assert_eq!(cause(StepTimings { solving: MS * 9, ..busy }, 20, 16), MissCause::Solver);
        assert_eq!(cause(StepTimings { solving: MS, sending: MS * 9, ..busy }, 20, 16), MissCause::Queue);
        assert_eq!(cause(StepTimings { solving: MS * 9, ..busy }, 20, 7), MissCause::Scheduler, "it was kept from the processor");
        let elsewhere = StepTimings { solving: MS * 9, elsewhere: MS * 8, ..busy };
        assert_eq!(cause(elsewhere, 20, 7), MissCause::Solver, "another thread computed the step");
        assert_eq!(cause(busy, 20, 16), MissCause::Neighbours);
        assert_eq!(
            cause(StepTimings { before: Some(MissCause::Queue), solving: MS * 9, ..busy }, 20, 16),
            MissCause::Queue,
            "still behind"
        );
    }

    #[test]
    fn prop_missed_deadlines_are_reported_once_a_second_and_bounded() {
        let mut misses = MissedDeadlines::default();
        let stamp = |step| Stamp { step, epoch: 0, sim_time_s: 0.0, epoch_start_s: 0.0, wall: std::time::SystemTime::UNIX_EPOCH };
        assert!(misses.due(MS).is_none());
        for step in 0..10_000 {
            let cause = if step % 2 == 0 { MissCause::Solver } else { MissCause::Scheduler };
            misses.note(&stamp(step), MS * (step as u32 + 2), cause);
        }
        misses.given_up(MS * 3);
        let report = misses.due(MS * 2).unwrap();
        assert_eq!((report.count, report.first_step, report.misses.len(), report.causes.len()), (10_000, 1, ONE_BY_ONE, 2));
        assert_eq!((report.worst, report.given_up), (MS * 10_001, MS * 3));
        assert_eq!(report.causes.iter().map(|sum| sum.count).sum::<u64>(), report.count);
        misses.note(&stamp(1), MS, MissCause::Queue);
        assert!(misses.due(MS * 1001).is_none() && misses.due(MS * 1002).is_some());
    }
}
