//! What can end a service early.

use crate::bus::BusError;
use crate::recording::RecordingError;

/// A service could not start, or could not end properly.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A thread could not be started.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
    /// The lateness histogram could not be made.
    #[error("cannot keep statistics: {0}")]
    Statistics(#[from] hdrhistogram::CreationError),
    /// A thread died of a fault in the program.
    #[error("the {0} thread died: this is a fault in flexcrank")]
    Died(&'static str),
    /// The recording has no topics of ours.
    #[error("{}: not a flexcrank recording: no topic under flexcrank/", .0.display())]
    NotOurs(std::path::PathBuf),
    /// Nobody subscribed in time.
    #[error("no subscriber within {0} s (--wait-for)")]
    NobodyListens(u64),
}
