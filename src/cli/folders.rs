//! Output folders.

use std::path::Path;

use anyhow::Context as _;

pub(super) fn may_be_folder(path: &Path) -> anyhow::Result<()> {
    anyhow::ensure!(!path.is_file(), "{}: is a file, and a folder is needed", path.display());
    Ok(())
}

/// Creates an output folder, unless it exists.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    may_be_folder(path)?;
    std::fs::create_dir_all(path).with_context(|| path.display().to_string())
}
