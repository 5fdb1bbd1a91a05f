//! Errors of drawing.

use std::path::PathBuf;

/// A figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The rasterising library refused.
    #[error("`{title}` cannot be drawn as PNG: {cause}")]
    Png {
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
    /// A recording without a link that could be drawn moving.
    #[error("{0}: no link to animate")]
    NoLink(String),
    /// No row within the range of time.
    #[error("{place}: nothing was recorded {range}; {recorded}")]
    Outside {
        /// The recording.
        place: String,
        /// The range, in words.
        range: String,
        /// The recorded time, in words.
        recorded: String,
    },
}

impl PlotError {
    /// Whether what was asked for cannot be, rather than that something went wrong.
    pub fn is_usage(&self) -> bool {
        !matches!(self, PlotError::Png { .. } | PlotError::File { .. })
    }
}
