//! Errors of drawing.

use std::path::PathBuf;

/// A figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The files do not have what was asked for, or it does not fit together.
    #[error("{0}")]
    Request(String),
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
}
