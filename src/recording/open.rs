//! Opening files to read: only files proper, since readers move about in them, and a device may have no end.

use std::fs::{self, File};
use std::io::{Error, ErrorKind};
use std::path::Path;

use super::RecordingError;

/// Opens a file to read.
///
/// # Errors
/// [`RecordingError::File`] if it cannot be opened, or is a folder, a pipe or a device.
pub(super) fn open(path: &Path) -> Result<File, RecordingError> {
    let kind = fs::metadata(path).map_err(RecordingError::file(path))?;
    if !kind.is_file() {
        return Err(RecordingError::file(path)(Error::new(ErrorKind::InvalidInput, "is a pipe or a device, not a file")));
    }
    File::open(path).map_err(RecordingError::file(path))
}
