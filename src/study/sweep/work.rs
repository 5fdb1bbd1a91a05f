//! A worker: claims chunks, and adds the rows that they lack.

use std::fs;
use std::num::NonZero;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Instant;

use super::SweepError;
use super::campaign::{Campaign, Sample};
use super::chunk::{self, Claim};
use super::row::Row;
use super::shard::Shard;
use crate::whole_file::not_made;

/// The result of a worker.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Worked {
    /// Rows of this worker's share.
    pub rows: u64,
    /// Rows computed.
    pub computed: u64,
    /// Rows found done.
    pub found: u64,
    /// Whether it was interrupted.
    pub interrupted: bool,
}

impl Worked {
    /// Rows that other workers were computing at the end, or that an interruption left.
    pub fn left(&self) -> u64 {
        self.rows - self.computed - self.found
    }
}

/// State shared by the threads.
struct Work<'a> {
    campaign: &'a Campaign,
    folder: &'a Path,
    is_shared: bool,
    progress: &'a (dyn Fn(u64) -> ControlFlow<()> + Sync),
    computed: AtomicU64,
    found: AtomicU64,
    stopped: AtomicBool,
    /// Chunks that other workers have.
    held: Mutex<Vec<u64>>,
    failed: Mutex<Option<SweepError>>,
}

/// Computes the rows that are missing, on `threads` threads, and writes each to `folder` as soon as it is known.
///
/// Any number of workers may do so at the same time. `progress` is called with the number of rows that are there; after
/// [`ControlFlow::Break`], the runs that are under way are given up.
///
/// # Errors
/// [`SweepError`] if a file cannot be read or written; other rows are kept.
pub fn work(
    campaign: &Campaign,
    folder: &Path,
    shard: Option<Shard>,
    threads: NonZero<usize>,
    progress: &(dyn Fn(u64) -> ControlFlow<()> + Sync),
) -> Result<Worked, SweepError> {
    let rows_folder = chunk::path(folder, campaign, 0);
    if let Some(rows_folder) = rows_folder.parent() {
        fs::create_dir_all(rows_folder).map_err(|refused| SweepError::file(rows_folder)(not_made(refused, rows_folder)))?;
    }
    let mine: Vec<u64> = (0..campaign.chunks()).filter(|chunk| shard.is_none_or(|shard| shard.has(*chunk))).collect();
    let work = Work {
        campaign,
        folder,
        is_shared: shard.is_none(),
        progress,
        computed: AtomicU64::new(0),
        found: AtomicU64::new(0),
        stopped: AtomicBool::new(false),
        held: Mutex::default(),
        failed: Mutex::default(),
    };
    work.pass(&mine, threads);
    // Of those that others had, some may have been given up meanwhile.
    let held = std::mem::take(&mut *work.held.lock().unwrap_or_else(PoisonError::into_inner));
    work.pass(&held, threads);
    if let Some(error) = work.failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let rows = mine.iter().map(|chunk| campaign.spec().chunk.min(campaign.runs() - chunk * campaign.spec().chunk)).sum();
    let [computed, found] = [&work.computed, &work.found].map(|count| count.load(Ordering::Relaxed));
    Ok(Worked { rows, computed, found, interrupted: work.stopped.load(Ordering::Relaxed) })
}

impl Work<'_> {
    fn pass(&self, chunks: &[u64], threads: NonZero<usize>) {
        let next = AtomicUsize::new(0);
        thread::scope(|scope| {
            for _ in 0..threads.get().min(chunks.len()) {
                scope.spawn(|| {
                    while let Some(chunk) = chunks.get(next.fetch_add(1, Ordering::Relaxed)).filter(|_| !self.is_stopped()) {
                        if let Err(error) = self.chunk(*chunk) {
                            self.stopped.store(true, Ordering::Relaxed);
                            self.failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                        }
                    }
                });
            }
        });
    }

    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    fn chunk(&self, chunk: u64) -> Result<(), SweepError> {
        let samples: Vec<Sample> = self.campaign.samples(chunk).collect();
        let path = chunk::path(self.folder, self.campaign, chunk);
        let Some((mut claim, rows)) = Claim::new(path, &samples, self.campaign.columns().len(), !self.is_shared)? else {
            self.held.lock().unwrap_or_else(PoisonError::into_inner).push(chunk);
            return Ok(());
        };
        let found = rows.iter().flatten().count() as u64;
        self.found.fetch_add(found, Ordering::Relaxed);
        self.report();
        for (sample, _) in samples.into_iter().zip(rows).filter(|(_, row)| row.is_none()) {
            let begin = Instant::now();
            let Some(outcome) = self.campaign.run(&sample, &|| self.is_stopped()) else { return Ok(()) };
            let Sample { index, id, .. } = sample;
            claim.add(&Row { index, id, seconds: begin.elapsed().as_secs_f64(), outcome })?;
            self.computed.fetch_add(1, Ordering::Relaxed);
            self.report();
        }
        Ok(())
    }

    fn report(&self) {
        let done = self.computed.load(Ordering::Relaxed) + self.found.load(Ordering::Relaxed);
        if (self.progress)(done).is_break() {
            self.stopped.store(true, Ordering::Relaxed);
        }
    }
}
