//! Output folders.

use super::failure::{CommandResult, Failure};
use std::path::Path;

pub(super) fn may_be_folder(path: &Path) -> CommandResult<()> {
    if path.is_file() {
        return Err(Failure::Failed(format!("{}: is a file, and a folder is needed", path.display())));
    }
    Ok(())
}

/// Creates an output folder, unless it exists.
pub(super) fn make_folder(path: &Path) -> CommandResult<()> {
    may_be_folder(path)?;
    std::fs::create_dir_all(path).map_err(Failure::file(path))
}
