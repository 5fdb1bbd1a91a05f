//! Recordings as tables: one wide CSV a topic, decoded by the schemas that the file itself carries.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use super::rows::{Decoder, Row};
use super::{RecordingError, writer::Written};

/// What an export found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// One table a topic.
    pub tables: Vec<Written>,
    /// Whether the recording ended early.
    pub cut_off: bool,
    /// Topics left out because their messages are not protobuf.
    pub skipped: Vec<String>,
}

/// Writes `FOLDER/<topic, with dots for slashes>.csv` for every protobuf topic of a recording.
///
/// The file is read twice: first for the columns, since a message may leave fields out, then for the rows.
///
/// # Errors
/// [`RecordingError`] when the recording cannot be read, a message does not fit its schema, or a table cannot be written.
pub fn export_csv(recording: &Path, folder: &Path) -> Result<Exported, RecordingError> {
    let mut decoder = Decoder::new(recording);
    let mut columns: BTreeMap<String, Columns> = BTreeMap::new();
    let cut_off = decoder.each_row(|topic, row| {
        columns.entry(topic.to_owned()).or_default().learn(row);
        Ok(())
    })?;
    if columns.is_empty() {
        return Err(RecordingError::Empty { path: recording.to_owned() });
    }
    std::fs::create_dir_all(folder).map_err(RecordingError::file(folder))?;
    let mut tables = BTreeMap::new();
    for (topic, columns) in columns {
        tables.insert(topic.clone(), Table::create(folder, &topic, columns)?);
    }
    decoder.each_row(|topic, row| tables.get_mut(topic).map_or(Ok(()), |table| table.write(row)))?;
    let tables = tables.into_values().map(Table::finish).collect::<Result<_, _>>()?;
    Ok(Exported { tables, cut_off, skipped: decoder.skipped })
}

/// Column names in the order in which they were first seen.
#[derive(Default)]
struct Columns {
    names: Vec<String>,
    index: HashMap<String, usize>,
}

impl Columns {
    fn learn(&mut self, row: &Row) {
        for (name, _) in row {
            if !self.index.contains_key(name) {
                self.index.insert(name.clone(), self.names.len());
                self.names.push(name.clone());
            }
        }
    }
}

struct Table {
    path: PathBuf,
    columns: Columns,
    writer: csv::Writer<std::fs::File>,
    rows: u64,
}

impl Table {
    fn create(folder: &Path, topic: &str, columns: Columns) -> Result<Self, RecordingError> {
        let path = folder.join(format!("{}.csv", topic.replace('/', ".")));
        let mut writer = csv::Writer::from_path(&path).map_err(|error| RecordingError::file(&path)(error.into()))?;
        writer.write_record(&columns.names).map_err(|error| RecordingError::file(&path)(error.into()))?;
        Ok(Table { path, columns, writer, rows: 0 })
    }

    fn write(&mut self, row: &Row) -> Result<(), RecordingError> {
        let mut cells = vec![""; self.columns.names.len()];
        for (name, text) in row {
            if let Some(column) = self.columns.index.get(name) {
                cells[*column] = text;
            }
        }
        self.rows += 1;
        self.writer.write_record(cells).map_err(|error| RecordingError::file(&self.path)(error.into()))
    }

    fn finish(mut self) -> Result<Written, RecordingError> {
        self.writer.flush().map_err(RecordingError::file(&self.path))?;
        Ok(Written { path: self.path, messages: self.rows })
    }
}
