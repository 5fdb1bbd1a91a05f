//! Export of recordings: one wide table per topic, as CSV or Parquet, decoded by the schemas in the file; and a file for ROS 2.

mod column_types;
mod csv;
mod parquet;
mod ros2;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub(crate) use self::csv::CsvSheet;
use super::rows::{Decoder, FieldValue, Row, TimeRange, place_of};
use super::{RecordingError, RecordingFile, writer::Written};
use crate::whole_file::not_made;
pub(crate) use column_types::{ColumnType, Columns};
use column_types::{learn, select};
pub(crate) use parquet::ParquetSheet;

/// Options of an export.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Export {
    /// Folder for CSV tables.
    pub csv: Option<PathBuf>,
    /// Folder for Parquet tables.
    pub parquet: Option<PathBuf>,
    /// MCAP file with messages of ROS 2.
    pub ros2: Option<PathBuf>,
    /// Start, s since the first message.
    pub from_s: f64,
    /// End, s since the first message.
    pub to_s: Option<f64>,
    /// Keep one row per topic in each period of this length, s: the first.
    pub every_s: Option<f64>,
    /// Columns of tables: names, or groups before a dot (`links.crank` for `links.crank.chord_rad`); empty exports all. Times are
    /// always included.
    pub columns: Vec<String>,
}

/// The result of an export.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Exported {
    /// One table per topic and format.
    pub tables: Vec<Written>,
    /// Number of tables that replaced one of the same name.
    pub replaced: usize,
    /// The file for ROS 2.
    pub ros2: Option<Written>,
    /// Whether the recording ended early.
    pub cut_off: bool,
    /// Topics skipped because their messages are not protobuf.
    pub skipped: Vec<String>,
}

/// Writes tables and a file for ROS 2, as far as they are wanted.
///
/// Tables of the same names are replaced. They are `FOLDER/<topic, with dots for slashes>.csv`, and `.parquet`, for every protobuf topic of a recording. The columns `log_time` and `publish_time` come first. Every scalar of the message follows under its dotted name, with one type
/// throughout: integer, number, boolean, text or time. The file is read twice: for the columns, since messages may omit fields,
/// and for the rows. `progress` is called with the part of the work that is done, from 0 to 1.
///
/// # Errors
/// [`RecordingError`] if the recording cannot be read, a message does not fit its schema, a requested time or column does not
/// exist, or a table cannot be written.
pub fn export(recording: &Path, export: &Export, progress: &dyn Fn(f64)) -> Result<Exported, RecordingError> {
    let part = TimeRange::new(export.from_s, export.to_s, export.every_s);
    let with_tables = export.csv.is_some() || export.parquet.is_some();
    let before_ros2 = if with_tables { 2.0 } else { 0.0 };
    let readings = before_ros2 + if export.ros2.is_some() { 1.0 } else { 0.0 };
    let at = |done: f64| progress(done / readings);
    let mut exported = if with_tables { tables(recording, export, part, &at)? } else { Exported::default() };
    if let Some(to) = &export.ros2 {
        let (written, cut_off) = ros2::export(recording, to, part, &|done| at(before_ros2 + done))?;
        exported.cut_off |= cut_off;
        exported.ros2 = Some(written);
    }
    Ok(exported)
}

/// Writes the tables; `progress` is called with the readings that are done, from 0 to 2.
fn tables(recording: &Path, export: &Export, part: TimeRange, progress: &dyn Fn(f64)) -> Result<Exported, RecordingError> {
    let mut decoder = Decoder::new(recording, part);
    let mut topics: BTreeMap<String, Columns> = BTreeMap::new();
    let cut_off = decoder.each_row(progress, |topic, row| {
        learn(topics.entry(topic.to_owned()).or_default(), row.cells());
        Ok(())
    })?;
    if topics.is_empty() {
        return Err(empty(recording, export, decoder)?);
    }
    select(&mut topics, &export.columns, recording, &|column| decoder.has_field(column))?;
    let mut tables = BTreeMap::new();
    for (topic, columns) in topics {
        tables.insert(topic.clone(), Table::create(export, &topic, columns)?);
    }
    decoder
        .each_row(&|done| progress(1.0 + done), |topic, row| tables.get_mut(topic).map_or(Ok(()), |table| table.write(row)))?;
    let (mut written, mut replaced) = (Vec::new(), 0);
    for table in tables.into_values() {
        replaced += table.replaces;
        table.finish(&mut written)?;
    }
    Ok(Exported { tables: written, replaced, ros2: None, cut_off, skipped: decoder.skipped.into_iter().collect() })
}

/// The error for an export without rows: the recording has none at the requested times, or none at all.
fn empty(recording: &Path, export: &Export, decoder: Decoder) -> Result<RecordingError, RecordingError> {
    let (path, from_s, to_s) = (recording.to_owned(), export.from_s, export.to_s);
    let duration_s = RecordingFile::open(recording)?.duration_s();
    let outside = from_s > duration_s || to_s.is_some_and(|to_s| to_s < from_s);
    Ok(if outside { RecordingError::Outside { path, from_s, to_s, duration_s } } else { decoder.no_rows() })
}

/// A table file.
pub(crate) trait Sheet {
    /// Writes a row with one optional cell per column.
    fn write(&mut self, cells: &[Option<&FieldValue>]) -> Result<(), RecordingError>;
    /// Closes the file.
    fn finish(self: Box<Self>) -> Result<PathBuf, RecordingError>;
}

/// The table of a topic, in every requested format.
struct Table {
    columns: Columns,
    sheets: Vec<Box<dyn Sheet>>,
    /// Number of sheets whose files exist.
    replaces: usize,
    rows: u64,
}

impl Table {
    fn create(export: &Export, topic: &str, columns: Columns) -> Result<Self, RecordingError> {
        let mut replaces = 0;
        let mut place = |folder: &Path, ending: &str| {
            std::fs::create_dir_all(folder).map_err(|refused| RecordingError::file(folder)(not_made(refused, folder)))?;
            let path = folder.join(format!("{}.{ending}", topic.trim_start_matches('/').replace('/', ".")));
            replaces += usize::from(path.exists());
            Ok(path)
        };
        let mut sheets: Vec<Box<dyn Sheet>> = Vec::new();
        if let Some(folder) = &export.csv {
            sheets.push(Box::new(CsvSheet::create(place(folder, "csv")?, &columns)?));
        }
        if let Some(folder) = &export.parquet {
            sheets.push(Box::new(ParquetSheet::create(place(folder, "parquet")?, &columns)?));
        }
        Ok(Table { columns, sheets, replaces, rows: 0 })
    }

    fn write(&mut self, row: &Row) -> Result<(), RecordingError> {
        let mut cells = vec![None; self.columns.len()];
        for (place, (name, cell)) in row.cells().enumerate() {
            if let Some(column) = place_of(&self.columns, place, name) {
                cells[column] = Some(cell);
            }
        }
        self.rows += 1;
        self.sheets.iter_mut().try_for_each(|sheet| sheet.write(&cells))
    }

    fn finish(self, written: &mut Vec<Written>) -> Result<(), RecordingError> {
        for sheet in self.sheets {
            written.push(Written { path: sheet.finish()?, messages: self.rows, limited: false });
        }
        Ok(())
    }
}
