//! The stepping thread: it waits for the next deadline, lets every simulator that is due step, and does the housekeeping between.

use std::sync::Once;
use std::thread;
use std::time::{Duration, Instant};

use super::deadline_wait::{DeadlineWait, deadline_wait};
use super::missed_deadlines::WakeUp;
use super::realtime;
use super::spin::{AdaptiveSpin, Spin};
use super::stepper::{NextAction, RunSummary, Stepper};

/// Commands can interrupt waits that are longer than this.
const INTERRUPTIBLE_WAIT: Duration = Duration::from_millis(5);
/// An interruptible wait ends this long before the deadline.
const INTERRUPTIBLE_MARGIN: Duration = Duration::from_millis(2);

/// Upper bound for handling a command: none is begun this close to a deadline.
const COMMAND_TIME: Duration = Duration::from_micros(10);

/// The real-time settings hold for the whole process, so they are logged once.
static LOGGED: Once = Once::new();

/// Waiting and scheduling of the stepping thread.
#[derive(Debug, Clone, Copy, Default)]
pub struct ThreadOptions {
    /// Busy-waiting time before a deadline.
    pub spin: Spin,
    /// Whether to request real-time scheduling and locked memory.
    pub realtime: bool,
}

/// Called with the result of a run.
pub type Finish = Box<dyn FnOnce(RunSummary) + Send>;

/// Runs all simulators on this thread until each has ended.
pub fn run_stepping_thread(steppers: Vec<(Stepper, Finish)>, options: ThreadOptions) {
    let paced = steppers.iter().any(|(stepper, _)| stepper.has_deadlines());
    let granted = (paced && options.realtime).then(realtime::ask);
    if paced {
        prepare_thread(options, granted.as_ref());
    }
    let mut thread = SteppingThread {
        steppers,
        clock: realtime::clock(),
        spin: AdaptiveSpin::new(options.spin),
        spun: Duration::ZERO,
        last_deadline: Duration::ZERO,
    };
    thread.begin();
    while !thread.steppers.is_empty() {
        thread.wait_and_step();
    }
}

/// Prepares the thread for deadlines, and logs the settings.
fn prepare_thread(options: ThreadOptions, granted: Option<&realtime::Granted>) {
    realtime::exact_timers();
    if let Some(granted) = granted {
        LOGGED.call_once(|| tracing::info!("stepping thread: {granted}; {}", options.spin));
    }
}

/// The state of a stepping thread.
struct SteppingThread {
    steppers: Vec<(Stepper, Finish)>,
    clock: Instant,
    spin: AdaptiveSpin,
    /// The spin before the present deadline.
    spun: Duration,
    /// The deadline of the last steps.
    last_deadline: Duration,
}

impl SteppingThread {
    fn begin(&mut self) {
        let (clock, count) = (self.clock, self.steppers.len());
        for (index, (stepper, _)) in self.steppers.iter_mut().enumerate() {
            stepper.begin(clock, (index, count));
        }
        let now = self.clock.elapsed();
        self.steppers.iter_mut().for_each(|(stepper, _)| stepper.start(now));
        self.do_chores();
    }

    /// Waits for the next deadline, or for housekeeping, and does it.
    fn wait_and_step(&mut self) {
        let next = self.steppers.iter().map(|(stepper, _)| stepper.next().at()).min().unwrap_or_default();
        if self.steppers.iter().all(|(stepper, _)| matches!(stepper.next(), NextAction::Idle(_))) {
            // No step is due: a command ends the wait at once, as short as it may be.
            thread::park_timeout(next.saturating_sub(self.clock.elapsed()));
            return self.do_chores();
        }
        self.spun = self.spin.length(next.saturating_sub(self.last_deadline));
        let now = self.clock.elapsed();
        match deadline_wait(now, next, self.spun) {
            DeadlineWait::Sleep(time) if time > INTERRUPTIBLE_WAIT => {
                thread::park_timeout(time - INTERRUPTIBLE_MARGIN);
                self.do_chores();
            }
            DeadlineWait::Sleep(time) => {
                thread::sleep(time);
                self.spin.woke(self.clock.elapsed().saturating_sub(now + time));
                let until = next.saturating_sub(COMMAND_TIME);
                self.steppers.iter_mut().for_each(|(stepper, _)| stepper.take_commands_until(until));
                self.remove_finished();
            }
            DeadlineWait::Watch => {
                let wake_up = self.watch_clock(next);
                self.step(next, wake_up);
            }
            DeadlineWait::Due => self.step(next, WakeUp { processor: realtime::processor_time(), woke: self.clock.elapsed() }),
        }
    }

    /// Busy-waits until `next`.
    fn watch_clock(&self, next: Duration) -> WakeUp {
        // Reading the processor time takes longer than a step is late. It is read before the wait, and the time spun is added.
        let processor = realtime::processor_time();
        let begun = self.clock.elapsed();
        loop {
            let woke = self.clock.elapsed();
            if woke >= next {
                return WakeUp { woke, processor: processor + woke.saturating_sub(begun) };
            }
            std::hint::spin_loop();
        }
    }

    fn step(&mut self, deadline: Duration, wake_up: WakeUp) {
        for (stepper, _) in &mut self.steppers {
            if matches!(stepper.next(), NextAction::Step(due) if due <= wake_up.woke) {
                stepper.step(wake_up);
            }
        }
        self.last_deadline = deadline;
        self.do_chores();
    }

    fn do_chores(&mut self) {
        let spun = self.spun;
        self.steppers.iter_mut().for_each(|(stepper, _)| stepper.housekeep(spun));
        self.remove_finished();
    }

    /// Removes the simulators that have ended.
    fn remove_finished(&mut self) {
        for (mut stepper, finish) in self.steppers.extract_if(.., |(stepper, _)| matches!(stepper.next(), NextAction::Over)) {
            finish(stepper.end());
        }
    }
}
