//! Recordings in memory: all numbers of every topic, column by column.

use std::collections::BTreeMap;
use std::path::Path;

use indexmap::IndexMap;

use super::RecordingError;
use super::rows::{Decoder, Row, TimeRange};

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
    /// Column names and values. Times are in seconds since 1970; a missing or non-numeric field is NaN.
    pub columns: Vec<(String, Vec<f64>)>,
}

/// Reads all messages of a recording.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read, is empty, or a message does not fit its schema.
pub fn read_columns(recording: &Path) -> Result<Contents, RecordingError> {
    let mut decoder = Decoder::new(recording, TimeRange::WHOLE);
    let mut topics: BTreeMap<String, ColumnBuilder> = BTreeMap::new();
    let cut_off = decoder.each_row(|topic, row| {
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
    columns: IndexMap<String, Vec<f64>>,
    rows: usize,
}

impl ColumnBuilder {
    fn take(&mut self, row: &Row) {
        for (name, cell) in row {
            let column = match self.columns.get_mut(name) {
                Some(column) => column,
                None => self.columns.entry(name.clone()).or_default(),
            };
            column.resize(self.rows, f64::NAN);
            column.push(cell.number());
        }
        self.rows += 1;
    }

    fn finish(mut self, name: String) -> TopicColumns {
        self.columns.values_mut().for_each(|column| column.resize(self.rows, f64::NAN));
        TopicColumns { name, columns: self.columns.into_iter().collect() }
    }
}
