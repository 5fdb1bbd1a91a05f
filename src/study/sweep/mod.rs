//! Campaigns: many runs of a scene whose keys vary, shared among threads, processes and machines; a table of scalars, and the
//! sensitivity of each to each key.
//!
//! [`Spec`] is the file, [`Campaign`] the runs that follow from it. Any number of workers [`work`] on one folder; [`merge`] makes one
//! table of the rows that they leave there, and [`sensitivity`] reads it.

mod axis;
mod campaign;
mod chunk;
mod merge;
mod misread;
mod points;
mod random;
mod row;
mod run;
mod sampling;
mod scalars;
mod sensitivity;
mod shard;
mod sobol;
mod sobol_numbers;
mod spec;
mod work;

use std::io;
use std::path::{Path, PathBuf};

pub use axis::{Axis, Levels, Value};
pub use campaign::{Campaign, RefusedRuns, RefusedValue};
pub(crate) use merge::INDEX;
pub use merge::{Merged, OutOfRange, TableFormat, Untrusted, has_rows, merge, missing_rows};
pub use points::{Coordinate, Points, points};
pub use row::Row;
pub use run::{Column, Ending, Outcome, is_trusted_row};
pub use sensitivity::{Indices, NoIndices, sensitivity, sensitivity_table};
pub use shard::{BadShard, Shard};
pub use spec::{Method, Spec, SpecError};
pub use work::{Worked, work};

use crate::recording::RecordingError;
use crate::scene::SceneError;

/// A campaign could not be run or merged.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The specification was refused.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The scene was refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file of rows could not be read or written.
    #[error("{}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: io::Error,
    },
    /// The file system has no locks, and several workers may take the same rows.
    #[error("{}: the file system has no locks: give each worker a share of its own with --shard I/N", .0.display())]
    NoLocks(PathBuf),
    /// The name of the table asks for no format.
    #[error("{}: a table ends in .csv or .parquet", .0.display())]
    TableName(PathBuf),
    /// The table could not be written.
    #[error(transparent)]
    Table(#[from] RecordingError),
}

impl SweepError {
    /// Adds the file to an error of the system.
    fn file(path: &Path) -> impl FnOnce(io::Error) -> SweepError {
        move |cause| SweepError::File { path: path.to_owned(), cause }
    }
}
