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
    /// The lateness histogram could not be encoded.
    #[error("cannot keep statistics: {0}")]
    Statistics(#[from] hdrhistogram::CreationError),
    /// A thread died of a fault in the program.
    #[error("the {0} thread died: this is a fault in flexcrank")]
    Died(&'static str),
    /// A topic was asked for that the recording does not have.
    #[error("no topic `{wanted}` in the recording; there are {}", there.join(", "))]
    NoTopic {
        /// What was asked for.
        wanted: String,
        /// What there is.
        there: Vec<String>,
    },
    /// No topic of the recording can be put on the bus.
    #[error("{}: nothing to replay{}", path.display(), because(left_out))]
    NothingToReplay {
        /// The recording.
        path: std::path::PathBuf,
        /// Topics that cannot be keys, and why.
        left_out: Vec<String>,
    },
    /// A replay is to begin where there is nothing any more.
    #[error("--start-offset {offset_s} is past the end of the recording, at {duration_s} s")]
    PastTheEnd {
        /// Where it was to begin, s.
        offset_s: f64,
        /// How long the recording is, s.
        duration_s: f64,
    },
    /// A name that is none.
    #[error(transparent)]
    Name(#[from] crate::bus::BadName),
    /// Too few subscribed in time.
    #[error("{found} of {wanted} subscribers within {waited_s:.1} s: start them, or give a longer --wait-timeout")]
    NobodyListens {
        /// How many came.
        found: usize,
        /// How many were waited for.
        wanted: usize,
        /// For how long, s.
        waited_s: f64,
    },
}

fn because(left_out: &[String]) -> String {
    if left_out.is_empty() { String::new() } else { format!(" ({})", left_out.join("; ")) }
}
