//! Recordings read back, message by message, in file order; memory is bounded by the largest chunk.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use mcap::sans_io::LinearReaderOptions;

use super::RecordingError;

/// Largest record and largest chunk that are read, bytes; a file that claims a larger one is refused.
pub(super) const RECORD_LIMIT: usize = 64 * 1024 * 1024;

/// One message of a recording.
pub type Recorded = mcap::Message<'static>;

/// The messages of a recording, in file order. Ends at the first damage, with the error.
pub struct Messages {
    path: PathBuf,
    reader: mcap::io::MessageReader<BufReader<File>>,
}

impl Messages {
    /// Opens a recording, whole or cut off.
    ///
    /// # Errors
    /// [`RecordingError::File`] when it cannot be opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = BufReader::new(File::open(path).map_err(RecordingError::file(path))?);
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_LIMIT);
        Ok(Messages { path: path.to_owned(), reader: mcap::io::MessageReader::new_with_options(file, options) })
    }
}

impl Iterator for Messages {
    type Item = Result<Recorded, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.reader.next()?.map_err(RecordingError::mcap(&self.path)))
    }
}

/// Whether an error only says that the file ends early, as a recording does whose program was killed.
pub fn is_cut_off(error: &RecordingError) -> bool {
    matches!(error, RecordingError::Mcap { cause: mcap::McapError::UnexpectedEof | mcap::McapError::UnexpectedEoc, .. })
}
