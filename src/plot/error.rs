//! Errors of drawing.

use std::path::PathBuf;

/// A figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The drawing or rasterising library refused.
    #[error("`{title}` cannot be drawn: {cause}")]
    Draw {
        /// The figure.
        title: String,
        /// The library's error.
        cause: String,
    },
    /// The file or folder could not be written.
    #[error("{}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
    /// A column that is not there.
    #[error("{place}: no column `{name}`{hint}")]
    Column {
        /// The table.
        place: String,
        /// The name asked for.
        name: String,
        /// The nearest name, and how many there are.
        hint: String,
    },
    /// Columns of different tables of one recording, which have no common rows.
    #[error("{place}: `{x}` and `{y}` are in different topics; choose an x column of the same topic")]
    Apart {
        /// The recording.
        place: String,
        /// The x column.
        x: String,
        /// The y column.
        y: String,
    },
    /// Nothing that could be drawn.
    #[error("{0}: nothing to draw: no column of numbers beside the first")]
    Nothing(String),
}

impl PlotError {
    /// Whether what was asked for cannot be, rather than that something went wrong.
    pub fn is_usage(&self) -> bool {
        matches!(self, PlotError::Column { .. } | PlotError::Apart { .. } | PlotError::Nothing(_))
    }

    pub(super) fn draw(title: &str, cause: impl ToString) -> Self {
        PlotError::Draw { title: title.to_owned(), cause: cause.to_string() }
    }

    pub(super) fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        |cause| PlotError::File { path, cause }
    }
}
