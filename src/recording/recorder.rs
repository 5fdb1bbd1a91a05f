//! The recording thread: takes messages from a bounded queue, so that a slow disk never holds up the simulation.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, TrySendError, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use super::session_info::SessionInfo;
use super::settings::{Settings, WhenFull};
use super::writer::{SessionWriter, Written};
use super::{Message, RecordingError, paths};

/// Messages that may wait for the disk.
const QUEUE: usize = 8192;
/// Between two looks at a full queue.
const POLL_PERIOD: Duration = Duration::from_millis(1);
/// The thread rests between two looks at its queue: to be woken for every message would cost more than writing it. So long at
/// most, and no longer than this part of the flush period.
const QUEUE_POLL_PERIOD: Duration = Duration::from_millis(10);
const REST_PER_FLUSH: u32 = 8;
/// It does not rest when it found so many.
const BUSY_BATCH: usize = 512;

/// A recording in progress.
pub struct Recorder {
    base: PathBuf,
    queue: Sender<Message>,
    thread: JoinHandle<Vec<Result<Written, RecordingError>>>,
    when_full: WhenFull,
    shared: Arc<Shared>,
}

/// What the recording thread says of itself.
#[derive(Default)]
struct Shared {
    /// Number of the part being written; 0 where there are no parts.
    part: AtomicU32,
    full: AtomicBool,
    /// Messages in the queue. It takes memory only for these.
    waiting: AtomicUsize,
    ended: AtomicBool,
}

impl Recorder {
    /// Makes a new file and begins; of a recording in parts, the first one. Chunks reach the system at least every flush
    /// period of wall time.
    ///
    /// # Errors
    /// [`RecordingError`] when the file exists already or cannot be made.
    pub fn start(path: &Path, session: &SessionInfo, settings: Settings) -> Result<Self, RecordingError> {
        let shared = Arc::<Shared>::default();
        shared.part.store(settings.split.map_or(0, |_| 1), Ordering::Relaxed);
        let recording = Recording::begin(path, session, settings, Arc::clone(&shared))?;
        let (queue, messages) = channel();
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || recording.take_all(&messages))
            .map_err(RecordingError::file(path))?;
        Ok(Recorder { base: path.to_owned(), queue, thread, when_full: settings.when_full, shared })
    }

    /// The file being written.
    pub fn path(&self) -> PathBuf {
        part_path(&self.base, self.shared.part.load(Ordering::Relaxed))
    }

    /// Whether the file is full: the next message that may begin a part goes into a new one.
    pub fn is_full(&self) -> bool {
        self.shared.full.load(Ordering::Relaxed)
    }

    /// Whether it has ended by itself: the disk failed, or the file was to become no larger.
    pub fn has_ended(&self) -> bool {
        self.shared.ended.load(Ordering::Acquire)
    }

    /// Hands over a message; `false` when it was left out, because the disk is too slow or recording has failed.
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

    /// Hands over a message, waiting for the disk if need be; `false` when recording has failed.
    pub fn record_blocking(&self, mut message: Message) -> bool {
        loop {
            match self.try_send(message) {
                Ok(()) => return true,
                Err(TrySendError::Disconnected(_)) => return false,
                // To be woken for every message that leaves a full queue would cost more than writing it.
                Err(TrySendError::Full(back)) => message = back,
            }
            std::thread::sleep(POLL_PERIOD);
        }
    }

    /// Writes out what is queued, closes the file and says what it and those before it hold.
    pub fn finish(self) -> Vec<Result<Written, RecordingError>> {
        drop(self.queue);
        let died = || RecordingError::file(self.base)(std::io::Error::other("the recording thread died"));
        self.thread.join().unwrap_or_else(|_| vec![Err(died())])
    }
}

fn part_path(base: &Path, part: u32) -> PathBuf {
    if part == 0 { base.to_owned() } else { paths::part(base, part) }
}

/// The recording thread's state.
struct Recording {
    base: PathBuf,
    session: SessionInfo,
    settings: Settings,
    shared: Arc<Shared>,
    writer: SessionWriter,
    finished: Vec<Result<Written, RecordingError>>,
    /// Bytes of the parts that are finished.
    finished_bytes: u64,
}

impl Recording {
    fn begin(base: &Path, session: &SessionInfo, settings: Settings, shared: Arc<Shared>) -> Result<Self, RecordingError> {
        let part = shared.part.load(Ordering::Relaxed);
        let writer = SessionWriter::create(&part_path(base, part), session, (part > 0).then_some(part), settings)?;
        Ok(Recording {
            base: base.to_owned(),
            session: session.clone(),
            settings,
            shared,
            writer,
            finished: Vec::new(),
            finished_bytes: 0,
        })
    }

    /// Writes until the other end hangs up, something fails, or the limit is reached.
    fn take_all(mut self, messages: &Receiver<Message>) -> Vec<Result<Written, RecordingError>> {
        let taken = self.take(messages);
        let Recording { writer, mut finished, shared, .. } = self;
        finished.push(taken.and_then(|limited| Ok(Written { limited, ..writer.finish()? })));
        // Before the queue is hung up, so that whoever is told so knows why.
        shared.ended.store(true, Ordering::Release);
        finished
    }

    /// Whether the limit was reached.
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

    /// Whether the limit is reached.
    fn write(&mut self, message: &Message) -> Result<bool, RecordingError> {
        if message.begins_part && self.writer.is_full() {
            self.next_part()?;
        }
        self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
        self.writer.write(message)?;
        self.shared.full.store(self.writer.is_full(), Ordering::Relaxed);
        let limit = self.settings.limit_bytes;
        Ok(limit.is_some_and(|limit| self.finished_bytes + self.writer.size_when_closed() >= limit))
    }

    /// Goes on in the next file whose name is free.
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
        let finished = std::mem::replace(&mut self.writer, writer).finish();
        if let Ok(Written { path, .. }) = &finished {
            self.finished_bytes += std::fs::metadata(path).map_or(0, |file| file.len());
        }
        self.finished.push(finished);
        Ok(())
    }
}
