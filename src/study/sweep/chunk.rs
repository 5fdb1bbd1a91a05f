//! The rows of a chunk on disk, and the lock by which one worker at a time adds to them.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use super::SweepError;
use super::campaign::{Campaign, Sample};
use super::row::Row;

/// The rows of a chunk by the places of its samples; `None` for those that are not there.
pub(super) type Rows = Vec<Option<Row>>;

/// The file of a chunk. Its folder is named for the chunks' size: another size has other files.
pub(super) fn path(folder: &Path, campaign: &Campaign, chunk: u64) -> PathBuf {
    folder.join(format!("chunks-of-{}", campaign.spec().chunk)).join(format!("{chunk:07}.tsv"))
}

/// Reads the rows of a chunk. No lock is needed: a line counts once it has its end.
pub(super) fn read(path: &Path, samples: &[Sample], columns: usize) -> Result<Rows, SweepError> {
    let text = match fs::read(path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => Vec::new(),
        Err(cause) => return Err(SweepError::file(path)(cause)),
    };
    Ok(rows(&text, samples, columns))
}

fn rows(text: &[u8], samples: &[Sample], columns: usize) -> Rows {
    let mut rows = vec![None; samples.len()];
    let first = samples.first().map_or(0, |sample| sample.index);
    let lines = text.split_inclusive(|byte| *byte == b'\n').filter_map(|line| line.strip_suffix(b"\n"));
    for row in lines.filter_map(|line| Row::parse(str::from_utf8(line).ok()?, columns)) {
        let place = row.index.checked_sub(first).and_then(|place| usize::try_from(place).ok());
        let Some((sample, kept)) = place.and_then(|place| samples.get(place).zip(rows.get_mut(place))) else { continue };
        // Rows of an earlier specification stay in the file, and are not read.
        if row.is_of(sample) && kept.is_none() {
            *kept = Some(row);
        }
    }
    rows
}

/// A chunk that no other worker adds to.
pub(super) struct Claim {
    path: PathBuf,
    /// Locked until it is closed, also by the end of the process.
    file: File,
}

impl Claim {
    /// Claims a chunk, and reads its rows; `None` if another worker has it. `alone` says that no other worker is meant to take this
    /// chunk, so that a file system without locks will do.
    pub fn new(path: PathBuf, samples: &[Sample], columns: usize, alone: bool) -> Result<Option<(Self, Rows)>, SweepError> {
        let failed = SweepError::file(&path);
        let file = File::options().read(true).append(true).create(true).open(&path).map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => {
                if !alone {
                    return Err(SweepError::NoLocks(path));
                }
            }
            Err(TryLockError::Error(cause)) => return Err(SweepError::file(&path)(cause)),
        }
        let mut claim = Claim { path, file };
        let text = claim.whole_lines().map_err(SweepError::file(&claim.path))?;
        let rows = rows(&text, samples, columns);
        Ok(Some((claim, rows)))
    }

    /// Reads the file, and cuts off the beginning of a line that a killed worker left.
    fn whole_lines(&mut self) -> io::Result<Vec<u8>> {
        let mut text = Vec::new();
        self.file.read_to_end(&mut text)?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        if whole < text.len() {
            self.file.set_len(whole as u64)?;
            text.truncate(whole);
        }
        Ok(text)
    }

    /// Adds a row. It is with the system when this returns: the end of the process does not lose it.
    pub fn add(&mut self, row: &Row) -> Result<(), SweepError> {
        self.file.write_all(row.line().as_bytes()).map_err(SweepError::file(&self.path))
    }
}
