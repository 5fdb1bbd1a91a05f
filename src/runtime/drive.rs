//! The thread that steps: it waits for the next deadline, lets every simulator step that is due, and sees to commands between.

use std::sync::Once;
use std::thread;
use std::time::{Duration, Instant};

use super::approach::{Approach, approach};
use super::misses::Round;
use super::realtime;
use super::stepper::{Ended, Next, Stepper};
use super::waiting::{Spin, Spinning};

/// Longer waits can be ended by a command.
const FAR: Duration = Duration::from_millis(5);
/// How long before a deadline they end at the latest.
const NEAR: Duration = Duration::from_millis(2);

/// A command is taken in less: none is begun so shortly before a deadline.
const COMMAND: Duration = Duration::from_micros(10);

/// What is so for one stepping thread is so for all of the process, and told once.
static TOLD: Once = Once::new();

/// How a stepping thread wakes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Waking {
    /// How long it spins before a deadline.
    pub spin: Spin,
    /// Whether it asks the system for real-time scheduling and locked memory.
    pub realtime: bool,
}

/// Called with how a run ended.
pub type Finish = Box<dyn FnOnce(Ended) + Send>;

/// Steps all of them to their ends, on this thread.
pub fn drive(steppers: Vec<(Stepper, Finish)>, waking: Waking) {
    let paced = steppers.iter().any(|(stepper, _)| stepper.has_deadlines());
    let granted = (paced && waking.realtime).then(realtime::ask);
    if paced {
        ready(waking, granted.as_ref());
    }
    let mut thread = Stepping { steppers, clock: realtime::clock(), spin: Spinning::new(waking.spin), stepped: Duration::ZERO };
    thread.begin();
    while !thread.steppers.is_empty() {
        thread.go_on();
    }
}

/// Readies the thread for deadlines, and says how.
fn ready(waking: Waking, granted: Option<&realtime::Granted>) {
    realtime::exact_timers();
    if let Some(granted) = granted {
        TOLD.call_once(|| tracing::info!("stepping thread: {granted}; {}", waking.spin));
    }
}

/// The thread's state.
struct Stepping {
    steppers: Vec<(Stepper, Finish)>,
    clock: Instant,
    spin: Spinning,
    /// The deadline of the steps taken last.
    stepped: Duration,
}

impl Stepping {
    fn begin(&mut self) {
        let (clock, count) = (self.clock, self.steppers.len());
        for (index, (stepper, _)) in self.steppers.iter_mut().enumerate() {
            stepper.begin(clock, (index, count));
        }
        let now = self.clock.elapsed();
        self.steppers.iter_mut().for_each(|(stepper, _)| stepper.start(now));
        self.chores();
    }

    /// To the next deadline, or the next look at what there is to do.
    fn go_on(&mut self) {
        let next = self.steppers.iter().map(|(stepper, _)| stepper.next().at()).min().unwrap_or_default();
        let (now, spin) = (self.clock.elapsed(), self.spin.length(next.saturating_sub(self.stepped)));
        match approach(now, next, spin) {
            Approach::Sleep(time) if time > FAR => {
                thread::park_timeout(time - NEAR);
                self.chores();
            }
            Approach::Sleep(time) => {
                thread::sleep(time);
                self.spin.woke(self.clock.elapsed().saturating_sub(now + time));
                let until = next.saturating_sub(COMMAND);
                self.steppers.iter_mut().for_each(|(stepper, _)| stepper.listen(until));
                self.retire();
            }
            Approach::Watch => {
                let round = self.watch(next);
                self.step(next, round);
            }
            Approach::Due => self.step(next, Round { processor: realtime::processor_time(), woke: self.clock.elapsed() }),
        }
    }

    /// Watches the clock until `next`.
    fn watch(&self, next: Duration) -> Round {
        // To ask the system takes longer than a step is late: it is done while there is time, and what is spun is added.
        let processor = realtime::processor_time();
        let begun = self.clock.elapsed();
        loop {
            let woke = self.clock.elapsed();
            if woke >= next {
                return Round { woke, processor: processor + woke.saturating_sub(begun) };
            }
            std::hint::spin_loop();
        }
    }

    fn step(&mut self, deadline: Duration, round: Round) {
        // The look at the clock that ended the wait says when the first step begins.
        let mut now = round.woke;
        for (stepper, _) in &mut self.steppers {
            if matches!(stepper.next(), Next::Step(due) if due <= round.woke) {
                stepper.step(now, round);
                now = self.clock.elapsed();
            }
        }
        self.stepped = deadline;
        self.chores();
    }

    fn chores(&mut self) {
        let spin = self.spin.length(Duration::MAX);
        self.steppers.iter_mut().for_each(|(stepper, _)| stepper.tend(spin));
        self.retire();
    }

    /// Takes leave of those that are at their ends.
    fn retire(&mut self) {
        for (mut stepper, finish) in self.steppers.extract_if(.., |(stepper, _)| matches!(stepper.next(), Next::Over)) {
            finish(stepper.end());
        }
    }
}
