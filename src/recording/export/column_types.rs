//! Columns of exported tables: their names, types and selection.

use std::collections::BTreeMap;
use std::path::Path;

use indexmap::IndexMap;

use crate::nearest::column_hint;
use crate::recording::RecordingError;
use crate::recording::rows::{FieldValue, TIMES, is_stamp_or_time, place_of};

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ColumnType {
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

/// Columns with their types, in the order of their first appearance.
pub(crate) type Columns = IndexMap<String, ColumnType>;

/// Adds the columns of a row.
pub(super) fn learn<'a>(columns: &mut Columns, cells: impl Iterator<Item = (&'a str, &'a FieldValue)>) {
    for (place, (name, cell)) in cells.enumerate() {
        let kind = ColumnType::of(cell);
        match place_of(columns, place, name).and_then(|place| columns.get_index_mut(place)) {
            Some((_, known)) => *known = known.with(kind),
            None => _ = columns.insert(name.to_owned(), kind),
        }
    }
}

/// Column of the simulated time of a message.
const SIMULATED_TIME: &str = "stamp.sim_time_s";

/// Keeps the requested columns of a recording with the times, simulated time among them, and drops topics that have none of them. A stamp counts only if no
/// topic has another requested column.
///
/// # Errors
/// [`RecordingError`] if no topic has a requested column; which one depends on `has_field`: whether a message could have it.
pub(super) fn select(
    topics: &mut BTreeMap<String, Columns>,
    wanted: &[String],
    recording: &Path,
    has_field: &dyn Fn(&str) -> bool,
) -> Result<(), RecordingError> {
    if wanted.is_empty() {
        return Ok(());
    }
    for wanted in wanted {
        if !has_column(topics, wanted) {
            return Err(missing(topics, wanted, recording, has_field));
        }
    }
    let is_asked = |name: &str| is_time(name) || wanted.iter().any(|wanted| is_part(name, wanted));
    let has_other = |columns: &Columns, kind: fn(&str) -> bool| columns.keys().any(|name| is_asked(name) && !kind(name));
    // Beside data, stamps and times make no table; nor do times beside stamps. Times alone are asked for of every topic.
    let kinds: [fn(&str) -> bool; 2] = [is_stamp_or_time, is_time];
    if let Some(kind) = kinds.into_iter().find(|kind| topics.values().any(|columns| has_other(columns, *kind))) {
        topics.retain(|_, columns| has_other(columns, kind));
    }
    for columns in topics.values_mut() {
        columns.retain(|name, _| is_asked(name) || name == SIMULATED_TIME);
    }
    Ok(())
}

/// Whether a topic has a column, or a group of columns.
fn has_column(topics: &BTreeMap<String, Columns>, wanted: &str) -> bool {
    topics.values().flat_map(Columns::keys).any(|name| is_part(name, wanted))
}

/// The error for a column that no topic has: no message has this field, or there is no such field.
fn missing(
    topics: &BTreeMap<String, Columns>,
    wanted: &str,
    recording: &Path,
    has_field: &dyn Fn(&str) -> bool,
) -> RecordingError {
    let (path, wanted) = (recording.to_owned(), wanted.to_owned());
    let has_group = wanted.rsplit_once('.').is_none_or(|(group, _)| has_column(topics, group));
    if has_group && has_field(&wanted) {
        return RecordingError::Absent { path, wanted };
    }
    let columns: Vec<(&str, Vec<&str>)> =
        topics.iter().map(|(topic, columns)| (topic.as_str(), columns.keys().map(String::as_str).collect())).collect();
    RecordingError::Column { hint: column_hint(&wanted, &columns), path, wanted }
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
        TIMES.iter().chain(names).map(|name| ((*name).to_owned(), ColumnType::Number)).collect()
    }

    #[test]
    fn prop_a_column_is_selected_by_its_name_or_the_group_before_a_dot() {
        let select = |wanted: &str| {
            let mut topics = BTreeMap::from([
                ("angles".to_owned(), topic(&["links.crank.chord_rad", "links.rod.chord_rad"])),
                ("loads".to_owned(), topic(&["torque_nm"])),
            ]);
            select(&mut topics, &[wanted.to_owned()], Path::new("r"), &|name| name.ends_with("rate_rad_per_s"))?;
            Ok(topics.into_values().flat_map(IndexMap::into_keys).collect::<Vec<String>>())
        };
        assert_eq!(
            select("links.rod").ok().as_deref(),
            Some(&["log_time", "publish_time", "links.rod.chord_rad"].map(String::from)[..])
        );
        let Err(RecordingError::Column { hint, .. }) = select("links.rod.chord_rd") else { panic!("a misspelt column") };
        assert_eq!(hint, "; did you mean `links.rod.chord_rad`?");
        assert!(select("link").is_err(), "half a word is no name");
        assert!(matches!(select("links.rod.rate_rad_per_s"), Err(RecordingError::Absent { .. })), "no message has this field");
        assert!(matches!(select("links.beam.rate_rad_per_s"), Err(RecordingError::Column { .. })), "there is no such link");
    }

    #[test]
    fn prop_stamps_make_no_table_beside_data() {
        let select = |wanted: &[&str]| {
            let mut topics = BTreeMap::from([
                ("angles".to_owned(), topic(&["stamp.step", SIMULATED_TIME, "links.crank.chord_rad"])),
                ("foreign".to_owned(), topic(&["height_m"])),
                ("loads".to_owned(), topic(&["stamp.step", "torque_nm"])),
            ]);
            let wanted: Vec<String> = wanted.iter().map(|name| (*name).to_owned()).collect();
            select(&mut topics, &wanted, Path::new("r"), &|_| false)?;
            let kept = topics.into_iter().map(|(topic, columns)| (topic, columns.len() - TIMES.len()));
            Ok::<_, RecordingError>(kept.collect::<Vec<(String, usize)>>())
        };
        for (wanted, kept) in [
            (&["stamp.step", "links.crank"][..], &[("angles", 3)][..]),
            (&["links.crank"], &[("angles", 2)]),
            (&["log_time", "torque_nm"], &[("loads", 1)]),
            (&["stamp.step"], &[("angles", 2), ("loads", 1)]),
            (&["log_time", "stamp"], &[("angles", 2), ("loads", 1)]),
            (&["log_time"], &[("angles", 1), ("foreign", 0), ("loads", 0)]),
        ] {
            let kept: Vec<(String, usize)> = kept.iter().map(|(topic, columns)| ((*topic).to_owned(), *columns)).collect();
            assert_eq!(select(wanted).ok(), Some(kept), "{wanted:?}");
        }
    }

    #[test]
    fn prop_a_column_has_one_type() {
        let mut columns = Columns::new();
        for cell in [FieldValue::Integer(1), FieldValue::Number(0.5), FieldValue::Integer(2)] {
            learn(&mut columns, [("x", &cell)].into_iter());
        }
        assert_eq!(columns.into_iter().collect::<Vec<_>>(), [("x".to_owned(), ColumnType::Number)]);
    }
}
