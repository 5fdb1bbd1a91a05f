//! Parquet tables: typed columns, in compressed row groups of bounded size.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};

use super::Sheet;
use super::column_types::{ColumnType, Columns};
use crate::recording::RecordingError;
use crate::recording::rows::FieldValue;
use crate::whole_file::WholeFile;

/// Size of the buffered rows at which a row group is written, bytes.
const ROW_GROUP_BYTES: usize = 8 * 1024 * 1024;

/// A Parquet file; missing fields are null.
pub(crate) struct ParquetSheet {
    path: PathBuf,
    file: SerializedFileWriter<Lent>,
    columns: Vec<Cells>,
    /// Size of the buffered rows, bytes.
    waiting: usize,
}

impl ParquetSheet {
    pub fn create(path: PathBuf, columns: &Columns) -> Result<Self, RecordingError> {
        let file = WholeFile::create(&path).map_err(RecordingError::file(&path))?;
        let properties = WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default())).build();
        let cells = columns.values().copied().map(Cells::new).collect();
        let opened = schema(columns).and_then(|schema| SerializedFileWriter::new(Lent(Some(file)), schema, Arc::new(properties)));
        let file = opened.map_err(|error| refused(&path, error))?;
        Ok(ParquetSheet { path, file, columns: cells, waiting: 0 })
    }

    /// Writes the buffered rows as a row group.
    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.file.next_row_group()?;
        for cells in &mut self.columns {
            if let Some(mut column) = group.next_column()? {
                cells.write(&mut column)?;
                column.close()?;
            }
        }
        group.close()?;
        self.waiting = 0;
        Ok(())
    }
}

impl Sheet for ParquetSheet {
    fn write(&mut self, cells: &[Option<&FieldValue>]) -> Result<(), RecordingError> {
        self.waiting += self.columns.iter_mut().zip(cells).map(|(column, cell)| column.push(*cell)).sum::<usize>();
        if self.waiting >= ROW_GROUP_BYTES {
            self.write_group().map_err(|error| refused(&self.path, error))?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<PathBuf, RecordingError> {
        let written = if self.waiting > 0 { self.write_group() } else { Ok(()) };
        let ParquetSheet { path, mut file, .. } = *self;
        written.and_then(|()| file.finish().map(drop)).map_err(|error| refused(&path, error))?;
        let whole = file.inner_mut().0.take();
        whole.map_or(Ok(()), WholeFile::finish).map_err(RecordingError::file(&path))?;
        Ok(path)
    }
}

/// A file that is taken back once all is written. The library would write the last bytes as it gives the file back, and put the
/// system's error into words of its own.
struct Lent(Option<WholeFile>);

impl Lent {
    fn file(&mut self) -> io::Result<&mut WholeFile> {
        self.0.as_mut().ok_or_else(|| io::Error::other("the file is finished"))
    }
}

impl Write for Lent {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file()?.flush()
    }
}

/// The error of a file: the system's own, where the library wraps that.
fn refused(path: &Path, error: ParquetError) -> RecordingError {
    let cause = match error {
        ParquetError::External(cause) => cause.downcast::<io::Error>().map_or_else(io::Error::other, |cause| *cause),
        other => io::Error::other(other),
    };
    RecordingError::file(path)(cause)
}

/// A flat schema in which every column is optional.
fn schema(columns: &Columns) -> Result<TypePtr, ParquetError> {
    let field = |(name, kind): (&String, &ColumnType)| {
        let (physical, logical) = match kind {
            ColumnType::Integer => (Physical::INT64, None),
            ColumnType::Time => (Physical::INT64, Some(LogicalType::timestamp(true, TimeUnit::NANOS))),
            ColumnType::Number => (Physical::DOUBLE, None),
            ColumnType::Flag => (Physical::BOOLEAN, None),
            ColumnType::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
        Ok(Arc::new(field.with_logical_type(logical).build()?))
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<_>, ParquetError>>()?;
    Ok(Arc::new(Type::group_type_builder("row").with_fields(fields).build()?))
}

/// Buffered cells of a column.
struct Cells {
    /// 1 for each row with a value, 0 for each without.
    levels: Vec<i16>,
    values: Values,
}

enum Values {
    Integers(Vec<i64>),
    Numbers(Vec<f64>),
    Flags(Vec<bool>),
    Texts(Vec<ByteArray>),
}

impl Cells {
    fn new(kind: ColumnType) -> Self {
        let values = match kind {
            ColumnType::Integer | ColumnType::Time => Values::Integers(Vec::new()),
            ColumnType::Number => Values::Numbers(Vec::new()),
            ColumnType::Flag => Values::Flags(Vec::new()),
            ColumnType::Text => Values::Texts(Vec::new()),
        };
        Cells { levels: Vec::new(), values }
    }

    /// Adds the cell of the next row, if it has one; returns its approximate size in bytes.
    fn push(&mut self, cell: Option<&FieldValue>) -> usize {
        let size = match (&mut self.values, cell) {
            (Values::Integers(values), Some(FieldValue::Integer(value) | FieldValue::Time(value))) => keep(values, *value),
            (Values::Numbers(values), Some(cell)) => keep(values, cell.number()),
            (Values::Flags(values), Some(FieldValue::Flag(value))) => keep(values, *value),
            (Values::Texts(values), Some(cell)) => {
                let text = cell.to_string().into_bytes();
                text.len() + keep(values, text.into())
            }
            // The column's type was derived from the same cells, so this is a missing value.
            (Values::Integers(_) | Values::Numbers(_) | Values::Flags(_) | Values::Texts(_), _) => 0,
        };
        self.levels.push(i16::from(size > 0));
        size + size_of::<i16>()
    }

    /// Writes and clears the buffered cells.
    fn write(&mut self, column: &mut SerializedColumnWriter) -> Result<(), ParquetError> {
        let levels = &mut self.levels;
        match &mut self.values {
            Values::Integers(values) => write_batch::<Int64Type>(column, values, levels),
            Values::Numbers(values) => write_batch::<DoubleType>(column, values, levels),
            Values::Flags(values) => write_batch::<BoolType>(column, values, levels),
            Values::Texts(values) => write_batch::<ByteArrayType>(column, values, levels),
        }
    }
}

fn write_batch<T: DataType>(
    column: &mut SerializedColumnWriter,
    values: &mut Vec<T::T>,
    levels: &mut Vec<i16>,
) -> Result<(), ParquetError> {
    column.typed::<T>().write_batch(values, Some(levels), None)?;
    values.clear();
    levels.clear();
    Ok(())
}

fn keep<T>(values: &mut Vec<T>, value: T) -> usize {
    values.push(value);
    size_of::<T>()
}

#[cfg(test)]
mod tests {
    use super::super::csv::CsvSheet;
    use super::*;

    /// Fails with the error of a table of this many different numbers, at the latest when it is finished.
    fn written(mut sheet: Box<dyn Sheet>, rows: u32) -> Result<(), String> {
        let mut numbers = (0..rows).map(|row| FieldValue::Number(f64::from(row).sqrt()));
        let filled = numbers.try_for_each(|number| sheet.write(&[Some(&number)]));
        filled.and_then(|()| sheet.finish().map(drop)).map_err(|refused| refused.to_string())
    }

    /// The library's word for a cause, `External`, stood before the system's, and its last bytes failed in other words.
    #[test]
    fn regress_a_full_disk_is_told_in_the_words_of_the_system() -> Result<(), RecordingError> {
        let columns = Columns::from_iter([("x".to_owned(), ColumnType::Number)]);
        let full = PathBuf::from("/dev/full");
        for rows in [1, 10_000] {
            let sheets: [Box<dyn Sheet>; 2] =
                [Box::new(ParquetSheet::create(full.clone(), &columns)?), Box::new(CsvSheet::create(full.clone(), &columns)?)];
            for sheet in sheets {
                let why = "/dev/full: No space left on device (os error 28)".to_owned();
                assert_eq!(written(sheet, rows), Err(why), "{rows} rows");
            }
        }
        Ok(())
    }
}
