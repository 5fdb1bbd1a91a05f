//! CSV tables.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::Sheet;
use super::column_types::Columns;
use crate::recording::RecordingError;
use crate::recording::rows::FieldValue;
use crate::whole_file::WholeFile;

/// A CSV file with a header; missing fields are empty.
pub(crate) struct CsvSheet {
    path: PathBuf,
    writer: csv::Writer<WholeFile>,
}

impl CsvSheet {
    pub fn create(path: PathBuf, columns: &Columns) -> Result<Self, RecordingError> {
        let writer = csv::Writer::from_writer(WholeFile::create(&path).map_err(RecordingError::file(&path))?);
        let mut sheet = CsvSheet { path, writer };
        sheet.line(columns.keys())?;
        Ok(sheet)
    }

    fn line(&mut self, cells: impl IntoIterator<Item = impl AsRef<[u8]>>) -> Result<(), RecordingError> {
        self.writer.write_record(cells).map_err(|error| RecordingError::file(&self.path)(error.into()))
    }
}

impl Sheet for CsvSheet {
    fn write(&mut self, cells: &[Option<&FieldValue>]) -> Result<(), RecordingError> {
        let mut text = String::new();
        for cell in cells {
            text.clear();
            // Writing to a string does not fail.
            cell.iter().for_each(|cell| _ = write!(text, "{cell}"));
            self.writer.write_field(&text).map_err(|error| RecordingError::file(&self.path)(error.into()))?;
        }
        self.line(std::iter::empty::<&[u8]>())
    }

    fn finish(self: Box<Self>) -> Result<PathBuf, RecordingError> {
        let CsvSheet { path, writer } = *self;
        let file = writer.into_inner().map_err(|refused| RecordingError::file(&path)(refused.into_error()))?;
        file.finish().map_err(RecordingError::file(&path))?;
        Ok(path)
    }
}
