//! Numbers in named columns, and words that name the rows: what studies produce, files hold and plots draw.

use crate::csv_faults::{broken_row, line_at, other_separator};
use crate::decimal_comma::decimal_comma_hint;
use crate::text_file;
use crate::whole_file::WholeFile;
use std::io;
use std::path::{Path, PathBuf};

/// Size limit of a table that is read, bytes.
const SIZE_LIMIT: usize = 256 * 1024 * 1024;

/// Columns of equal length; units are in the names, as in `piston_acceleration_m_per_s2`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    words: Vec<(String, Vec<String>)>,
    columns: Vec<(String, Vec<f64>)>,
}

/// A table could not be written or read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {cause}", path.display())]
pub struct TableError {
    path: PathBuf,
    cause: csv::Error,
}

/// A number as text that reads back to the same bits, with an exponent where zeros would fill the cell.
fn shortest(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-5..1e16).contains(&size) && size.is_finite() { format!("{value:e}") } else { value.to_string() }
}

/// The reason why a first row does not name columns.
fn not_names(row: &csv::StringRecord) -> Option<&'static str> {
    let is_number = |cell: &str| cell.trim().parse::<f64>().is_ok();
    let no_header = "the first line has numbers: a header with the columns' names is needed";
    other_separator(row).or((!row.is_empty() && row.iter().all(is_number)).then_some(no_header))
}

/// A hint at the decimal point if cells are numbers, and some have a comma in its place.
fn decimal_commas(cells: &[String]) -> Option<String> {
    let hint = cells.iter().filter(|cell| cell.contains(',')).find_map(|cell| decimal_comma_hint(cell.trim()))?;
    let is_number = |cell: &String| {
        let pointed = cell.trim().replacen(',', ".", 1);
        pointed.is_empty() || pointed.parse::<f64>().is_ok_and(f64::is_finite)
    };
    cells.iter().all(is_number).then_some(hint)
}

impl Table {
    /// Adds a column.
    pub fn push(&mut self, name: impl Into<String>, values: Vec<f64>) {
        self.columns.push((name.into(), values));
    }

    /// Adds a column of words; these stand before all numbers.
    pub fn push_words(&mut self, name: impl Into<String>, words: Vec<String>) {
        self.words.push((name.into(), words));
    }

    /// The column of words of this name.
    pub fn words(&self, name: &str) -> Option<&[String]> {
        self.word_columns().find(|(other, _)| *other == name).map(|(_, words)| words)
    }

    /// Names and words, in order.
    pub fn word_columns(&self) -> impl Iterator<Item = (&str, &[String])> {
        self.words.iter().map(|(name, words)| (name.as_str(), words.as_slice()))
    }

    /// The columns of words that are numbers with a comma in place of the decimal point, as spreadsheets quote them, each with a hint.
    pub fn with_decimal_commas(&self) -> impl Iterator<Item = (&str, String)> {
        self.word_columns().filter_map(|(name, words)| Some((name, decimal_commas(words)?)))
    }

    /// Names and values, in order.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.columns.iter().map(|(name, values)| (name.as_str(), values.as_slice()))
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns().find(|(other, _)| *other == name).map(|(_, values)| values)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        let words = self.words.iter().map(|(_, words)| words.len());
        self.columns.iter().map(|(_, values)| values.len()).chain(words).max().unwrap_or(0)
    }

    /// Keeps these rows.
    pub fn keep_rows(&mut self, is_kept: &[bool]) {
        fn keep<T>(values: &mut Vec<T>, is_kept: &[bool]) {
            let mut kept = is_kept.iter().copied();
            values.retain(|_| kept.next().unwrap_or(true));
        }
        self.words.iter_mut().for_each(|(_, words)| keep(words, is_kept));
        self.columns.iter_mut().for_each(|(_, values)| keep(values, is_kept));
    }

    /// Writes it as CSV: a header row, then words and numbers that read back to the same bits. Cells of NaN and beyond a column's
    /// end are empty.
    ///
    /// # Errors
    /// [`TableError`] when the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), TableError> {
        let error = |cause| TableError { path: path.to_owned(), cause };
        let file = WholeFile::create(path).map_err(|cause| error(cause.into()))?;
        let mut writer = csv::Writer::from_writer(file);
        let names = self.words.iter().map(|(name, _)| name).chain(self.columns.iter().map(|(name, _)| name));
        writer.write_record(names).map_err(error)?;
        for row in 0..self.rows() {
            let number = |(_, values): &(String, Vec<f64>)| {
                values.get(row).filter(|value| !value.is_nan()).map(|value| shortest(*value)).unwrap_or_default()
            };
            let word = |(_, words): &(String, Vec<String>)| words.get(row).cloned().unwrap_or_default();
            writer.write_record(self.words.iter().map(word).chain(self.columns.iter().map(number))).map_err(error)?;
        }
        let file = writer.into_inner().map_err(|refused| error(refused.into_error().into()))?;
        file.finish().map_err(|cause| error(cause.into()))
    }

    /// The rows as JSON objects by column; numbers that are not finite, and empty words, are null.
    pub fn rows_as_json(&self) -> Vec<serde_json::Value> {
        let word = |words: &[String], row: usize| match words.get(row).filter(|word| !word.is_empty()) {
            Some(word) => serde_json::Value::from(word.as_str()),
            None => serde_json::Value::Null,
        };
        let number = |values: &[f64], row: usize| serde_json::Value::from(values.get(row).copied().unwrap_or(f64::NAN));
        let row = |row: usize| {
            let words = self.words.iter().map(|(name, words)| (name.clone(), word(words, row)));
            let numbers = self.columns.iter().map(|(name, values)| (name.clone(), number(values, row)));
            words.chain(numbers).collect()
        };
        (0..self.rows()).map(row).collect()
    }

    /// Reads what [`Table::write_csv`] wrote: columns without a number, and those with decimal commas, are words; elsewhere, a cell that is not a number is NaN.
    ///
    /// # Errors
    /// [`TableError`] when the file cannot be read as CSV with a header row.
    pub fn read_csv(path: &Path) -> Result<Self, TableError> {
        let error = |cause| TableError { path: path.to_owned(), cause };
        let text = text_file::read(path, SIZE_LIMIT).map_err(|cause| error(cause.into()))?;
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let names = reader.headers().map_err(error)?.clone();
        let refuse = |why: String| error(io::Error::new(io::ErrorKind::InvalidData, why).into());
        if let Some(why) = not_names(&names) {
            return Err(refuse(why.to_owned()));
        }
        let broken = |broken: csv::Error| {
            let line =
                broken.position().map_or(String::new(), |position| format!("line {}: ", line_at(&text, position.byte(), false)));
            refuse(format!("{line}{}", broken_row(&broken)))
        };
        let mut cells: Vec<(String, Vec<String>)> = names.iter().map(|name| (name.to_owned(), Vec::new())).collect();
        for record in reader.records() {
            for (cell, (_, column)) in record.map_err(broken)?.iter().zip(&mut cells) {
                column.push(cell.to_owned());
            }
        }
        let is_words =
            |cells: &[String]| cells.iter().any(|cell| !cell.is_empty()) && cells.iter().all(|cell| cell.parse::<f64>().is_err());
        let is_words = |cells: &[String]| is_words(cells) || decimal_commas(cells).is_some();
        let mut table = Table::default();
        for (name, cells) in cells {
            if is_words(&cells) {
                table.push_words(name, cells);
            } else {
                table.push(name, cells.iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect());
            }
        }
        Ok(table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_numbers_read_back_to_the_same_bits() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("table.csv");
        let mut table = Table::default();
        table.push_words("model", ["rigid", "", "with, comma"].map(str::to_owned).to_vec());
        table.push("a_m", vec![0.1, 1e-300, -2.0 / 3.0]);
        table.push("b_n", vec![f64::MAX, -0.0, 5e-324]);
        table.write_csv(&path)?;
        assert_eq!(Table::read_csv(&path)?, table);
        Ok(())
    }
}
