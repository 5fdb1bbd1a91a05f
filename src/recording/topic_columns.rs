//! Recordings in memory: all numbers of every topic, column by column.

use std::collections::BTreeMap;
use std::path::Path;

use indexmap::IndexMap;

use super::RecordingError;
use super::rows::{Decoder, FieldValue, Row, TimeRange, place_of};

/// Most different texts that a column may hold and still have numbers.
const MOST_TEXTS: usize = 32;

/// The numbers of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// One entry per protobuf topic.
    pub topics: Vec<TopicColumns>,
    /// Whether the recording ended early.
    pub cut_off: bool,
    /// Topics skipped because their messages are not protobuf.
    pub skipped: Vec<String>,
}

/// The numbers of one topic. The columns are those of [`export`](super::export()), all of equal length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TopicColumns {
    /// Key expression.
    pub name: String,
    /// Column names and values. Times are in seconds since 1970; a text is its place among the texts of its column; a missing
    /// field is NaN, and so is a flag.
    pub columns: Vec<(String, Vec<f64>)>,
    /// The texts of columns that hold texts, in the order in which they occur; only of columns with at most 32 of them.
    pub texts: Vec<(String, Vec<String>)>,
}

/// Reads all messages of a recording. `progress` is called with the part that is done, from 0 to 1.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read, is empty, or a message does not fit its schema.
pub fn read_columns(recording: &Path, progress: &dyn Fn(f64)) -> Result<Contents, RecordingError> {
    let mut decoder = Decoder::new(recording, TimeRange::WHOLE);
    let mut topics: BTreeMap<String, ColumnBuilder> = BTreeMap::new();
    let cut_off = decoder.each_row(progress, |topic, row| {
        topics.entry(topic.to_owned()).or_default().take(row);
        Ok(())
    })?;
    if topics.is_empty() {
        return Err(decoder.no_rows());
    }
    let topics = topics.into_iter().map(|(name, filling)| filling.finish(name)).collect();
    Ok(Contents { topics, cut_off, skipped: decoder.skipped.into_iter().collect() })
}

/// The columns of a topic while rows are added.
#[derive(Default)]
struct ColumnBuilder {
    columns: IndexMap<String, Column>,
    rows: usize,
}

#[derive(Default)]
struct Column {
    values: Vec<f64>,
    texts: Vec<String>,
}

impl Column {
    /// The number of a cell: of a text, its place among the column's texts.
    fn number(&mut self, cell: &FieldValue) -> f64 {
        let FieldValue::Text(text) = cell else { return cell.number() };
        let known = self.texts.iter().position(|known| known == text);
        let place = known.or_else(|| {
            let room = self.texts.len() <= MOST_TEXTS;
            room.then(|| self.texts.push(text.clone())).map(|()| self.texts.len() - 1)
        });
        place.map_or(f64::NAN, |place| place as f64)
    }

    /// Its values, and its texts if it has few.
    fn finish(mut self, rows: usize) -> (Vec<f64>, Vec<String>) {
        if self.texts.len() > MOST_TEXTS {
            return (vec![f64::NAN; rows], Vec::new());
        }
        self.values.resize(rows, f64::NAN);
        (self.values, self.texts)
    }
}

impl ColumnBuilder {
    fn take(&mut self, row: &Row) {
        for (place, (name, cell)) in row.cells().enumerate() {
            let place = place_of(&self.columns, place, name);
            let column = match place.and_then(|place| self.columns.get_index_mut(place)) {
                Some((_, column)) => column,
                None => self.columns.entry(name.to_owned()).or_default(),
            };
            column.values.resize(self.rows, f64::NAN);
            let number = column.number(cell);
            column.values.push(number);
        }
        self.rows += 1;
    }

    fn finish(self, name: String) -> TopicColumns {
        let mut topic = TopicColumns { name, ..TopicColumns::default() };
        for (name, column) in self.columns {
            let (values, texts) = column.finish(self.rows);
            if !texts.is_empty() {
                topic.texts.push((name.clone(), texts));
            }
            topic.columns.push((name, values));
        }
        topic
    }
}
