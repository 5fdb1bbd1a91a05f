//! Runs the cells of a plan, each on a thread of its own, so that one that panics or hangs does not affect the others.

use std::num::NonZero;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use super::base_scene::BaseScene;
use super::cell;
use super::labelling::Labels;
use super::outcome::{Category, Outcome};
use super::plan::{Cell, Map, MapPlan};
use super::trajectory::Trajectory;
use crate::study::panic_message::panic_message;

/// A map with the outcomes of its cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    /// The map.
    pub map: Map,
    /// One outcome a cell, in the cells' order.
    pub outcomes: Vec<Outcome>,
}

/// State shared by the threads.
struct Work {
    base: BaseScene,
    cells: Vec<Cell>,
    references: Vec<(Cell, OnceLock<Trajectory>)>,
    labels: Labels,
}

/// Runs all cells, `threads` at a time, none longer than `limit`. `progress` is called with the number of
/// finished cells; after [`ControlFlow::Break`], the remaining cells are not run.
pub fn sweep(
    base: &BaseScene,
    plan: MapPlan,
    threads: NonZero<usize>,
    limit: Duration,
    progress: impl Fn(usize) -> ControlFlow<()> + Sync,
) -> Vec<Swept> {
    let MapPlan { maps, references } = plan;
    let work = Arc::new(Work {
        base: base.clone(),
        cells: maps.iter().flat_map(|map| map.cells.iter().cloned()).collect(),
        references: references.into_iter().map(|cell| (cell, OnceLock::new())).collect(),
        labels: Labels::default(),
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
                    if progress(done.fetch_add(1, Ordering::Relaxed) + 1).is_break() {
                        next.store(work.cells.len(), Ordering::Relaxed);
                    }
                }
            });
        }
    });
    let not_run = || Outcome::without_run(Category::NotRun, String::new());
    let ends = ends.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut ends = ends.into_iter().map(|outcome| outcome.unwrap_or_else(not_run));
    let gather = |map: Map| Swept { outcomes: ends.by_ref().take(map.cells.len()).collect(), map };
    maps.into_iter().map(gather).collect()
}

/// Runs a cell, and turns a panic or timeout into an outcome.
fn run_guarded(work: &Arc<Work>, index: usize, limit: Duration) -> Outcome {
    let (report, outcome) = sync_channel(1);
    let shared = Arc::clone(work);
    let body = move || {
        // The receiver is gone if the cell took too long.
        let _ = report.send(run(&shared, index));
    };
    let thread = match thread::Builder::new().name(format!("cell {index}")).spawn(body) {
        Ok(thread) => thread,
        Err(error) => return Outcome::without_run(Category::Hung, format!("no thread for it: {error}")),
    };
    match outcome.recv_timeout(limit) {
        Ok(outcome) => outcome,
        Err(RecvTimeoutError::Timeout) => {
            Outcome::without_run(Category::Hung, format!("not done after {} s", limit.as_secs_f64()))
        }
        Err(RecvTimeoutError::Disconnected) => {
            Outcome::without_run(Category::Panicked, thread.join().err().map_or_else(String::new, panic_message))
        }
    }
}

fn run(work: &Work, index: usize) -> Outcome {
    let Some(cell) = work.cells.get(index) else { return Outcome::without_run(Category::Hung, String::new()) };
    let reference = cell.reference.and_then(|place| work.references.get(place));
    let reference = reference.map(|(reference, kept)| (reference, kept.get_or_init(|| cell::follow(&work.base, reference))));
    let mut outcome = cell::run(&work.base, cell, reference.map(|(_, trajectory)| trajectory));
    work.labels.add(&work.base, cell, reference, &mut outcome);
    outcome
}
