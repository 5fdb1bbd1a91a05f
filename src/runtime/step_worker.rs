//! A thread that takes one step at a time of a simulation that is handed over to it. Its owner need not wait for the end of the step.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use super::realtime;
use crate::simulation::{Diverged, Simulation};

/// Takes a step of a simulation; times of loads are on the clock of the deadlines, which is given.
pub(super) type TakeStep = Box<dyn FnMut(&mut Simulation, Instant) -> Result<(), Diverged> + Send>;

/// A step that the worker has taken.
pub(super) struct TakenStep {
    pub simulation: Box<Simulation>,
    pub taken: Result<(), Diverged>,
    /// Processor time that the solver needed; wall time if the system does not report it.
    pub cost: Duration,
}

/// The place at which the simulation changes hands.
enum Slot {
    /// The worker waits, or computes a step.
    Empty,
    ToTake(Box<Simulation>, Instant),
    Taken(TakenStep),
    /// One of the threads has ended.
    Closed,
}

struct Exchange {
    slot: Mutex<Slot>,
    changed: Condvar,
}

impl Exchange {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn put(&self, slot: Slot) {
        *self.lock() = slot;
        self.changed.notify_one();
    }

    /// Puts a taken step down, unless its owner has gone.
    fn put_taken(&self, step: TakenStep) {
        let mut slot = self.lock();
        if !matches!(*slot, Slot::Closed) {
            *slot = Slot::Taken(step);
            self.changed.notify_one();
        }
    }

    /// Waits for a step to take. Returns `None` if none will come.
    fn next(&self) -> Option<(Box<Simulation>, Instant)> {
        let mut slot = self.lock();
        loop {
            match std::mem::replace(&mut *slot, Slot::Empty) {
                Slot::ToTake(simulation, clock) => return Some((simulation, clock)),
                Slot::Closed => return None,
                other => *slot = other,
            }
            slot = self.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Returns the step if it is taken.
    fn taken(slot: &mut Slot) -> Option<TakenStep> {
        match std::mem::replace(slot, Slot::Empty) {
            Slot::Taken(step) => Some(step),
            other => {
                *slot = other;
                None
            }
        }
    }
}

/// Closes the exchange when the worker's thread ends, even by a panic, so that nobody waits for it.
struct CloseAtEnd(Arc<Exchange>);

impl Drop for CloseAtEnd {
    fn drop(&mut self) {
        self.0.put(Slot::Closed);
    }
}

/// Processor time of this thread since it was read; wall time if the system does not report it.
fn cost_since((begun, processor): (Instant, Duration)) -> Duration {
    match realtime::processor_time().checked_sub(processor) {
        Some(cost) if !cost.is_zero() => cost,
        _ => begun.elapsed(),
    }
}

/// The thread, and the exchange with it. Dropping this waits for the end of the step under way.
pub(super) struct StepWorker {
    exchange: Arc<Exchange>,
    thread: Option<JoinHandle<()>>,
}

impl StepWorker {
    /// Starts the thread. It inherits the scheduling of the calling thread, and gives way to it.
    pub(super) fn start(mut take: TakeStep) -> std::io::Result<Self> {
        let exchange = Arc::new(Exchange { slot: Mutex::new(Slot::Empty), changed: Condvar::new() });
        let close = CloseAtEnd(Arc::clone(&exchange));
        let work = move || {
            let CloseAtEnd(exchange) = &close;
            realtime::give_way();
            while let Some((mut simulation, clock)) = exchange.next() {
                let begun = (Instant::now(), realtime::processor_time());
                let taken = take(&mut simulation, clock);
                exchange.put_taken(TakenStep { simulation, taken, cost: cost_since(begun) });
            }
        };
        let thread = Builder::new().name("step worker".to_owned()).spawn(work)?;
        Ok(StepWorker { exchange, thread: Some(thread) })
    }

    /// Lets the worker take a step. It must have returned the simulation of the step before.
    pub(super) fn hand_over(&mut self, simulation: Box<Simulation>, clock: Instant) {
        self.exchange.put(Slot::ToTake(simulation, clock));
    }

    /// Returns the step if it is taken.
    pub(super) fn taken(&mut self) -> Option<TakenStep> {
        self.wait(Some(Instant::now()))
    }

    /// Waits for the step, at most until the given instant. Returns `None` if it is not taken by then. A panic of the worker goes on
    /// in the caller.
    pub(super) fn wait(&mut self, until: Option<Instant>) -> Option<TakenStep> {
        let taken = self.wait_for_change(until);
        let died = if taken.is_none() && self.is_closed() { self.thread.take() } else { None };
        if let Some(Err(panic)) = died.map(JoinHandle::join) {
            std::panic::resume_unwind(panic);
        }
        taken
    }

    fn wait_for_change(&self, until: Option<Instant>) -> Option<TakenStep> {
        let mut slot = self.exchange.lock();
        loop {
            if !matches!(*slot, Slot::Empty | Slot::ToTake(..)) {
                return Exchange::taken(&mut slot);
            }
            let Some(until) = until else {
                slot = self.exchange.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            slot = self.exchange.changed.wait_timeout(slot, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn is_closed(&self) -> bool {
        matches!(*self.exchange.lock(), Slot::Closed)
    }

    /// Whether a taken step waits to be fetched, or never will be.
    pub(super) fn is_done(&self) -> bool {
        matches!(*self.exchange.lock(), Slot::Taken(_) | Slot::Closed)
    }
}

impl Drop for StepWorker {
    fn drop(&mut self) {
        self.exchange.put(Slot::Closed);
        // A panic of the worker was reported when it happened.
        self.thread.take().map(JoinHandle::join);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::mpsc::channel;

    use super::*;
    use crate::scene::SceneSource;

    fn simulation() -> Box<Simulation> {
        Box::new(Simulation::new(&SceneSource::open("crank-slider", &[]).unwrap().scene).unwrap())
    }

    #[test]
    fn val_a_step_is_fetched_when_it_is_taken_and_not_before() {
        let (permit, permits) = channel();
        let take = move |simulation: &mut Simulation, _: Instant| {
            permits.recv().unwrap();
            simulation.step()
        };
        let mut worker = StepWorker::start(Box::new(take)).unwrap();
        for step in 1..=3 {
            worker.hand_over(simulation(), Instant::now());
            assert!(worker.taken().is_none() && !worker.is_done());
            assert!(worker.wait(Some(Instant::now() + Duration::from_millis(1))).is_none());
            permit.send(()).unwrap();
            let taken = worker.wait(None).unwrap();
            assert_eq!((taken.taken, taken.simulation.step_count()), (Ok(()), 1), "step {step}");
        }
        // A step under way keeps nobody from the end.
        worker.hand_over(simulation(), Instant::now());
        permit.send(()).unwrap();
        drop(worker);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn val_a_step_that_is_kept_from_its_processor_costs_nothing_meanwhile() {
        let away = Duration::from_millis(50);
        let take = move |simulation: &mut Simulation, _: Instant| {
            std::thread::sleep(away);
            simulation.step()
        };
        let mut worker = StepWorker::start(Box::new(take)).unwrap();
        worker.hand_over(simulation(), Instant::now());
        let cost = worker.wait(None).unwrap().cost;
        assert!(!cost.is_zero() && cost < away, "{cost:?}");
    }

    #[test]
    fn regress_a_panic_of_the_worker_is_not_waited_for() {
        let mut worker = StepWorker::start(Box::new(|_, _| panic!("on purpose"))).unwrap();
        worker.hand_over(simulation(), Instant::now());
        let waited = catch_unwind(AssertUnwindSafe(|| worker.wait(None).is_some()));
        assert!(waited.is_err());
    }
}
