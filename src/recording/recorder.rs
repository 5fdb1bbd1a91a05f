//! The recording thread: it writes messages from a bounded queue, so that a slow disk never blocks the simulation.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, TrySendError, channel};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

use super::end::EndReason;
use super::session_info::SessionInfo;
use super::settings::{Settings, WhenFull};
use super::writer::{SessionWriter, Written};
use super::{Message, RecordingError, paths};

/// Capacity of the queue to the disk.
const QUEUE: usize = 8192;
/// Time between two attempts to send to a full queue.
const POLL_PERIOD: Duration = Duration::from_millis(1);
/// Longest pause between two looks at the queue; never more than this fraction of the flush period. Waking the thread for every
/// message would cost more than writing the message.
const QUEUE_POLL_PERIOD: Duration = Duration::from_millis(10);
const REST_PER_FLUSH: u32 = 8;
/// After a batch of this many messages, the thread does not pause.
const BUSY_BATCH: usize = 512;

/// A recording in progress.
pub struct Recorder {
    base: PathBuf,
    queue: Sender<Message>,
    thread: JoinHandle<Vec<Result<Written, RecordingError>>>,
    when_full: WhenFull,
    shared: Arc<Shared>,
}

/// State shared with the recording thread.
#[derive(Default)]
struct Shared {
    /// Number of the current part; 0 if the recording has no parts.
    part: AtomicU32,
    full: AtomicBool,
    /// Number of queued messages. The queue allocates memory only for these.
    waiting: AtomicUsize,
    ended: AtomicBool,
    /// Why the recording was finished.
    reason: OnceLock<EndReason>,
}

impl Recorder {
    /// Creates a new file and starts to record; with parts, creates the first part. Chunks are flushed to the system at least
    /// once per flush period of wall time.
    ///
    /// # Errors
    /// [`RecordingError`] if the file exists already or cannot be created.
    pub fn start(path: &Path, session: &SessionInfo, settings: Settings) -> Result<Self, RecordingError> {
        let part = settings.split.map(|_| 1);
        let shared = Arc::new(Shared { part: part.unwrap_or(0).into(), ..Shared::default() });
        let recording = Recording {
            base: path.to_owned(),
            session: session.clone(),
            settings,
            shared: Arc::clone(&shared),
            writer: SessionWriter::create(&part_path(path, part.unwrap_or(0)), session, part, settings)?,
            finished: Vec::new(),
            finished_bytes: 0,
        };
        let (queue, messages) = channel();
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || recording.take_all(&messages))
            .map_err(RecordingError::file(path))?;
        Ok(Recorder { base: path.to_owned(), queue, thread, when_full: settings.when_full, shared })
    }

    /// Path of the current file.
    pub fn path(&self) -> PathBuf {
        part_path(&self.base, self.shared.part.load(Ordering::Relaxed))
    }

    /// Whether the file has reached its part size: the next checkpoint begins a new part.
    pub fn is_full(&self) -> bool {
        self.shared.full.load(Ordering::Relaxed)
    }

    /// Whether the recording ended early: the disk failed, or the size limit was reached.
    pub fn has_ended(&self) -> bool {
        self.shared.ended.load(Ordering::Acquire)
    }

    /// Queues a message; returns `false` if it was dropped, because the queue is full or the recording has failed.
    pub fn record(&self, message: Message) -> bool {
        match self.when_full {
            WhenFull::Wait => self.record_blocking(message),
            WhenFull::Drop => self.try_send(message).is_ok(),
        }
    }

    fn try_send(&self, message: Message) -> Result<(), TrySendError<Message>> {
        if self.has_ended() {
            return Err(TrySendError::Disconnected(message));
        }
        if self.shared.waiting.load(Ordering::Relaxed) >= QUEUE {
            return Err(TrySendError::Full(message));
        }
        self.shared.waiting.fetch_add(1, Ordering::Relaxed);
        self.queue.send(message).map_err(|back| TrySendError::Disconnected(back.0))
    }

    /// Queues a message, and waits for the disk if the queue is full; returns `false` if the recording has failed.
    pub fn record_blocking(&self, mut message: Message) -> bool {
        loop {
            match self.try_send(message) {
                Ok(()) => return true,
                Err(TrySendError::Disconnected(_)) => return false,
                // Waking this thread for every message that leaves a full queue would cost more than writing it.
                Err(TrySendError::Full(back)) => message = back,
            }
            std::thread::sleep(POLL_PERIOD);
        }
    }

    /// Writes all queued messages and the reason of the end, closes the file, and returns a summary of every part.
    pub fn finish(self, reason: EndReason) -> Vec<Result<Written, RecordingError>> {
        // The reason is set once.
        let _ = self.shared.reason.set(reason);
        drop(self.queue);
        let died = || RecordingError::file(self.base)(std::io::Error::other("the recording thread died"));
        self.thread.join().unwrap_or_else(|_| vec![Err(died())])
    }
}

fn part_path(base: &Path, part: u32) -> PathBuf {
    if part == 0 { base.to_owned() } else { paths::part(base, part) }
}

/// State of the recording thread.
struct Recording {
    base: PathBuf,
    session: SessionInfo,
    settings: Settings,
    shared: Arc<Shared>,
    writer: SessionWriter,
    finished: Vec<Result<Written, RecordingError>>,
    /// Total size of the finished parts.
    finished_bytes: u64,
}

impl Recording {
    /// Writes until the sender is gone, an error occurs, or the size limit is reached.
    fn take_all(mut self, messages: &Receiver<Message>) -> Vec<Result<Written, RecordingError>> {
        let taken = self.take(messages);
        let Recording { writer, mut finished, shared, .. } = self;
        let reason =
            |limited| if limited { EndReason::SizeLimit } else { shared.reason.get().copied().unwrap_or(EndReason::RunEnded) };
        finished.push(taken.and_then(|limited| Ok(Written { limited, ..writer.finish(reason(limited))? })));
        // Set before the queue closes, so that a failed send finds the reason.
        shared.ended.store(true, Ordering::Release);
        finished
    }

    /// Writes batches until the sender is gone; returns whether the recording ended at the size limit.
    fn take(&mut self, messages: &Receiver<Message>) -> Result<bool, RecordingError> {
        let rest = QUEUE_POLL_PERIOD.min(self.settings.flush_period / REST_PER_FLUSH);
        loop {
            let next = match self.writer.due_in() {
                Some(wait) => messages.recv_timeout(wait),
                None => messages.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match next {
                Ok(message) if self.write(&message)? => return Ok(true),
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => self.writer.flush()?,
                Err(RecvTimeoutError::Disconnected) => return Ok(false),
            }
            let mut found = BUSY_BATCH;
            while found >= BUSY_BATCH {
                found = 0;
                loop {
                    match messages.try_recv() {
                        Ok(message) if self.write(&message)? => return Ok(true),
                        Ok(_) => {}
                        Err(TryRecvError::Empty) => break,
                        Err(TryRecvError::Disconnected) => return Ok(false),
                    }
                    found += 1;
                }
            }
            std::thread::sleep(rest);
        }
    }

    /// Writes a message; returns whether the recording ended before it, at the size limit.
    fn write(&mut self, message: &Message) -> Result<bool, RecordingError> {
        let begins_part = message.begins_part && self.writer.is_full();
        if self.settings.limit_bytes.is_some_and(|limit| self.size_with(message, begins_part) > limit) {
            return Ok(true);
        }
        if begins_part {
            // The checkpoint ends this part, and begins the next.
            self.writer.write(message)?;
            self.next_part()?;
        }
        self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
        self.writer.write(message)?;
        self.shared.full.store(self.writer.is_full(), Ordering::Relaxed);
        Ok(false)
    }

    /// Upper bound for the size of all parts if the recording ends after this message.
    fn size_with(&self, message: &Message, begins_part: bool) -> u64 {
        let next = if begins_part { self.writer.size_of_part(message) } else { 0 };
        self.finished_bytes + self.writer.size_with(message) + next
    }

    /// Starts the next part, under the next free file name.
    fn next_part(&mut self) -> Result<(), RecordingError> {
        let mut part = self.shared.part.load(Ordering::Relaxed);
        let writer = loop {
            part += 1;
            match SessionWriter::create(&part_path(&self.base, part), &self.session, Some(part), self.settings) {
                Err(RecordingError::Exists(_)) => {}
                writer => break writer?,
            }
        };
        self.shared.part.store(part, Ordering::Relaxed);
        let finished = std::mem::replace(&mut self.writer, writer).finish(EndReason::NextPart);
        if let Ok(Written { path, .. }) = &finished {
            self.finished_bytes += std::fs::metadata(path).map_or(0, |file| file.len());
        }
        self.finished.push(finished);
        Ok(())
    }
}
