//! File names of recordings.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use super::RecordingError;
use crate::claim::Claim;
use crate::wire;

/// Default folder of recordings.
pub const FOLDER: &str = "recordings";

/// The files that this process has claimed, to its end: by then they are there.
static CLAIMED: Mutex<Vec<Claim>> = Mutex::new(Vec::new());

/// `FOLDER/<name>-<UTC time>.mcap`, numbered if that or its first part exists already, or another process of this machine has claimed it.
pub fn fresh(folder: &Path, name: &str, now: SystemTime) -> PathBuf {
    let time = wire::timestamp(now).to_string();
    let time: String = time.split('.').next().unwrap_or(&time).chars().filter(char::is_ascii_alphanumeric).collect();
    let time = time.trim_end_matches('Z');
    let path = |suffix: &str| folder.join(format!("{name}-{time}Z{suffix}.mcap"));
    (1_u32..)
        .map(|n| if n == 1 { path("") } else { path(&format!("-{n}")) })
        .find(|path| claim(path) && !path.exists() && !part(path, 1).exists())
        .unwrap_or_else(|| path(""))
}

/// Claims a file for this process; returns whether none has claimed it before.
fn claim(path: &Path) -> bool {
    let mut hasher = DefaultHasher::new();
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).hash(&mut hasher);
    let claim = Claim::take(&format!("flexcrank/recording/{:016x}", hasher.finish()));
    let is_ours = claim.is_some();
    CLAIMED.lock().unwrap_or_else(PoisonError::into_inner).extend(claim);
    is_ours
}

/// Part `n` of a recording: `take.mcap` becomes `take-001.mcap`.
pub fn part(path: &Path, n: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().map_or(String::new(), |extension| format!(".{}", extension.to_string_lossy()));
    path.with_file_name(format!("{stem}-{n:03}{extension}"))
}

/// `FOLDER/<name>.mcap` for an untrusted name, which must not lead to another folder.
///
/// # Errors
/// [`RecordingError::Name`] unless the name is a plain file name.
pub fn named(folder: &Path, name: &str) -> Result<PathBuf, RecordingError> {
    let plain = !name.is_empty()
        && name.len() <= 128
        && !name.starts_with(['.', '-'])
        && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_'));
    if !plain {
        return Err(RecordingError::Name(name.to_owned()));
    }
    Ok(folder.join(if name.ends_with(".mcap") { name.to_owned() } else { format!("{name}.mcap") }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_parts_are_numbered_before_the_extension() {
        assert_eq!(part(Path::new("r/take.mcap"), 2), PathBuf::from("r/take-002.mcap"));
        assert_eq!(part(Path::new("take"), 1234), PathBuf::from("take-1234"));
    }

    #[test]
    fn prop_a_fresh_name_is_given_once() {
        let now = SystemTime::now();
        let names = [(); 3].map(|()| fresh(Path::new("nowhere"), "fresh", now).to_string_lossy().into_owned());
        assert!(names[0].ends_with("Z.mcap") && names[1].ends_with("Z-2.mcap") && names[2].ends_with("Z-3.mcap"), "{names:?}");
    }

    #[test]
    fn prop_a_name_never_leaves_the_folder() {
        for name in ["", "../x", "a/b", "/etc/x", "..", ".hidden", "a\\b", "a\0b", "ü", "-rf", "--help"] {
            assert!(named(Path::new("r"), name).is_err(), "{name:?}");
        }
        assert_eq!(named(Path::new("r"), "run-1").ok(), Some(PathBuf::from("r/run-1.mcap")));
    }
}
