//! Errors of drawing.

use std::path::PathBuf;

/// A figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The files do not have what was asked for, or it does not fit together.
    #[error("{0}")]
    Request(String),
    /// The rasterising library refused the figure of this title.
    #[error("`{0}` cannot be drawn as PNG: {1}")]
    Png(String, String),
    /// The file or folder could not be written.
    #[error("{path}: {1}", path = .0.display())]
    File(PathBuf, std::io::Error),
}
