//! Running a plan: every cell on a thread of its own, so that neither a panic nor a hang of one takes the others along.

use std::any::Any;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use super::base_scene::BaseScene;
use super::cell;
use super::outcome::{Category, Outcome};
use super::plan::{Cell, Map, MapPlan};
use super::trajectory::Trajectory;

/// A map with what became of its cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    /// The map.
    pub map: Map,
    /// One outcome a cell, in the cells' order.
    pub outcomes: Vec<Outcome>,
}

/// What the threads share.
struct Work {
    base: BaseScene,
    cells: Vec<Cell>,
    references: Vec<(Cell, OnceLock<Trajectory>)>,
}

/// Runs all cells on `threads` of them at a time, none longer than `limit`; tells `progress` how many are done.
pub fn sweep(
    base: &BaseScene,
    plan: MapPlan,
    threads: NonZero<usize>,
    limit: Duration,
    progress: impl Fn(usize) + Sync,
) -> Vec<Swept> {
    let MapPlan { maps, references } = plan;
    let work = Arc::new(Work {
        base: base.clone(),
        cells: maps.iter().flat_map(|map| map.cells.iter().cloned()).collect(),
        references: references.into_iter().map(|cell| (cell, OnceLock::new())).collect(),
    });
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let ends: Mutex<Vec<Option<Outcome>>> = Mutex::new(vec![None; work.cells.len()]);
    thread::scope(|scope| {
        for _ in 0..threads.get() {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= work.cells.len() {
                        break;
                    }
                    let outcome = run_guarded(&work, index, limit);
                    ends.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(outcome);
                    progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                }
            });
        }
    });
    let mut ends = ends.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten();
    let gather = |map: Map| Swept { outcomes: ends.by_ref().take(map.cells.len()).collect(), map };
    maps.into_iter().map(gather).collect()
}

/// The outcome of a cell, whatever it does.
fn run_guarded(work: &Arc<Work>, index: usize, limit: Duration) -> Outcome {
    let (report, outcome) = sync_channel(1);
    let shared = Arc::clone(work);
    let body = move || {
        // Nobody listens any more when it took too long.
        let _ = report.send(run(&shared, index));
    };
    let thread = match thread::Builder::new().name(format!("cell {index}")).spawn(body) {
        Ok(thread) => thread,
        Err(error) => return failed(Category::Hung, format!("no thread for it: {error}")),
    };
    match outcome.recv_timeout(limit) {
        Ok(outcome) => outcome,
        Err(RecvTimeoutError::Timeout) => failed(Category::Hung, format!("not done after {} s", limit.as_secs_f64())),
        Err(RecvTimeoutError::Disconnected) => failed(Category::Panicked, panic_message(thread.join())),
    }
}

fn run(work: &Work, index: usize) -> Outcome {
    let Some(cell) = work.cells.get(index) else { return failed(Category::Hung, String::new()) };
    let reference = cell.reference.and_then(|place| work.references.get(place));
    let reference = reference.map(|(reference, kept)| kept.get_or_init(|| cell::follow(&work.base, reference)));
    cell::run(&work.base, cell, reference)
}

fn failed(category: Category, message: String) -> Outcome {
    Outcome { category, error: None, step: 0, sim_time_s: 0.0, energy_j: None, verdict: None, cause: None, message }
}

fn panic_message(joined: thread::Result<()>) -> String {
    let text = |payload: Box<dyn Any + Send>| match payload.downcast::<String>() {
        Ok(text) => *text,
        Err(payload) => payload.downcast::<&str>().map_or_else(|_| "a panic".to_owned(), |text| (*text).to_owned()),
    };
    joined.err().map_or_else(String::new, text)
}
