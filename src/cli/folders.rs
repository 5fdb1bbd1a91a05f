//! Output folders.

use super::failure::{CommandResult, Failure};
use crate::recording::paths;
use crate::whole_file::WholeFile;
use std::path::Path;

pub(super) fn may_be_folder(path: &Path) -> CommandResult<()> {
    if path.is_file() {
        return Err(Failure::Failed(format!("{}: is a file, and a folder is needed", path.display())));
    }
    Ok(())
}

/// Refuses a file that could not be written at the end of the work, before it begins.
pub(super) fn must_be_writable(path: &Path) -> CommandResult<()> {
    must_have_folder(path)?;
    // The reader of a pipe that is opened and closed would see its end.
    if path.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        return Ok(());
    }
    WholeFile::create(path).map(drop).map_err(Failure::file(path))
}

/// Refuses a file in a folder that does not exist: only a default folder is created unasked.
pub(super) fn must_have_folder(path: &Path) -> CommandResult<()> {
    match path.parent() {
        Some(folder) if folder.is_file() => {
            Err(Failure::Failed(format!("{}: {} is a file, not a folder", path.display(), folder.display())))
        }
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() && folder != Path::new(paths::FOLDER) => {
            Err(Failure::Failed(format!("{}: the folder {} does not exist", path.display(), folder.display())))
        }
        _ => Ok(()),
    }
}

/// Endings of files of other kinds.
const OTHER_ENDINGS: [&str; 15] =
    ["csv", "tsv", "txt", "md", "json", "jsonl", "toml", "yaml", "yml", "parquet", "npz", "svg", "png", "pdf", "html"];

/// Refuses a new recording with the name of another kind of file.
pub(super) fn must_suit_recording(path: &Path) -> CommandResult<()> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    if !OTHER_ENDINGS.iter().any(|other| ending == *other) {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "{}: a recording is an MCAP file, named *.mcap; `flexcrank export` makes tables of it, `flexcrank plot` figures",
        path.display()
    )))
}

/// Refuses to begin work whose default folder of recordings cannot be written, or created, and names the options that help. The folder
/// is not created.
pub(super) fn must_hold_recordings(folder: &Path, remedy: &str) -> CommandResult<()> {
    let name = ".flexcrank-probe";
    let probe = if folder.exists() { folder.join(name) } else { folder.with_file_name(name) };
    let probed = WholeFile::create(&probe).map(drop);
    probed.map_err(|cause| Failure::Failed(format!("{}: {cause}: {remedy}", folder.display())))
}

/// Creates an output folder, unless it exists; the folder around it must exist.
pub(super) fn make_folder(path: &Path) -> CommandResult<()> {
    may_be_folder(path)?;
    must_have_folder(path)?;
    std::fs::create_dir_all(path).map_err(Failure::file(path))
}
