//! Errors of a service.

use crate::bus::BusError;
use crate::recording::RecordingError;
use crate::shown::{shown_names, shown_s};

/// A service could not start, or could not end properly.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The recording failed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A level of the scene cannot be computed.
    #[error("{0}")]
    Scene(String),
    /// A thread could not be started.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
    /// A histogram could not be allocated.
    #[error("cannot keep statistics: {0}")]
    Statistics(#[from] hdrhistogram::CreationError),
    /// A thread panicked: a fault of the program.
    #[error("the {0} thread died: this is a fault in flexcrank")]
    Died(&'static str),
    /// A requested topic is not in the recording.
    #[error("no topic `{wanted}` in the recording; its topics are {}", shown_names(there))]
    NoTopic {
        /// The requested topic.
        wanted: String,
        /// The recorded topics.
        there: Vec<String>,
    },
    /// No topic of the recording can be published.
    #[error("{}: nothing to replay{}", path.display(), because(left_out))]
    NothingToReplay {
        /// The recording.
        path: std::path::PathBuf,
        /// Topics left out, with reasons.
        left_out: Vec<String>,
    },
    /// The replay starts after the end of the recording.
    #[error("--start-offset {offset_s} is past the end of the recording, at {} s", shown_s(*duration_s))]
    PastTheEnd {
        /// Requested start, s.
        offset_s: f64,
        /// Duration of the recording, s.
        duration_s: f64,
    },
    /// The recorded name is not a valid service name.
    #[error(transparent)]
    Name(#[from] crate::bus::BadName),
    /// A viewer in this process could not start.
    #[error("{0}")]
    Viewer(String),
    /// Too few sessions subscribed in time.
    #[error("{found} of {wanted} subscribers within {waited_s:.1} s: start them, or give a longer --wait-timeout")]
    NobodyListens {
        /// Sessions that subscribed.
        found: usize,
        /// Sessions that were waited for.
        wanted: usize,
        /// Waiting time, s.
        waited_s: f64,
    },
}

fn because(left_out: &[String]) -> String {
    if left_out.is_empty() { String::new() } else { format!(" ({})", left_out.join("; ")) }
}
