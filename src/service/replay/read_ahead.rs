//! The reading thread: it reads and decompresses messages ahead, so that the playing thread never waits for the disk.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

use crate::recording::{RecordedMessage, RecordingError, RecordingFile};
use crate::service::ServiceError;

/// Bounds of reading ahead: batches in the queue, and the size of one. A single larger message makes its batch larger.
const BATCHES: usize = 8;
const BATCH_BYTES: usize = 128 * 1024;
const BATCH_MESSAGES: usize = 1024;

type Batch = VecDeque<Result<RecordedMessage, RecordingError>>;

/// Messages from a log time on. Dropping it ends its thread.
pub(super) struct ReadAhead {
    batches: Receiver<Batch>,
    batch: Batch,
    thread: Option<JoinHandle<()>>,
}

impl ReadAhead {
    /// Starts to read messages from a log time on.
    pub fn start(source: &Arc<RecordingFile>, from_ns: u64) -> std::io::Result<Self> {
        let (queue, batches) = sync_channel(BATCHES);
        let source = Arc::clone(source);
        let thread = Builder::new().name("reading".to_owned()).spawn(move || read(&source, from_ns, &queue))?;
        Ok(ReadAhead { batches, batch: Batch::new(), thread: Some(thread) })
    }
}

impl Iterator for ReadAhead {
    type Item = Result<RecordedMessage, ServiceError>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.batch.is_empty() {
            match self.batches.recv() {
                Ok(batch) => self.batch = batch,
                // The end of the recording, unless the thread panicked.
                Err(_) => return self.thread.take()?.join().is_err().then_some(Err(ServiceError::Died("reading"))),
            }
        }
        Some(self.batch.pop_front()?.map_err(ServiceError::from))
    }
}

/// Reads to the end, or until the receiver is gone.
fn read(source: &RecordingFile, from_ns: u64, queue: &SyncSender<Batch>) {
    let messages = match source.messages_from(from_ns) {
        Ok(messages) => messages,
        Err(error) => {
            let _ = queue.send(Batch::from([Err(error)]));
            return;
        }
    };
    let (mut batch, mut bytes) = (Batch::new(), 0);
    for message in messages {
        bytes += message.as_ref().map_or(0, |message| message.data.len());
        batch.push_back(message);
        if bytes >= BATCH_BYTES || batch.len() >= BATCH_MESSAGES {
            if queue.send(std::mem::take(&mut batch)).is_err() {
                return;
            }
            bytes = 0;
        }
    }
    // The receiver is gone only if the replay has ended.
    let _ = queue.send(batch);
}
