//! What can go wrong with a recording.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// A recording could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file could not be made, opened, read or written.
    #[error("{}: {}", path.display(), why(path, cause))]
    File {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A file of this name is there already.
    #[error("{}: exists already, and recordings are never overwritten", .0.display())]
    Exists(PathBuf),
    /// The file is something else.
    #[error("{}: not an MCAP file", .0.display())]
    NotMcap(PathBuf),
    /// The file is damaged.
    #[error("{}: {cause}", path.display())]
    Mcap {
        /// Which file.
        path: PathBuf,
        /// What the reader says.
        cause: mcap::McapError,
    },
    /// A chunk that the index points at is damaged.
    #[error("{}: the chunk at byte {at} is damaged: {cause}; `flexcrank recover` saves the rest", path.display())]
    Chunk {
        /// Which file.
        path: PathBuf,
        /// Where in the file it begins.
        at: u64,
        /// What the reader says.
        cause: mcap::McapError,
    },
    /// There is nothing to read in it.
    #[error("{}: no messages", path.display())]
    Empty {
        /// Which file.
        path: PathBuf,
    },
    /// A message cannot be decoded by the schema that the file gives for it.
    #[error("{}: a message on `{topic}` does not fit its schema: {cause}", path.display())]
    Undecodable {
        /// Which file.
        path: PathBuf,
        /// The message's topic.
        topic: String,
        /// What the decoder says.
        cause: String,
    },
    /// It does not say what was recorded.
    #[error("{}: not a flexcrank recording, or its beginning is lost: no metadata and scene", path.display())]
    Anonymous {
        /// Which file.
        path: PathBuf,
    },
    /// Times were asked for at which nothing was recorded.
    #[error("{}: no messages from {from_s} s{}: the recording lasts {duration_s} s", path.display(), to_s.map_or(String::new(), |to_s| format!(" to {to_s} s")))]
    Outside {
        /// Which file.
        path: PathBuf,
        /// Beginning of what was asked for, s since the first message.
        from_s: f64,
        /// Its end, s; that of the recording when none is given.
        to_s: Option<f64>,
        /// How long the recording is, s.
        duration_s: f64,
    },
    /// A column was asked for that no message has.
    #[error("{}: no column `{wanted}`{}", path.display(), nearest.as_ref().map_or(String::new(), |name| format!("; did you mean `{name}`?")))]
    Column {
        /// Which recording.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// What is most like it.
        nearest: Option<String>,
    },
    /// A name for a recording that is not a plain file name.
    #[error("`{0}` is not a name for a recording: letters, digits, dots, dashes and underscores, not beginning with a dot")]
    Name(String),
}

/// What the system says of a folder that was taken for a file says little.
fn why(path: &Path, cause: &std::io::Error) -> String {
    match cause.kind() {
        ErrorKind::InvalidInput | ErrorKind::IsADirectory if path.is_dir() => "is a folder, not a file".to_owned(),
        _ => cause.to_string(),
    }
}

impl RecordingError {
    pub(super) fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        |cause| RecordingError::File { path, cause }
    }

    pub(super) fn mcap(path: impl Into<PathBuf>) -> impl FnOnce(mcap::McapError) -> Self {
        let path = path.into();
        |cause| match cause {
            mcap::McapError::BadMagic => RecordingError::NotMcap(path),
            mcap::McapError::Io(cause) if path.is_dir() => RecordingError::File { path, cause },
            cause => RecordingError::Mcap { path, cause },
        }
    }

    /// Of a file that could not be written: what the system says is more than that something was wrong with it.
    pub(super) fn unwritten(path: impl Into<PathBuf>) -> impl FnOnce(mcap::McapError) -> Self {
        let path = path.into();
        |cause| match cause {
            mcap::McapError::Io(cause) => RecordingError::File { path, cause },
            cause => RecordingError::Mcap { path, cause },
        }
    }
}
