//! The thread that steps: it waits for the next deadline, lets every simulator step that is due, and sees to commands between.

use std::sync::Once;
use std::thread;
use std::time::{Duration, Instant};

use super::approach::{Approach, approach};
use super::missed_deadlines::WakeUp;
use super::realtime;
use super::spin::{AdaptiveSpin, Spin};
use super::stepper::{NextAction, RunSummary, Stepper};

/// Longer waits can be ended by a command.
const INTERRUPTIBLE_WAIT: Duration = Duration::from_millis(5);
/// How long before a deadline they end at the latest.
const INTERRUPTIBLE_MARGIN: Duration = Duration::from_millis(2);

/// A command is taken in less: none is begun so shortly before a deadline.
const COMMAND_TIME: Duration = Duration::from_micros(10);

/// What is so for one stepping thread is so for all of the process, and told once.
static LOGGED: Once = Once::new();

/// How a stepping thread wakes.
#[derive(Debug, Clone, Copy, Default)]
pub struct ThreadOptions {
    /// How long it spins before a deadline.
    pub spin: Spin,
    /// Whether it asks the system for real-time scheduling and locked memory.
    pub realtime: bool,
}

/// Called with how a run ended.
pub type Finish = Box<dyn FnOnce(RunSummary) + Send>;

/// Steps all of them to their ends, on this thread.
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
        last_deadline: Duration::ZERO,
    };
    thread.begin();
    while !thread.steppers.is_empty() {
        thread.wait_and_step();
    }
}

/// Readies the thread for deadlines, and says how.
fn prepare_thread(options: ThreadOptions, granted: Option<&realtime::Granted>) {
    realtime::exact_timers();
    if let Some(granted) = granted {
        LOGGED.call_once(|| tracing::info!("stepping thread: {granted}; {}", options.spin));
    }
}

/// The thread's state.
struct SteppingThread {
    steppers: Vec<(Stepper, Finish)>,
    clock: Instant,
    spin: AdaptiveSpin,
    /// The deadline of the steps taken last.
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

    /// To the next deadline, or the next look at what there is to do.
    fn wait_and_step(&mut self) {
        let next = self.steppers.iter().map(|(stepper, _)| stepper.next().at()).min().unwrap_or_default();
        let (now, spin) = (self.clock.elapsed(), self.spin.length(next.saturating_sub(self.last_deadline)));
        match approach(now, next, spin) {
            Approach::Sleep(time) if time > INTERRUPTIBLE_WAIT => {
                thread::park_timeout(time - INTERRUPTIBLE_MARGIN);
                self.do_chores();
            }
            Approach::Sleep(time) => {
                thread::sleep(time);
                self.spin.woke(self.clock.elapsed().saturating_sub(now + time));
                let until = next.saturating_sub(COMMAND_TIME);
                self.steppers.iter_mut().for_each(|(stepper, _)| stepper.take_commands_until(until));
                self.remove_finished();
            }
            Approach::Watch => {
                let wake_up = self.watch_clock(next);
                self.step(next, wake_up);
            }
            Approach::Due => self.step(next, WakeUp { processor: realtime::processor_time(), woke: self.clock.elapsed() }),
        }
    }

    /// Watches the clock until `next`.
    fn watch_clock(&self, next: Duration) -> WakeUp {
        // To ask the system takes longer than a step is late: it is done while there is time, and what is spun is added.
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
        // The look at the clock that ended the wait says when the first step begins.
        let mut now = wake_up.woke;
        for (stepper, _) in &mut self.steppers {
            if matches!(stepper.next(), NextAction::Step(due) if due <= wake_up.woke) {
                stepper.step(now, wake_up);
                now = self.clock.elapsed();
            }
        }
        self.last_deadline = deadline;
        self.do_chores();
    }

    fn do_chores(&mut self) {
        let spin = self.spin.length(Duration::MAX);
        self.steppers.iter_mut().for_each(|(stepper, _)| stepper.housekeep(spin));
        self.remove_finished();
    }

    /// Takes leave of those that are at their ends.
    fn remove_finished(&mut self) {
        for (mut stepper, finish) in self.steppers.extract_if(.., |(stepper, _)| matches!(stepper.next(), NextAction::Over)) {
            finish(stepper.end());
        }
    }
}
