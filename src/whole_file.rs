//! Files that get their name only when they are whole: an error or an interruption leaves what was there before.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

/// The files of this process. Each is created, named and deleted under this lock.
static FILES: Mutex<Files> = Mutex::new(Files { unfinished: BTreeSet::new(), finished: 0 });

struct Files {
    unfinished: BTreeSet<PathBuf>,
    finished: usize,
}

fn files() -> MutexGuard<'static, Files> {
    FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Deletes all unfinished files, because the process is about to end; returns the numbers of files that were finished and
/// deleted. No file is created or named after that.
pub(crate) fn discard_unfinished() -> [usize; 2] {
    let files = files();
    // A file that is gone needs no deletion.
    files.unfinished.iter().for_each(|path| _ = fs::remove_file(path));
    let counts = [files.finished, files.unfinished.len()];
    // The lock is kept: the process ends.
    std::mem::forget(files);
    counts
}

/// Most bytes of a name that an unfinished file keeps: `.`, a number of ten digits and `.part` take the rest of a name's 255.
const KEPT_BYTES: usize = 255 - 16;

/// As much of a file's name as the name of its unfinished file can hold.
fn kept_name(path: &Path) -> String {
    let mut name = path.file_name().map(OsStr::to_string_lossy).unwrap_or_default().into_owned();
    name.truncate(name.floor_char_boundary(KEPT_BYTES));
    name
}

/// NAME.PROCESS.part in the nearest folder that exists, so that a refusal leaves no folder behind.
pub(crate) fn part_in_nearest_folder(path: &Path) -> PathBuf {
    let name = format!("{}.{}.part", kept_name(path), std::process::id());
    let folder = path.ancestors().skip(1).find(|folder| folder.as_os_str().is_empty() || folder.is_dir());
    folder.unwrap_or(Path::new("")).join(name)
}

/// The place of an unfinished file. Dropping it deletes the file.
pub(crate) struct Unfinished(Option<TempPath>);

impl Unfinished {
    /// The place of a file that another part of the program creates.
    pub(crate) fn at(path: PathBuf) -> io::Result<Self> {
        Self::among(&mut files(), TempPath::try_from_path(path)?)
    }

    /// Creates NAME.RANDOM.part beside the final name.
    fn beside(path: &Path) -> io::Result<(File, Self)> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let (prefix, permissions) = (format!("{}.", kept_name(path)), Permissions::from_mode(0o666));
        let mut files = files();
        let created = tempfile::Builder::new().prefix(&prefix).suffix(".part").permissions(permissions).tempfile_in(folder);
        let file = created.map_err(|refused| not_made(of_system(refused), path))?;
        let (file, path) = file.into_parts();
        Ok((file, Self::among(&mut files, path)?))
    }

    fn among(files: &mut Files, path: TempPath) -> io::Result<Self> {
        files.unfinished.insert(path.to_path_buf());
        Ok(Unfinished(Some(path)))
    }

    /// Gives the file its final name.
    ///
    /// # Errors
    /// Fails if the system refuses, or if the name is taken and must be new.
    pub(crate) fn finish(mut self, path: &Path, must_be_new: bool) -> io::Result<()> {
        let mut files = files();
        let Some(part) = self.0.take() else { return Ok(()) };
        files.unfinished.remove::<Path>(&part);
        let named = if must_be_new { part.persist_noclobber(path) } else { part.persist(path) };
        files.finished += usize::from(named.is_ok());
        named.map_err(|refused| refused.error)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let Some(part) = self.0.take() else { return };
        let mut files = files();
        files.unfinished.remove::<Path>(&part);
        drop(part);
    }
}

/// The error of the system in one that also names the unfinished file, which nobody has heard of.
fn of_system(error: io::Error) -> io::Error {
    let text = error.to_string();
    let (cause, _) = text.split_once(" at path ").unwrap_or((&text, ""));
    io::Error::new(error.kind(), cause.to_owned())
}

/// The error of making a file or a folder in one that names the folder around it, if that is at fault.
pub(crate) fn not_made(error: io::Error, path: &Path) -> io::Error {
    let around = path.ancestors().skip(1).map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    let folder = around.clone().find(|folder| folder.is_dir());
    let is_of_folder = match error.kind() {
        io::ErrorKind::PermissionDenied => true,
        // As in /proc.
        io::ErrorKind::NotFound => folder == around.clone().next(),
        _ => false,
    };
    match folder.filter(|_| is_of_folder) {
        Some(folder) => {
            let folder = if folder == Path::new(".") { "this folder".to_owned() } else { folder.display().to_string() };
            io::Error::new(error.kind(), format!("{error}: nothing can be made in {folder}"))
        }
        None => error,
    }
}

/// A file in the making. Dropping it without [`finish`](WholeFile::finish) deletes it.
pub(crate) enum WholeFile {
    /// Written as NAME.RANDOM.part, and renamed at the end.
    Beside(File, Unfinished, PathBuf),
    /// Something that cannot be replaced, such as a pipe or a device.
    Direct(File),
}

impl WholeFile {
    /// Begins a file that will replace one of this name.
    ///
    /// # Errors
    /// Fails if the folder does not exist or cannot be written, or the name is longer than the system allows.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        if path.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder, not a file"));
        }
        match fs::metadata(path) {
            Ok(there) if !there.is_file() => return File::options().write(true).open(path).map(WholeFile::Direct),
            // The unfinished file would have a shorter name, and this one be refused at the end.
            Err(refused) if refused.kind() == io::ErrorKind::InvalidFilename => return Err(refused),
            _ => {}
        }
        // A link stays a link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let (file, unfinished) = Unfinished::beside(&path)?;
        Ok(WholeFile::Beside(file, unfinished, path))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// Fails if the system refuses.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.named(false)
    }

    /// Gives the file its name, unless that is taken.
    ///
    /// # Errors
    /// Fails if the system refuses, or a file of this name exists.
    pub(crate) fn finish_new(self) -> io::Result<()> {
        self.named(true)
    }

    fn named(self, must_be_new: bool) -> io::Result<()> {
        match self {
            WholeFile::Beside(_, unfinished, path) => unfinished.finish(&path, must_be_new),
            WholeFile::Direct(mut file) => file.flush(),
        }
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            WholeFile::Beside(file, ..) => file.write(bytes),
            WholeFile::Direct(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            WholeFile::Beside(file, ..) => file.flush(),
            WholeFile::Direct(file) => file.flush(),
        }
    }
}

/// Writes a whole file at once, where there is none.
///
/// # Errors
/// Fails if the file cannot be written, or exists: then the error is of the kind `AlreadyExists`.
pub(crate) fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let taken = || io::Error::new(io::ErrorKind::AlreadyExists, "exists already, and is not overwritten");
    if path.symlink_metadata().is_ok() {
        return Err(taken());
    }
    let mut file = WholeFile::create(path)?;
    file.write_all(bytes)?;
    file.finish_new().map_err(|refused| if refused.kind() == io::ErrorKind::AlreadyExists { taken() } else { refused })
}

/// Writes a whole file at once.
///
/// # Errors
/// Fails if the file cannot be written; one of this name stays as it was.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(bytes)?;
    file.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_file_has_its_name_only_when_it_is_whole() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("table.csv");
        write_whole(&path, b"first")?;
        let mut second = WholeFile::create(&path)?;
        second.write_all(b"sec")?;
        assert_eq!(fs::read(&path)?, b"first");
        drop(second);
        assert_eq!(fs::read_dir(folder.path())?.count(), 1, "nothing is left of a file that was given up");
        write_whole(&path, b"second")?;
        assert_eq!(fs::read(&path)?, b"second");
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link)?;
        write_whole(&link, b"third")?;
        assert!(link.is_symlink() && fs::read(&path)? == b"third");
        write_whole(Path::new("/dev/null"), b"nothing")?;
        assert!(!fs::metadata("/dev/null")?.is_file());
        let refused = write_whole(&folder.path().join("none/table.csv"), b"").map_err(|refused| refused.to_string());
        assert_eq!(refused, Err("No such file or directory (os error 2)".to_owned()), "without the unfinished file's name");
        let taken = write_new(&path, b"fourth").map_err(|refused| (refused.kind(), refused.to_string()));
        let words = "exists already, and is not overwritten".to_owned();
        assert!(taken == Err((io::ErrorKind::AlreadyExists, words)) && fs::read(&path)? == b"third");
        write_new(&folder.path().join("new.csv"), b"fifth")?;
        assert_eq!(
            (fs::read(folder.path().join("new.csv"))?.as_slice(), fs::read_dir(folder.path())?.count()),
            (&b"fifth"[..], 3)
        );
        Ok(())
    }

    /// The unfinished file's name is longer than the final one, and was refused.
    #[test]
    fn regress_a_name_may_be_as_long_as_the_system_allows() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        // Two bytes a character, so that a cut at any byte would halve one.
        for name in ["n".repeat(255), format!("n{}", "é".repeat(127)), "é".repeat(127)] {
            let path = folder.path().join(&name);
            write_whole(&path, b"whole")?;
            assert_eq!(fs::read(&path)?, b"whole", "{name}");
            let part = part_in_nearest_folder(&path);
            fs::write(&part, "")?;
            fs::remove_file(part)?;
        }
        let refused = WholeFile::create(&folder.path().join("n".repeat(256))).map(drop).map_err(|refused| refused.kind());
        assert_eq!(refused, Err(io::ErrorKind::InvalidFilename), "before anything is computed");
        assert_eq!(fs::read_dir(folder.path())?.count(), 3, "nothing unfinished is left");
        Ok(())
    }
}
