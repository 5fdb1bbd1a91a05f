//! The recording thread: takes messages from a bounded queue, so that a slow disk never holds up the simulation.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use super::writer::{Session, SessionWriter, Written};
use super::{Message, RecordingError};

/// Messages that may wait for the disk.
const QUEUE: usize = 8192;

/// What to do when the queue to the disk is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhenFull {
    /// Wait: nothing is lost, the simulation slows down.
    Wait,
    /// Leave the message out and say so.
    Drop,
}

/// A recording in progress.
pub struct Recorder {
    path: PathBuf,
    queue: SyncSender<Message>,
    thread: JoinHandle<Result<Written, RecordingError>>,
    when_full: WhenFull,
}

impl Recorder {
    /// Makes a new file and begins. Chunks reach the system at least every `flush_period` of wall time.
    ///
    /// # Errors
    /// [`RecordingError`] when the file exists already or cannot be made.
    pub fn start(path: &Path, session: &Session, flush_period: Duration, when_full: WhenFull) -> Result<Self, RecordingError> {
        let writer = SessionWriter::create(path, session, flush_period)?;
        let (queue, messages) = sync_channel(QUEUE);
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || record(writer, &messages, flush_period))
            .map_err(RecordingError::file(path))?;
        Ok(Recorder { path: path.to_owned(), queue, thread, when_full })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Hands over a message; `false` when it was left out, because the disk is too slow or recording has failed.
    pub fn record(&self, message: Message) -> bool {
        match self.when_full {
            WhenFull::Wait => self.queue.send(message).is_ok(),
            WhenFull::Drop => match self.queue.try_send(message) {
                Ok(()) => true,
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
            },
        }
    }

    /// Writes out what is queued, closes the file and says what it holds.
    ///
    /// # Errors
    /// [`RecordingError`] when something could not be written, now or before.
    pub fn finish(self) -> Result<Written, RecordingError> {
        drop(self.queue);
        let lost = || std::io::Error::other("the recording thread died");
        self.thread.join().unwrap_or_else(|_| Err(RecordingError::file(self.path)(lost())))
    }
}

fn record(mut writer: SessionWriter, messages: &Receiver<Message>, flush_period: Duration) -> Result<Written, RecordingError> {
    loop {
        match messages.recv_timeout(flush_period) {
            Ok(message) => writer.write(&message)?,
            Err(RecvTimeoutError::Timeout) => writer.flush_if_due()?,
            Err(RecvTimeoutError::Disconnected) => return writer.finish(),
        }
    }
}
