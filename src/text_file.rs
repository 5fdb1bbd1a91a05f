//! Text files of bounded size: a device may have no end.

use std::fs::File;
use std::io::{Error, ErrorKind, Read as _, Result};
use std::path::Path;

#[cfg(feature = "service")]
use crate::nearest::did_you_mean_file;

/// Reads a text of at most `limit` bytes.
///
/// # Errors
/// Fails if the file cannot be read, is larger, or is not UTF-8. Of a file that is not there, the error names a similar one, if any.
#[cfg(feature = "service")]
pub(crate) fn read(path: &Path, limit: usize) -> Result<String> {
    let bytes = beginning(path, limit).map_err(|cause| with_similar_name(path, cause))?;
    if bytes.len() > limit {
        return Err(too_large(limit));
    }
    String::from_utf8(bytes).map_err(|_| Error::new(ErrorKind::InvalidData, "is not text in UTF-8"))
}

#[cfg(feature = "service")]
fn with_similar_name(path: &Path, cause: Error) -> Error {
    match cause.kind() {
        ErrorKind::NotFound => Error::new(ErrorKind::NotFound, format!("{cause}{}", did_you_mean_file(path))),
        _ => cause,
    }
}

/// Reads a file, or the first `limit` bytes and one more of a larger one.
pub(crate) fn beginning(path: &Path, limit: usize) -> Result<Vec<u8>> {
    if path.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "is a folder, not a file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(limit as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The error of a file that is larger than `limit` bytes.
pub(crate) fn too_large(limit: usize) -> Error {
    Error::new(ErrorKind::FileTooLarge, format!("is larger than {} KiB", limit / 1024))
}

#[cfg(all(test, feature = "service"))]
mod tests {
    use super::read;

    #[test]
    fn regress_a_missing_file_leads_to_a_similar_one() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        std::fs::write(folder.path().join("runs.csv"), "a")?;
        for (name, hint) in [("runz.csv", "runs.csv`?"), ("other.csv", "(os error 2)"), ("runz.toml", "(os error 2)")] {
            let said = read(&folder.path().join(name), 10).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(said.ends_with(hint), "{name}: {said}");
        }
        Ok(())
    }
}
