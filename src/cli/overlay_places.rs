//! Places along links at which `plot --overlay` draws nodes and elements of files whose meshes may differ.

use std::collections::BTreeSet;

use super::formatting::counted;
use super::plot_source::Source;
use crate::plot::{self, Named, PlacedColumn, deflection_columns};

/// A column that was asked for.
pub(super) struct AskedColumn<'a> {
    /// Its name as it was given.
    pub given: &'a str,
    /// Its name in the files: the full one, if a file has it in a list and it was given without.
    pub name: String,
    /// Its place along a link, if the files have unlike meshes of the link.
    pub place: Option<PlacedColumn>,
}

impl<'a> AskedColumn<'a> {
    /// The column of a node or an element stands for its place in the first file that has that node or element, with or without the
    /// column: rigid links have nodes, and no deflections. Tables whose column is named without its list get it under the full name.
    pub fn new(sources: &mut [Source], given: &'a str) -> Self {
        let names: Vec<&str> = sources.iter().filter_map(|source| source.column_name(given).ok()).collect();
        let full = names.iter().find(|name| **name != given).or(names.first()).map(|name| (*name).to_owned());
        if let Some(full) = &full {
            sources.iter_mut().for_each(|source| plot::add_under_full_name(&mut source.tables, full));
        }
        let placed = |column: &str| sources.iter().find_map(|source| PlacedColumn::of(&source.tables, column));
        let place = full.as_deref().and_then(placed).filter(|column| has_unlike_meshes(sources, column));
        if let Some((place, full)) = place.as_ref().zip(full.as_deref()) {
            // A table without a mesh has the place that its column has in the recording.
            let without_mesh = sources.iter_mut().filter(|source| place.meshes(&source.tables).is_empty());
            without_mesh.for_each(|source| plot::add_name(&mut source.tables, full, &place.name()));
        }
        let name = place.as_ref().map(PlacedColumn::name).or(full).unwrap_or_else(|| given.to_owned());
        AskedColumn { given, name, place }
    }
}

/// The names of an asked column in one of several files: a node stands for its place in the first file that has it.
pub(super) fn names_here(sources: &[Source], here: &Source, given: &str) -> Vec<String> {
    let placed = |source: &Source| PlacedColumn::of(&source.tables, source.column_name(given).ok()?);
    let names = sources.iter().find_map(placed).map(|column| column.names_in(&here.tables)).unwrap_or_default();
    if names.is_empty() { vec![given.to_owned()] } else { names }
}

/// The deflections of every link at one place in all recordings.
pub(super) fn largest_deflections(sources: &[Source]) -> Vec<PlacedColumn> {
    let recordings = sources.iter().filter(|source| source.recorded).map(|source| source.tables.as_slice());
    let recordings: Vec<&[Named]> = recordings.collect();
    deflection_columns(&recordings)
}

/// Whether a link has other numbers of elements in some files than in others.
pub(super) fn has_unlike_meshes(sources: &[Source], column: &PlacedColumn) -> bool {
    let meshes: BTreeSet<u64> = sources.iter().flat_map(|source| column.meshes(&source.tables)).collect();
    meshes.len() > 1
}

/// Names the node or element of every file at each of the places.
pub(super) fn report_places(sources: &[Source], columns: &[PlacedColumn]) {
    let mut reported: Vec<String> = Vec::new();
    for sentence in columns.iter().map(|column| sentence(sources, column)) {
        if !reported.contains(&sentence) {
            say!("{sentence}");
            reported.push(sentence);
        }
    }
}

fn sentence(sources: &[Source], column: &PlacedColumn) -> String {
    let in_mesh = |source: &Source, elements: u64| {
        let part = match column.number_in(elements) {
            Some(number) => format!("{} {number}", column.part()),
            None => format!("no {}", column.part()),
        };
        format!("{part} in {} ({})", source.path.display(), counted(elements, "element"))
    };
    let mut parts: Vec<String> = Vec::new();
    for source in sources {
        parts.extend(column.meshes(&source.tables).into_iter().map(|elements| in_mesh(source, elements)));
    }
    format!("{}: {}", column.words(), parts.join(", "))
}

/// A file's name in the legend, with the meshes of the links that columns belong to: `fine (rod: 8 elements)`.
pub(super) fn name_with_meshes(source: &Source, columns: &[PlacedColumn]) -> String {
    let mut meshes: Vec<String> = Vec::new();
    for column in columns {
        let elements = column.meshes(&source.tables).into_iter().map(|elements| counted(elements, "element"));
        let elements: Vec<String> = elements.collect();
        let mesh = format!("{}: {}", column.link(), elements.join(" and "));
        if !elements.is_empty() && !meshes.contains(&mesh) {
            meshes.push(mesh);
        }
    }
    let label = source.label();
    if meshes.is_empty() { label } else { format!("{label} ({})", meshes.join(", ")) }
}
