//! Files that `plot --overlay` lays over one another.

use super::overlay_places::{AskedColumn, has_unlike_meshes, largest_deflections, name_with_meshes, report_places};
use super::plot_source::Source;
use crate::plot::{self, DEFLECTIONS, Figure, PlacedColumn, PlotError};

/// The figures of files laid over one another, each with the name of its part of the files. Of the columns `ys`, a file shows
/// those that it has. Nodes and elements of links with unlike meshes lie over one another by place; their columns are added to the
/// files.
pub(super) fn overlaid(sources: &mut [Source], x: Option<&str>, ys: &[String]) -> Result<Vec<(String, Figure)>, PlotError> {
    let x = x.map(|x| AskedColumn::new(sources, x));
    let ys: Vec<AskedColumn<'_>> = ys.iter().map(|y| AskedColumn::new(sources, y)).collect();
    let mut placed: Vec<PlacedColumn> = match ys.as_slice() {
        [] => largest_deflections(sources),
        ys => x.iter().chain(ys).filter_map(|asked| asked.place.clone()).collect(),
    };
    // The default figures of tables show their columns as they are.
    for source in sources.iter_mut().filter(|source| source.recorded || !ys.is_empty()) {
        placed.iter().for_each(|column| column.add_to(&mut source.tables));
    }
    placed.retain(|column| has_unlike_meshes(sources, column));
    report_places(sources, &placed);
    let title = columns_title(sources, &ys)?;
    let figures = |source: &Source| {
        let figures = if ys.is_empty() { source.figures(None, &[])? } else { columns(source, x.as_ref(), &ys, &title)? };
        Ok((source.label(), figures))
    };
    let files = sources.iter().map(figures).collect::<Result<Vec<_>, PlotError>>()?;
    let mut laid = plot::overlaid(&files);
    let names: Vec<String> = sources.iter().map(|source| name_with_meshes(source, &placed)).collect();
    for (_, figure) in laid.iter_mut().filter(|(part, _)| !ys.is_empty() || part == DEFLECTIONS) {
        figure.rename_files(&names);
    }
    Ok(laid)
}

/// The figure of the columns that a file has, of those in `ys`; none if it has none of them.
fn columns(
    source: &Source,
    x: Option<&AskedColumn<'_>>,
    ys: &[AskedColumn<'_>],
    title: &str,
) -> Result<Vec<(String, Figure)>, PlotError> {
    let has = |asked: &AskedColumn<'_>| source.column_name(&asked.name).is_ok();
    let (there, absent): (Vec<&AskedColumn<'_>>, Vec<&AskedColumn<'_>>) = ys.iter().partition(|&y| has(y));
    // Places that a mesh misses have been reported.
    let is_missed = |y: &AskedColumn<'_>| y.place.as_ref().is_some_and(|place| place.is_missed_by(&source.tables));
    for y in absent.into_iter().filter(|&y| !is_missed(y)) {
        say!("{}: no column `{}`", source.path.display(), y.given);
    }
    if there.is_empty() || x.is_some_and(|x| x.place.is_some() && !has(x)) {
        return Ok(Vec::new());
    }
    let names: Vec<String> = there.iter().map(|y| y.name.clone()).collect();
    let mut figures = source.figures(x.map(|x| x.name.as_str()), &names)?;
    figures.iter_mut().for_each(|(_, figure)| figure.title = title.to_owned());
    Ok(figures)
}

/// The title of columns, each by its name in the first file that has it.
///
/// # Errors
/// [`PlotError::Request`] for a column that no file has.
fn columns_title(sources: &[Source], ys: &[AskedColumn<'_>]) -> Result<String, PlotError> {
    let mut names: Vec<&str> = Vec::new();
    for y in ys {
        let in_files = sources.iter().map(move |source| source.column_name(&y.name));
        if let Some(name) = in_files.reduce(|first, next| first.or_else(|refused| next.map_err(|_| refused))) {
            names.push(name?);
        }
    }
    Ok(plot::title_of_columns(&names))
}
