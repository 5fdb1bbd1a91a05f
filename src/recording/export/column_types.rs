//! Columns of exported tables: their names, types and selection.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use crate::nearest::nearest;
use crate::recording::RecordingError;
use crate::recording::rows::{FieldValue, TIMES};

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColumnType {
    Integer,
    Number,
    Flag,
    Text,
    Time,
}

impl ColumnType {
    fn of(cell: &FieldValue) -> Self {
        match cell {
            FieldValue::Integer(_) => ColumnType::Integer,
            FieldValue::Number(_) => ColumnType::Number,
            FieldValue::Flag(_) => ColumnType::Flag,
            FieldValue::Text(_) => ColumnType::Text,
            FieldValue::Time(_) => ColumnType::Time,
        }
    }

    /// The narrowest type that holds both.
    fn with(self, other: ColumnType) -> ColumnType {
        match (self, other) {
            (a, b) if a == b => a,
            (ColumnType::Integer, ColumnType::Number) | (ColumnType::Number, ColumnType::Integer) => ColumnType::Number,
            _ => ColumnType::Text,
        }
    }
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub name: String,
    pub kind: ColumnType,
}

/// Columns in the order of their first appearance.
#[derive(Debug, Default)]
pub(super) struct Columns {
    columns: Vec<Column>,
    index: HashMap<String, usize>,
}

impl Columns {
    pub fn learn(&mut self, row: &[(String, FieldValue)]) {
        for (name, cell) in row {
            let kind = ColumnType::of(cell);
            match self.index.get(name) {
                Some(place) => self.columns[*place].kind = self.columns[*place].kind.with(kind),
                None => {
                    self.index.insert(name.clone(), self.columns.len());
                    self.columns.push(Column { name: name.clone(), kind });
                }
            }
        }
    }

    pub fn finish(self) -> Vec<Column> {
        self.columns
    }
}

/// A requested column that no topic has, and the most similar name.
#[derive(Debug, PartialEq)]
pub(super) struct Unknown {
    wanted: String,
    nearest: Option<String>,
}

impl Unknown {
    pub fn of(self, recording: &Path) -> RecordingError {
        RecordingError::Column { path: recording.to_owned(), wanted: self.wanted, nearest: self.nearest }
    }
}

/// Keeps the requested columns with the times, and drops topics that have none of them.
pub(super) fn select(topics: &mut BTreeMap<String, Columns>, wanted: &[String]) -> Result<(), Unknown> {
    if wanted.is_empty() {
        return Ok(());
    }
    for wanted in wanted {
        let names = || topics.values().flat_map(|topic| &topic.columns).map(|column| column.name.as_str());
        if !names().any(|name| is_part(name, wanted)) {
            return Err(Unknown { wanted: wanted.clone(), nearest: nearest(wanted, names()).map(str::to_owned) });
        }
    }
    for topic in topics.values_mut() {
        topic.columns.retain(|column| is_time(&column.name) || wanted.iter().any(|wanted| is_part(&column.name, wanted)));
    }
    topics.retain(|_, topic| topic.columns.iter().any(|column| !is_time(&column.name)));
    Ok(())
}

fn is_time(name: &str) -> bool {
    TIMES.contains(&name)
}

/// Whether a column is the wanted one or nested below it.
fn is_part(name: &str, wanted: &str) -> bool {
    name.strip_prefix(wanted).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(names: &[&str]) -> Columns {
        let mut columns = Columns::default();
        let row: Vec<(String, FieldValue)> =
            TIMES.iter().chain(names).map(|name| ((*name).to_owned(), FieldValue::Number(0.0))).collect();
        columns.learn(&row);
        columns
    }

    #[test]
    fn prop_a_column_is_selected_by_its_name_or_a_prefix() {
        let all = || {
            BTreeMap::from([
                ("angles".to_owned(), topic(&["links.crank.chord_rad", "links.rod.chord_rad"])),
                ("loads".to_owned(), topic(&["torque_nm"])),
            ])
        };
        let names = |topics: &BTreeMap<String, Columns>| -> Vec<String> {
            topics.values().flat_map(|topic| topic.columns.iter().map(|column| column.name.clone())).collect()
        };
        let mut topics = all();
        assert_eq!(select(&mut topics, &["links.rod".to_owned()]), Ok(()));
        assert_eq!(names(&topics), ["log_time", "publish_time", "links.rod.chord_rad"]);
        let unknown = select(&mut all(), &["links.rod.chord_rd".to_owned()]).err();
        assert_eq!(unknown.and_then(|unknown| unknown.nearest).as_deref(), Some("links.rod.chord_rad"));
        assert!(select(&mut all(), &["link".to_owned()]).is_err(), "half a word is no name");
    }

    #[test]
    fn prop_a_column_has_one_type() {
        let mut columns = Columns::default();
        for cell in [FieldValue::Integer(1), FieldValue::Number(0.5), FieldValue::Integer(2)] {
            columns.learn(&[("x".to_owned(), cell)]);
        }
        assert_eq!(columns.finish(), [Column { name: "x".to_owned(), kind: ColumnType::Number }]);
    }
}
