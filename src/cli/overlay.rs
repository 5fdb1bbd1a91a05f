//! Files that `plot --overlay` lays over one another.

use super::plot_source::Source;
use crate::plot::{self, Figure, PlotError};

/// The figures of files laid over one another, each with the name of its part of the files. Of the columns `ys`, a file shows
/// those that it has.
pub(super) fn overlaid(sources: &[Source], x: Option<&str>, ys: &[String]) -> Result<Vec<(String, Figure)>, PlotError> {
    let title = columns_title(sources, ys)?;
    let figures = |source: &Source| {
        let figures = if ys.is_empty() { source.figures(x, ys)? } else { columns(source, x, ys, &title)? };
        Ok((source.stem.clone(), figures))
    };
    let files = sources.iter().map(figures).collect::<Result<Vec<_>, PlotError>>()?;
    Ok(plot::overlaid(&files))
}

/// The figure of the columns that a file has, of those in `ys`; none if it has none of them.
fn columns(source: &Source, x: Option<&str>, ys: &[String], title: &str) -> Result<Vec<(String, Figure)>, PlotError> {
    let (there, absent): (Vec<String>, Vec<String>) = ys.iter().cloned().partition(|y| source.column_name(y).is_ok());
    for y in absent {
        say!("{}: no column `{y}`", source.path.display());
    }
    if there.is_empty() {
        return Ok(Vec::new());
    }
    let mut figures = source.figures(x, &there)?;
    figures.iter_mut().for_each(|(_, figure)| figure.title = title.to_owned());
    Ok(figures)
}

/// The title of columns, each by its name in the first file that has it.
///
/// # Errors
/// [`PlotError::Request`] for a column that no file has.
fn columns_title(sources: &[Source], ys: &[String]) -> Result<String, PlotError> {
    let mut names: Vec<&str> = Vec::new();
    for y in ys {
        let in_files = sources.iter().map(move |source| source.column_name(y));
        if let Some(name) = in_files.reduce(|first, next| first.or_else(|refused| next.map_err(|_| refused))) {
            names.push(name?);
        }
    }
    Ok(plot::title_of_columns(&names))
}
