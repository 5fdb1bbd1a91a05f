//! A table as Parquet: typed columns, in compressed row groups of bounded size.
//!
//! A small part of the format is enough for it: one page a column and row group, no dictionaries, no nesting.
//! <https://parquet.apache.org/docs/file-format/>

mod cells;
mod footer;
mod thrift;

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::PathBuf;

use super::Sheet;
use super::learn::Column;
use crate::recording::RecordingError;
use crate::recording::rows::Cell;
use cells::Cells;
use footer::{Chunk, RowGroup};

const MAGIC: &[u8] = b"PAR1";
/// What rows of a table may wait in memory before they are written as a row group, bytes.
const ROW_GROUP_BYTES: usize = 8 * 1024 * 1024;
/// Of zstd: fast.
const LEVEL: i32 = 1;

/// A Parquet file; cells that a message left out are null.
pub(super) struct ParquetSheet {
    path: PathBuf,
    file: BufWriter<File>,
    /// Bytes written so far.
    at: usize,
    columns: Vec<Column>,
    cells: Vec<Cells>,
    /// What waits in `cells`, bytes.
    waiting: usize,
    groups: Vec<RowGroup>,
}

impl ParquetSheet {
    pub fn create(path: PathBuf, columns: &[Column]) -> Result<Self, RecordingError> {
        let file = BufWriter::new(File::create(&path).map_err(RecordingError::file(&path))?);
        let cells = columns.iter().map(|column| Cells::new(column.kind)).collect();
        let mut sheet = ParquetSheet { path, file, at: 0, columns: columns.to_vec(), cells, waiting: 0, groups: Vec::new() };
        sheet.put(MAGIC).map_err(RecordingError::file(&sheet.path))?;
        Ok(sheet)
    }

    fn put(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.at += bytes.len();
        self.file.write_all(bytes)
    }

    /// Writes the rows that wait, if any, as a row group.
    fn write_group(&mut self) -> std::io::Result<()> {
        let rows = self.cells.first().map_or(0, Cells::rows);
        if rows == 0 {
            return Ok(());
        }
        let mut chunks = Vec::with_capacity(self.cells.len());
        for n in 0..self.cells.len() {
            let start = self.at;
            let page = self.cells[n].take_page();
            let compressed = zstd::bulk::compress(&page, LEVEL)?;
            let header = footer::page_header(rows, page.len(), compressed.len());
            self.put(&header)?;
            self.put(&compressed)?;
            chunks.push(Chunk { start, bytes: self.at - start, uncompressed_bytes: header.len() + page.len() });
        }
        self.groups.push(RowGroup { rows, chunks });
        self.waiting = 0;
        Ok(())
    }

    fn close(&mut self) -> std::io::Result<()> {
        self.write_group()?;
        let footer = footer::footer(&self.columns, &self.groups);
        self.put(&footer)?;
        self.put(&(footer.len() as u32).to_le_bytes())?;
        self.put(MAGIC)?;
        self.file.flush()
    }
}

impl Sheet for ParquetSheet {
    fn write(&mut self, cells: &[Option<&Cell>]) -> Result<(), RecordingError> {
        self.waiting += self.cells.iter_mut().zip(cells).map(|(column, cell)| column.push(*cell)).sum::<usize>();
        if self.waiting >= ROW_GROUP_BYTES {
            self.write_group().map_err(RecordingError::file(&self.path))?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<PathBuf, RecordingError> {
        self.close().map_err(RecordingError::file(&self.path))?;
        Ok(self.path)
    }
}
