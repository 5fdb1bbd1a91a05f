//! Errors of recordings.

use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use super::format::is_closed;
use super::open::open;
use super::reader::Messages;
use crate::nearest::did_you_mean_file;
use crate::scene::{builtin, toml_hint};
use crate::shown::{shown_name, shown_names, shown_s, shown_sentence};

/// A recording could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file could not be created, opened, read or written.
    #[error("{}: {}", shown_sentence(&path.display().to_string()), shown_sentence(&why(path, cause)))]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
    /// A file of this name exists.
    #[error("{}: {}", .0.display(), if .0.is_dir() { "is a folder, not a file" } else { "exists already, and recordings are never overwritten: choose another name" })]
    Exists(PathBuf),
    /// The file is not MCAP.
    #[error("{}: not an MCAP file{}", .0.display(), instead_of_mcap(.0))]
    NotMcap(PathBuf),
    /// The file is damaged.
    #[error("{}: {cause}", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// The reader's error.
        cause: mcap::McapError,
    },
    /// A chunk has messages of other times than its index states.
    #[error("{}: the index states other times of the chunk at byte {at} than those of its messages; `flexcrank recover` writes a right index", path.display())]
    ChunkTimes {
        /// The file.
        path: PathBuf,
        /// Position of the chunk, bytes.
        at: u64,
    },
    /// An indexed chunk is damaged.
    #[error("{}: the chunk at byte {at} is damaged: {cause}; `flexcrank recover` saves the rest", path.display())]
    Chunk {
        /// The file.
        path: PathBuf,
        /// Position of the chunk, bytes.
        at: u64,
        /// The reader's error.
        cause: mcap::McapError,
    },
    /// Too many messages wait for earlier ones.
    #[error("{}: so many chunks overlap in time that their messages cannot be put in order", path.display())]
    Overlap {
        /// The file.
        path: PathBuf,
    },
    /// The file has no messages, or none outside of the chunk in which it ends.
    #[error("{}: no messages{}", path.display(), unfinished(path))]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// No message fits a chunk, so that nothing can be recovered.
    #[error("{}: each message is longer than the 64 MiB of a chunk: nothing can be saved", .0.display())]
    TooLong(PathBuf),
    /// No topic can be decoded.
    #[error("{}: no topic is protobuf, so none can be decoded: {}", path.display(), shown_names(topics))]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Its topics.
        topics: Vec<String>,
    },
    /// No topic is of a flexcrank service.
    #[error("{}: no messages of a flexcrank service, so nothing to make ROS messages from", .0.display())]
    NothingForRos(PathBuf),
    /// A message does not fit its schema in the file.
    #[error("{}: a message on `{}` does not fit its schema: {}", path.display(), shown_name(topic), shown_sentence(cause))]
    Undecodable {
        /// The file.
        path: PathBuf,
        /// Topic of the message.
        topic: String,
        /// The decoder's error.
        cause: String,
    },
    /// The file lacks metadata and scene.
    #[error("{}: {}", path.display(), why_anonymous(path))]
    Anonymous {
        /// The file.
        path: PathBuf,
    },
    /// Nothing was recorded at the requested times.
    #[error("{}: no messages from {from_s} s{}: the recording lasts {} s", path.display(), to_s.map_or(String::new(), |to_s| format!(" to {to_s} s")), shown_s(*duration_s))]
    Outside {
        /// The file.
        path: PathBuf,
        /// Requested start, s since the first message.
        from_s: f64,
        /// Requested end, s; `None` is the end of the recording.
        to_s: Option<f64>,
        /// Duration of the recording, s.
        duration_s: f64,
    },
    /// No message has the requested column.
    #[error("{}: no column `{wanted}`{hint}", path.display())]
    Column {
        /// The recording.
        path: PathBuf,
        /// The requested column.
        wanted: String,
        /// The rest of the sentence: the most similar column, or those that there are.
        hint: String,
    },
    /// Messages may have the requested column, but none has.
    #[error("{}: no column `{wanted}`: no message of this recording, or of the part that is exported, has it", path.display())]
    Absent {
        /// The recording.
        path: PathBuf,
        /// The requested column.
        wanted: String,
    },
    /// The name of a recording is not a plain file name.
    #[error(
        "`{0}` is not a name for a recording: letters, digits, dots, dashes and underscores, not beginning with a dot or a dash"
    )]
    Name(String),
}

/// A plain reason if a folder or a scene was given for a file: the system's message says little.
fn why(path: &Path, cause: &std::io::Error) -> String {
    match cause.kind() {
        ErrorKind::InvalidInput | ErrorKind::IsADirectory if path.is_dir() => "is a folder, not a file".to_owned(),
        ErrorKind::NotFound => {
            let scene = RecordingError::absent_scene_hint(path).map(|hint| format!("not a recording, but {hint}"));
            scene.unwrap_or_else(|| format!("{cause}{}", did_you_mean_file(path)))
        }
        _ => cause.to_string(),
    }
}

/// Names what the file is, if it is not MCAP and that can be told.
fn instead_of_mcap(path: &Path) -> String {
    let ends_as_mcap = || path.is_file() && open(path).is_ok_and(|mut file| is_closed(&mut file).unwrap_or(false));
    let is_empty = || path.metadata().is_ok_and(|file| file.is_file() && file.len() == 0);
    match toml_hint(path) {
        Some(hint) => format!(", but {hint}"),
        None if is_empty() => ": the file is empty".to_owned(),
        None if ends_as_mcap() => {
            ", but it ends like one: its beginning is lost, and `flexcrank recover` saves what follows".to_owned()
        }
        None => String::new(),
    }
}

/// Why a file has neither metadata nor scene.
fn why_anonymous(path: &Path) -> &'static str {
    match ends_early(path) {
        true => "no metadata and scene: the file is still being recorded, was cut off before them, or is no flexcrank recording",
        false => "not a flexcrank recording, or its beginning is lost: no metadata and scene",
    }
}

/// Whether a file does not end like one that was closed.
fn ends_early(path: &Path) -> bool {
    open(path).is_ok_and(|mut file| is_closed(&mut file).is_ok_and(|closed| !closed))
}

/// Why a file has no messages, and the way to those of a chunk that was cut off; nothing about a file that was closed.
fn unfinished(path: &Path) -> String {
    match (RecordingError::cut_chunk_hint(path), ends_early(path)) {
        (Some(way), _) => format!(" in a whole chunk, and the file ends early: {way}"),
        (None, true) => ": the file is still being recorded, or was cut off".to_owned(),
        (None, false) => String::new(),
    }
}

impl RecordingError {
    /// The way to the messages of a file that ends in its first chunk, for readers that take whole chunks alone; `None` of a file
    /// that has no such messages.
    pub(crate) fn cut_chunk_hint(path: &Path) -> Option<&'static str> {
        let first = || Messages::open(path).ok()?.next()?.ok();
        let is_there = ends_early(path) && first().is_some();
        is_there.then_some("`flexcrank recover` saves what the chunk that was cut off holds")
    }

    /// The words for a scene that was named in place of a recording; `None` if there is a file of this name, or if it is not a
    /// scene's.
    pub(crate) fn absent_scene_hint(path: &Path) -> Option<String> {
        let name = path.to_str().filter(|_| !path.exists())?;
        let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
        match builtin::find(name) {
            Ok(_) => Some(format!("a built-in scene: run it first, `flexcrank run {name}`")),
            Err(_) if is_toml => {
                Some("the name of a scene, and there is no such file: `flexcrank run` makes a recording of a scene".to_owned())
            }
            Err(_) => None,
        }
    }

    /// The error of a file in which no message is found.
    pub(super) fn empty(path: &Path) -> Self {
        let path = path.to_owned();
        if begins_as_mcap(&path) { RecordingError::Empty { path } } else { RecordingError::NotMcap(path) }
    }

    /// The error of a file without metadata and scene.
    pub(super) fn anonymous(path: &Path) -> Self {
        let path = path.to_owned();
        if begins_as_mcap(&path) { RecordingError::Anonymous { path } } else { RecordingError::NotMcap(path) }
    }

    pub(super) fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        |cause| RecordingError::File { path, cause }
    }

    /// The error of a file that must not exist.
    pub(crate) fn new_file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        |cause| match cause.kind() {
            ErrorKind::AlreadyExists => RecordingError::Exists(path),
            _ => RecordingError::File { path, cause },
        }
    }

    pub(super) fn mcap(path: impl Into<PathBuf>) -> impl FnOnce(mcap::McapError) -> Self {
        let path = path.into();
        |cause| match cause {
            mcap::McapError::BadMagic => RecordingError::NotMcap(path),
            // The system's error explains more than the library's.
            mcap::McapError::Io(cause) => RecordingError::File { path, cause },
            cause => RecordingError::Mcap { path, cause },
        }
    }
}

/// Whether a file begins as MCAP files do. Pipes are not read: what was read of one cannot be read again.
pub(crate) fn begins_as_mcap(path: &Path) -> bool {
    if !path.is_file() {
        return false;
    }
    let mut beginning = [0; mcap::MAGIC.len()];
    std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut beginning)).is_ok() && beginning == mcap::MAGIC
}
