//! Deadlines of steps: when steps are due, their lateness, and the policy for missed deadlines.

use std::time::{Duration, Instant};

use super::step_cost::StepCost;
use super::{BURST, Ending, Stepper};
use crate::runtime::missed_deadlines::{MissReport, StepTimings, WakeUp};
use crate::runtime::output::Output;
use crate::runtime::pacer::{Overrun, Pace, Pacer, WAKE_UP_PERIOD};
use crate::runtime::realtime;
use crate::simulation::Diverged;

/// The deadlines of the steps of one wake-up.
pub(super) struct WakeUpDeadlines {
    /// Gives the deadlines as they were at the wake-up; `None` if the steps have none.
    pacer: Option<Pacer>,
    /// A step that begins later than this has missed its deadline.
    longest: Duration,
    wake_up: WakeUp,
    /// Times since the wake-up before, until the first step has begun.
    before: Option<StepTimings>,
    /// Whether a step missed its deadline.
    missed: bool,
    /// Lateness of the last step.
    late: Duration,
}
impl Stepper {
    /// Number of steps taken per wake-up.
    pub(super) fn batch(&self) -> u64 {
        match self.stepping.pace {
            Pace::Max | Pace::Lockstep => BURST,
            Pace::Factor(factor) => batch(self.simulation.step_s() / factor),
        }
    }

    /// Deadline of the next wake-up: that of the last of its steps, so that none is early.
    pub(super) fn due(&self) -> Option<Duration> {
        self.deadlines.pacer.deadline(self.session_s_in(self.batch() - 1))
    }

    /// Session time at the start of the step that comes `further` steps after the next, s.
    fn session_s_in(&self, further: u64) -> f64 {
        self.epoch_start_s + self.simulation.grid().time_s(self.simulation.step_count() + further)
    }

    /// The deadlines of the steps that are taken now.
    pub(super) fn deadlines_at(&mut self, wake_up: WakeUp) -> WakeUpDeadlines {
        let before = std::mem::replace(&mut self.deadlines.timings, StepTimings { began: wake_up, ..StepTimings::default() });
        let (pacer, longest) = match self.stepping.pace {
            Pace::Factor(factor) if !self.run.paused => {
                let longest = Duration::from_secs_f64(self.batch() as f64 * self.simulation.step_s() / factor);
                (Some(self.deadlines.pacer), longest)
            }
            _ => (None, Duration::MAX),
        };
        WakeUpDeadlines { pacer, longest, wake_up, before: Some(before), missed: false, late: Duration::ZERO }
    }

    /// Takes a step and records its lateness and cost.
    pub(super) fn step_on_time(&mut self, deadlines: &mut WakeUpDeadlines) -> Result<(), Ending> {
        let due = deadlines.pacer.and_then(|pacer| pacer.deadline(self.session_s_in(0)));
        let begun = Instant::now();
        let late = due.map(|due| begun.duration_since(self.clock).saturating_sub(due));
        if let Some((due, late)) = due.zip(late).filter(|(_, late)| *late > deadlines.longest) {
            self.note_miss(deadlines, due, late)?;
        }
        deadlines.late = late.unwrap_or_default();
        let (taken, cost) = self.take_step(begun);
        taken.map_err(Ending::Diverged)?;
        deadlines.before = None;
        late.into_iter().for_each(|late| self.statistics.lateness.record(late));
        self.statistics.step_cost.record(cost.wall);
        self.deadlines.timings.solving += cost.wall;
        self.deadlines.of_sample = due;
        self.after_step(cost.own).map_err(Ending::Diverged)
    }

    /// Takes a step, beside the spare if there is one.
    fn take_step(&mut self, begun: Instant) -> (Result<(), Diverged>, StepCost) {
        if let Some(taken) = self.step_beside_spare(begun) {
            return taken;
        }
        let taken = self.simulation.step();
        self.prolong(begun);
        let cost = begun.elapsed();
        (taken, StepCost { wall: cost, own: cost })
    }

    /// Prolongs a step, in trials.
    pub(super) fn prolong(&mut self, begun: Instant) {
        if let Some(slowdown) = &mut self.stepping.slowdown {
            slowdown.prolong(self.clock.elapsed(), begun);
        }
    }

    /// Counts a missed deadline and its cause; ends the run under [`Overrun::Stop`].
    fn note_miss(&mut self, deadlines: &mut WakeUpDeadlines, due: Duration, late: Duration) -> Result<(), Ending> {
        let WakeUpDeadlines { before, wake_up, .. } = deadlines;
        let cause = match before {
            Some(before) => before.cause(due, due + late, *wake_up),
            None => {
                let now = WakeUp { processor: realtime::processor_time(), ..*wake_up };
                self.deadlines.timings.cause(due, due + late, now)
            }
        };
        self.deadlines.timings.before = Some(cause);
        self.deadlines.overruns.missed += 1;
        deadlines.missed = true;
        let stamp = self.stamp();
        self.deadlines.misses.note(&stamp, late, cause);
        if self.stepping.overrun == Overrun::Stop { Err(Ending::Late { step: stamp.step + 1, late }) } else { Ok(()) }
    }

    /// Moves the deadlines after a miss by the lateness of the last step, if the policy asks for it.
    pub(super) fn give_up_if_late(&mut self, deadlines: &WakeUpDeadlines) {
        let moved = if deadlines.missed { Pacer::verdict(self.stepping.overrun, deadlines.late) } else { None };
        moved.into_iter().for_each(|late| self.deadlines.give_up(late));
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

    fn send_overruns(&mut self, overruns: Option<Box<MissReport>>) {
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
#[allow(clippy::unwrap_used, reason = "a test may fail")]
mod tests {
    use std::sync::mpsc::{Receiver, channel, sync_channel};

    use super::*;
    use crate::runtime::stepper::{Ports, SteppingOptions};
    use crate::runtime::{Outbox, inbox};
    use crate::scene::SceneSource;
    use crate::simulation::Simulation;

    const MS: Duration = Duration::from_millis(1);

    /// A simulator with steps of `step_s`, the first of which was due `ago`. Its clock shows the time since then.
    fn stepper(step_s: f64, pace: f64, overrun: Overrun, ago: Duration) -> (Stepper, Instant, Receiver<(usize, Output)>) {
        let keys = ["solver.model=rigid", "solver.integrator=runge-kutta", &format!("solver.step_s={step_s}")].map(str::to_owned);
        let scene = SceneSource::open("crank-slider", &keys).unwrap().scene;
        let (sender, outputs) = channel();
        let (inbox, commands) = inbox();
        let ports = Ports { commands, output: Outbox::new(sender, 0), pool: sync_channel(1).1, shared: inbox.shared() };
        let options = SteppingOptions { pace: Pace::Factor(pace), overrun, ..SteppingOptions::default() };
        let mut stepper = Stepper::new(Simulation::new(&scene).unwrap(), None, options, ports).unwrap();
        let clock = Instant::now() - ago;
        stepper.begin(clock, (0, 1));
        stepper.start(Duration::ZERO);
        (stepper, clock, outputs)
    }

    fn watch_until(clock: Instant, time: Duration) -> Duration {
        while clock.elapsed() < time {
            std::hint::spin_loop();
        }
        clock.elapsed()
    }

    /// Asserts that a time, counted to two digits, lies between two readings of an outside clock.
    fn assert_between(seconds: f64, before: Duration, after: Duration, what: &str) {
        let (low, high) = (0.99 * before.as_secs_f64(), 1.01 * after.as_secs_f64());
        assert!(low <= seconds && seconds <= high, "{what}: {seconds} s is not from {before:?} to {after:?}");
    }

    #[test]
    fn val_lateness_is_what_an_outside_clock_measures() {
        let (mut stepper, clock, _outputs) = stepper(1e-3, 1.0, Overrun::CatchUp, Duration::ZERO);
        let (mut least, mut most) = (Duration::ZERO, Duration::ZERO);
        for step in 0..20 {
            // Each step later than all before it, unless the machine makes one of these later still.
            let due = MS * step;
            let woke = watch_until(clock, due + MS / 50 * (step + 1));
            // Not when it woke, but when its solver can begin.
            let begins = watch_until(clock, woke + MS / 20);
            stepper.step(WakeUp { woke, ..WakeUp::default() });
            (least, most) = (least.max(begins - due), most.max(clock.elapsed() - due));
            let late = stepper.statistics.lateness.quantiles().unwrap();
            assert_between(late.max_s, least, most, "the latest step");
        }
        let counts = stepper.statistics.lateness.bins().unwrap().counts;
        assert_eq!(counts.iter().sum::<u64>(), 20);
    }

    #[test]
    fn val_steps_that_share_a_wake_up_are_late_against_their_own_deadlines() {
        let (mut stepper, clock, _outputs) = stepper(1e-4, 1.0, Overrun::CatchUp, Duration::ZERO);
        assert_eq!(stepper.due(), Some(MS * 4 / 10), "none is early");
        let woke = watch_until(clock, MS * 4 / 10);
        stepper.step(WakeUp { woke, ..WakeUp::default() });
        let done = clock.elapsed();
        let counts = stepper.statistics.lateness.bins().unwrap().counts;
        let late = stepper.statistics.lateness.quantiles().unwrap();
        assert_eq!(counts.iter().sum::<u64>(), 5, "each is counted");
        assert_between(late.max_s, woke, done, "the first, due at once");
        assert_between(late.p50_s, woke - MS * 2 / 10, done - MS * 2 / 10, "the third, due 0.2 ms later");
    }

    #[test]
    fn val_a_deadline_is_missed_by_more_than_a_step() {
        for (ago, missed) in [(MS * 500, false), (MS * 999, false), (MS * 1001, true), (MS * 2000, true)] {
            // A step takes a second of wall time. The first is late by `ago` or, on a busy machine, a little more.
            let (mut stepper, clock, _outputs) = stepper(1e-3, 1e-3, Overrun::Stop, ago);
            stepper.step(WakeUp { woke: clock.elapsed(), ..WakeUp::default() });
            let (ended, steps) = (stepper.run.ending.is_some(), stepper.simulation.step_count());
            assert!(ended || !missed, "late by {ago:?}");
            assert_eq!(steps, u64::from(!ended), "a step that ends the run is not taken");
            let late_enough = |ending| matches!(ending, Ending::Late { step: 1, late } if late > MS * 1000 && late >= ago);
            assert!(stepper.run.ending.is_none_or(late_enough), "late by {ago:?}");
        }
    }

    #[test]
    fn val_every_step_of_a_late_wake_up_is_a_missed_deadline() {
        let (mut stepper, clock, _outputs) = stepper(1e-4, 1.0, Overrun::Skip, MS * 100);
        stepper.step(WakeUp { woke: clock.elapsed(), ..WakeUp::default() });
        assert_eq!((stepper.deadlines.overruns.missed, stepper.deadlines.overruns.pacing_epoch), (5, 1));
        let moved = stepper.deadlines.overruns.given_up;
        assert!(moved >= MS * 100 - MS * 4 / 10, "by the lateness of the last of them: {moved:?}");
    }

    #[test]
    fn val_short_steps_are_taken_in_batches() {
        for (wall_step_s, count) in [(1.0, 1), (1e-3, 1), (5e-4, 1), (2.5e-4, 2), (1e-4, 5), (1e-5, 50), (1e-9, 64)] {
            assert_eq!(batch(wall_step_s), count, "{wall_step_s}");
        }
    }
}
