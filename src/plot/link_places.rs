//! Columns of nodes and elements by their place along a link. Files whose meshes differ share places, not numbers: node 2 of four
//! elements lies where node 4 of eight does, and both are in the column `nodes.rod.1/2.x_m`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::mechanism::LINKS;
use super::quantity::place_words;
use super::recorded::find_topic;
use super::selection::Named;
use crate::mesh_places::node_at_same_place;
use crate::study::Table;

/// The lists of nodes and of elements.
const NODES: &str = "nodes";
const ELEMENTS: &str = "elements";

/// A column of a node or an element by its place along its link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlacedColumn {
    list: &'static str,
    link: String,
    place: Place,
    field: String,
}

/// A node or an element of a mesh. The mesh of a node is the coarsest that has one at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    number: u64,
    elements: u64,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.elements)
    }
}

impl Place {
    fn of_node(number: u64, elements: u64) -> Self {
        let in_mesh = |mesh: u64| Some(Place { number: node_at_same_place(number, elements, mesh)?, elements: mesh });
        (1..=elements).find_map(in_mesh).unwrap_or(Place { number, elements })
    }
}

impl PlacedColumn {
    /// The place of a numbered column, `nodes.rod.2.x_m`, in the first mesh of a file that has any column of its node or element. `None`
    /// for other columns, and for tables that lack nodes or elements before it.
    pub fn of(tables: &[Named], column: &str) -> Option<Self> {
        let (list, link, number, field) = numbered(column)?;
        let part = column.strip_suffix(field)?;
        let table = &tables.iter().find(|named| named.table.columns().any(|(name, _)| name.starts_with(part)))?.table;
        let is_there = |elements: &u64| *elements > 0 && number < *elements + u64::from(list == NODES);
        let elements = elements_by_row(table, list, link).into_iter().find(is_there)?;
        let place = if list == NODES { Place::of_node(number, elements) } else { Place { number, elements } };
        Some(PlacedColumn { list, link: link.to_owned(), place, field: field.to_owned() })
    }

    /// Its name: `nodes.rod.1/2.x_m`.
    pub fn name(&self) -> String {
        format!("{}.{}.{}.{}", self.list, self.link, self.place, self.field)
    }

    /// Its names in the meshes of a file: `nodes.rod.2.x_m`.
    pub fn names_in(&self, tables: &[Named]) -> Vec<String> {
        let numbers = self.meshes(tables).into_iter().filter_map(|elements| self.number_in(elements));
        numbers.map(|number| format!("{}.{}.{number}.{}", self.list, self.link, self.field)).collect()
    }

    /// The name of its link.
    pub fn link(&self) -> &str {
        &self.link
    }

    /// Its place in words.
    pub fn words(&self) -> String {
        place_words(self.list, &self.link, &self.place.to_string())
    }

    /// The part of the mesh at its place: a node or an element.
    pub fn part(&self) -> &'static str {
        if self.list == NODES { "node" } else { "element" }
    }

    /// The number of the node or element at the place in a mesh of so many elements; `None` if there is none. Meshes that differ
    /// share no element.
    pub fn number_in(&self, elements: u64) -> Option<u64> {
        let Place { number, elements: own } = self.place;
        if self.list == NODES { node_at_same_place(number, own, elements) } else { (elements == own).then_some(number) }
    }

    /// The numbers of elements that the link has in a file: several if its mesh changes, none if the file lacks the link.
    pub fn meshes(&self, tables: &[Named]) -> BTreeSet<u64> {
        tables.iter().flat_map(|named| meshes(&elements_by_row(&named.table, self.list, &self.link))).collect()
    }

    /// Whether a file has the link, but no node or element at the place.
    pub fn is_missed_by(&self, tables: &[Named]) -> bool {
        let meshes = self.meshes(tables);
        !meshes.is_empty() && meshes.iter().all(|elements| self.number_in(*elements).is_none())
    }

    /// Adds the column to the table of a file that has the place.
    pub fn add_to(&self, tables: &mut [Named]) {
        for table in tables.iter_mut().map(|named| &mut named.table) {
            if let Some(values) = self.values(table) {
                table.push(self.name(), values);
            }
        }
    }

    /// The values of the node or element in every row; NaN where the mesh has none at the place.
    fn values(&self, table: &Table) -> Option<Vec<f64>> {
        let by_row = elements_by_row(table, self.list, &self.link);
        let column = |elements: u64| {
            let number = self.number_in(elements)?;
            Some((elements, table.column(&format!("{}.{}.{number}.{}", self.list, self.link, self.field))?))
        };
        let columns: Vec<(u64, &[f64])> = meshes(&by_row).into_iter().filter_map(column).collect();
        let mut values = vec![f64::NAN; by_row.len()];
        for (mesh, column) in &columns {
            let rows = values.iter_mut().zip(*column).zip(&by_row).filter(|(_, elements)| *elements == mesh);
            rows.for_each(|((value, known), _)| *value = *known);
        }
        (!columns.is_empty()).then_some(values)
    }
}

/// The deflections of every link at one place in all files: of the places that most files share, that of the largest deflection.
/// Files without it have a place of their own.
pub fn deflection_columns(files: &[&[Named]]) -> Vec<PlacedColumn> {
    let of_link = |link: &str| {
        let largest = files.iter().map(|tables| largest_deflections(tables, link)).filter(|largest| !largest.is_empty());
        shared_places(largest.collect())
    };
    let column = |link: &str, place: Place| {
        let (link, field) = (link.to_owned(), "deflection_m".to_owned());
        PlacedColumn { list: NODES, link, place, field }
    };
    LINKS.into_iter().flat_map(|link| of_link(link).into_iter().map(move |place| column(link, place))).collect()
}

/// Places so that every file has one of them: the best shared, then the best shared by the files without it, and so on.
fn shared_places(mut files: Vec<BTreeMap<Place, f64>>) -> Vec<Place> {
    let mut places = Vec::new();
    while let Some(place) = best_shared(&files) {
        files.retain(|values| !values.contains_key(&place));
        places.push(place);
    }
    places
}

/// The place that most files have; of these, the one of the largest value.
fn best_shared(files: &[BTreeMap<Place, f64>]) -> Option<Place> {
    let sharing = |place: &Place| files.iter().filter(|values| values.contains_key(place)).count();
    let largest = |place: &Place| files.iter().filter_map(|values| values.get(place)).copied().fold(0.0, f64::max);
    let places = files.iter().flat_map(BTreeMap::keys).copied();
    places.max_by(|one, other| sharing(one).cmp(&sharing(other)).then(largest(one).total_cmp(&largest(other))))
}

/// The places between the pins at which a link of a file bends, with the largest deflection at each, m.
fn largest_deflections(tables: &[Named], link: &str) -> BTreeMap<Place, f64> {
    let mut largest: BTreeMap<Place, f64> = BTreeMap::new();
    let Some(Named { table, .. }) = find_topic(tables, "displacements") else { return largest };
    let by_row = elements_by_row(table, NODES, link);
    for mesh in meshes(&by_row) {
        for number in 1..mesh {
            let deflections = table.column(&format!("{NODES}.{link}.{number}.deflection_m")).unwrap_or_default();
            let of_mesh = deflections.iter().zip(&by_row).filter(|(_, elements)| **elements == mesh);
            let most = of_mesh.map(|(deflection, _)| deflection.abs()).filter(|size| size.is_finite()).fold(0.0, f64::max);
            if most > 0.0 {
                let at_place = largest.entry(Place::of_node(number, mesh)).or_insert(most);
                *at_place = at_place.max(most);
            }
        }
    }
    largest
}

/// List, link, number and field of a column of a node or an element.
fn numbered(column: &str) -> Option<(&'static str, &str, u64, &str)> {
    let mut parts = column.splitn(4, '.');
    let (list, link, number, field) = (parts.next()?, parts.next()?, parts.next()?, parts.next()?);
    let list = [NODES, ELEMENTS].into_iter().find(|known| *known == list)?;
    // The masses of an oscillator lie along no link.
    LINKS.contains(&link).then_some((list, link, number.parse().ok()?, field))
}

/// The number of elements of a link in every row of a table; 0 where it has none.
fn elements_by_row(table: &Table, list: &str, link: &str) -> Vec<u64> {
    let field = if list == NODES { "x_m" } else { "axial_n" };
    let column = |number: u64| table.column(&format!("{list}.{link}.{number}.{field}"));
    let columns: Vec<&[f64]> = (0..).map_while(column).collect();
    let is_known = |value: Option<&f64>| value.is_some_and(|value| value.is_finite());
    let known = |row: usize| columns.iter().take_while(|values| is_known(values.get(row))).count() as u64;
    let both_ends = u64::from(list == NODES);
    (0..table.rows()).map(|row| known(row).saturating_sub(both_ends)).collect()
}

/// The meshes among numbers of elements.
fn meshes(by_row: &[u64]) -> BTreeSet<u64> {
    by_row.iter().copied().filter(|elements| *elements > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rod of so many elements in each row, that deflects at each node by the node's place from 0 to 1.
    fn recording(elements: &[u64]) -> Vec<Named> {
        let mut table = Table::default();
        for number in 0..=elements.iter().copied().max().unwrap_or_default() {
            let place = |elements: &u64| if number <= *elements { number as f64 / *elements as f64 } else { f64::NAN };
            for field in ["x_m", "deflection_m"] {
                table.push(format!("nodes.rod.{number}.{field}"), elements.iter().map(place).collect());
            }
        }
        vec![Named { name: "flexcrank/crank/displacements".to_owned(), table, ..Named::default() }]
    }

    #[test]
    fn prop_a_column_by_place_follows_the_mesh() {
        for (number, name, values) in [
            (0, "nodes.rod.0/1.deflection_m", "[0.0, 0.0, 0.0]"),
            (2, "nodes.rod.1/2.deflection_m", "[0.5, 0.5, NaN]"),
            (3, "nodes.rod.3/4.deflection_m", "[0.75, 0.75, NaN]"),
            (7, "nodes.rod.7/8.deflection_m", "[NaN, 0.875, NaN]"),
        ] {
            let mut tables = recording(&[4, 8, 3]);
            let placed = PlacedColumn::of(&tables, &format!("nodes.rod.{number}.deflection_m"));
            placed.iter().for_each(|column| column.add_to(&mut tables));
            assert_eq!(placed.map(|column| column.name()).as_deref(), Some(name));
            let added = tables[0].table.column(name).map(|values| format!("{values:?}"));
            assert_eq!(added.as_deref(), Some(values), "{name}");
        }
        for column in ["nodes.rod.9.x_m", "nodes.mass.0.x_m", "links.rod.chord_rad"] {
            assert_eq!(PlacedColumn::of(&recording(&[4, 8, 3]), column), None);
        }
    }

    #[test]
    fn prop_deflections_of_most_files_are_at_one_place() {
        let files = [recording(&[8, 8]), recording(&[4, 4]), recording(&[3, 3]), recording(&[1, 1])];
        let files: Vec<&[Named]> = files.iter().map(Vec::as_slice).collect();
        let names: Vec<String> = deflection_columns(&files).iter().map(PlacedColumn::name).collect();
        assert_eq!(names, ["nodes.rod.3/4.deflection_m", "nodes.rod.2/3.deflection_m"]);
    }
}
