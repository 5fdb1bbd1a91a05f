//! Opening files to read: only files proper, since readers move about in them, and a device may have no end.

use std::fs::{self, File};
use std::io::{Error, ErrorKind};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use rustix::fs::OFlags;

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
    // A file that makes its reader wait, as some of the system's do, fails instead.
    let nonblocking = i32::try_from(OFlags::NONBLOCK.bits()).unwrap_or_default();
    File::options().read(true).custom_flags(nonblocking).open(path).map_err(RecordingError::file(path))
}
