//! Output folders, and the files in them.

use super::failure::{CommandResult, Failure};
use crate::recording::{begins_as_mcap, paths};
use crate::scene::builtin;
use crate::whole_file::{WholeFile, not_made};
use std::path::{Path, PathBuf};

pub(super) fn may_be_folder(path: &Path) -> CommandResult<()> {
    if path.is_file() {
        return Err(Failure::Failed(format!("{}: is a file, and a folder is needed", path.display())));
    }
    Ok(())
}

/// A file that a command writes: its option, and its path if it was given.
pub(super) type Target<'a> = (&'static str, Option<&'a Path>);

/// Refuses files that could not be written at the end of the work, before it begins; also two in one, and one that is read.
/// `source` is the name of a scene, or an instant of a recording.
pub(super) fn must_be_targets(source: &str, targets: &[Target<'_>]) -> CommandResult<()> {
    let given = targets.iter().filter_map(|(option, path)| path.map(|path| (*option, path)));
    let places: Vec<(&str, &Path, Option<PathBuf>)> = given.map(|(option, path)| (option, path, place_on_disk(path))).collect();
    let read = file_read(source);
    for (number, (option, path, on_disk)) in places.iter().enumerate().filter(|(_, (.., on_disk))| on_disk.is_some()) {
        if *on_disk == read {
            return Err(Failure::Usage(format!("{option} names {}, which is read: choose another name", path.display())));
        }
        if let Some((other, first, _)) = places[..number].iter().find(|(.., place)| place == on_disk) {
            let named = format!("{other} and {option} name one file, {}", first.display());
            return Err(Failure::Usage(format!("{named}: each needs its own")));
        }
    }
    places.iter().try_for_each(|(_, path, _)| must_be_writable(path))
}

/// A file by its folder without links and dots, whether it exists or not; `None` where there is no such folder.
fn place_on_disk(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
}

/// The place of the file that a scene, or `FILE@TIME`, is read from; `None` of a built-in scene.
fn file_read(source: &str) -> Option<PathBuf> {
    if builtin::find(source).is_ok() {
        return None;
    }
    let place = |name: &str| Path::new(name).canonicalize().ok();
    place(source).or_else(|| place(source.rsplit_once('@')?.0))
}

/// Refuses a file that could not be written at the end of the work, before it begins, and one that must not be replaced.
pub(super) fn must_be_writable(path: &Path) -> CommandResult<()> {
    must_name_file(path)?;
    must_have_folder(path)?;
    must_be_replaceable(path)?;
    // The reader of a pipe that is opened and closed would see its end.
    if path.metadata().is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        return Ok(());
    }
    WholeFile::create(path).map(drop).map_err(Failure::file(path))
}

/// Refuses the name of a recording or a scene that exists, for a file of another kind.
fn must_be_replaceable(path: &Path) -> CommandResult<()> {
    let is_toml = path.is_file() && path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    let what = match is_toml {
        _ if begins_as_mcap(path) => "is a recording, and recordings",
        true => "exists already, and scenes",
        false => return Ok(()),
    };
    Err(Failure::Usage(format!("{}: {what} are never overwritten: choose another name", path.display())))
}

/// Refuses the name of a folder that does not exist, as `sub/` is, for a file.
fn must_name_file(path: &Path) -> CommandResult<()> {
    let folder = path.components().as_path();
    if folder.as_os_str() == path.as_os_str() || path.is_dir() {
        return Ok(());
    }
    let why = match folder.exists() {
        true => format!("{} is a file, not a folder", folder.display()),
        false => format!("the folder {} does not exist", folder.display()),
    };
    Err(Failure::Failed(format!("{}: {why}", path.display())))
}

/// Refuses a file in a folder that does not exist: only a default folder is created unasked.
pub(super) fn must_have_folder(path: &Path) -> CommandResult<()> {
    match path.parent() {
        Some(folder) if folder.exists() && !folder.is_dir() => {
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

/// Refuses a new recording with the name of another kind of file, or of a folder that does not exist.
pub(super) fn must_suit_recording(path: &Path) -> CommandResult<()> {
    must_name_file(path)?;
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
    std::fs::create_dir_all(path).map_err(|refused| Failure::file(path)(not_made(refused, path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The beginning of a recording.
    const MCAP: &[u8] = b"\x89MCAP0\r\n";

    /// Exit code and words of a refusal; `None` if there is none.
    fn refusal(result: CommandResult<()>) -> Option<(u8, String)> {
        match result {
            Err(Failure::Usage(why)) => Some((2, why)),
            Err(Failure::Failed(why)) => Some((1, why)),
            _ => None,
        }
    }

    /// `--csv` with the name of its own scene or recording left a table in place of it.
    #[test]
    fn regress_what_is_read_or_recorded_is_no_target() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        let named = |name: &str| at(name).display().to_string();
        std::fs::write(at("scene.svg"), "[crank]")?;
        std::fs::write(at("other.toml"), "[crank]")?;
        std::fs::write(at("take.csv"), MCAP)?;
        std::fs::write(at("crank-slider"), "no scene")?;
        std::os::unix::fs::symlink(at("scene.svg"), at("link.csv"))?;
        let why = |source: &str, target: &str| refusal(must_be_targets(source, &[("--csv", Some(at(target).as_path()))]));
        let read = |name: &str| Some((2, format!("--csv names {}, which is read: choose another name", named(name))));
        assert_eq!(why(&named("scene.svg"), "scene.svg"), read("scene.svg"));
        assert_eq!(why(&named("scene.svg"), "link.csv"), read("link.csv"));
        assert_eq!(why(&format!("{}@1.5", named("scene.svg")), "scene.svg"), read("scene.svg"));
        assert_eq!(why(&named("scene.svg"), "new.csv"), None);
        assert_eq!(why("crank-slider", "crank-slider"), None, "the built-in scene is read");
        let end = "are never overwritten: choose another name";
        let kept = |name: &str, what: &str| Some((2, format!("{}: {what} {end}", named(name))));
        assert_eq!(why("crank-slider", "take.csv"), kept("take.csv", "is a recording, and recordings"));
        assert_eq!(why("crank-slider", "other.toml"), kept("other.toml", "exists already, and scenes"));
        assert_eq!(std::fs::read(at("take.csv"))?, MCAP);
        assert_eq!(std::fs::read_dir(folder.path())?.count(), 5, "a refusal makes no file");
        Ok(())
    }

    #[test]
    fn prop_any_two_targets_are_two_files() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let paths = ["x.csv", "./x.csv", "y.csv"].map(|name| folder.path().join(name));
        let [one, again, other] = paths.each_ref().map(PathBuf::as_path);
        let of = |paths: [Option<&Path>; 3]| {
            let targets: Vec<Target<'_>> = ["--write", "--csv", "--plot"].into_iter().zip(paths).collect();
            refusal(must_be_targets("crank-slider", &targets))
        };
        let named = |options: &str| Some((2, format!("{options} name one file, {}: each needs its own", one.display())));
        assert_eq!(of([Some(one), Some(again), None]), named("--write and --csv"));
        assert_eq!(of([Some(one), Some(other), Some(again)]), named("--write and --plot"));
        assert_eq!(of([None, Some(one), Some(again)]), named("--csv and --plot"));
        assert_eq!(of([None, Some(one), Some(other)]), None);
        Ok(())
    }

    /// `--record=sub/` ended with "Is a directory", and a table was refused only once it was computed.
    #[test]
    fn regress_a_name_that_ends_in_a_slash_is_that_of_a_folder() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| PathBuf::from(format!("{}/{name}", folder.path().display()));
        std::fs::write(at("file"), "")?;
        for must in [must_suit_recording, must_be_writable] {
            for (name, bare) in [("sub/", "sub"), ("sub//", "sub"), ("sub/.", "sub"), ("sub/in/", "sub/in")] {
                let why = format!("{}: the folder {} does not exist", at(name).display(), at(bare).display());
                assert_eq!(refusal(must(&at(name))), Some((1, why)));
            }
            let why = format!("{}: {} is a file, not a folder", at("file/").display(), at("file").display());
            assert_eq!(refusal(must(&at("file/"))), Some((1, why)));
            assert_eq!(refusal(must(&at("take.mcap"))), None);
        }
        Ok(())
    }
}
