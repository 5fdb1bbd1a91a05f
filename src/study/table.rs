//! Numbers in named columns: what studies produce, files hold and plots draw.

use std::path::{Path, PathBuf};

/// Columns of equal length; units are in the names, as in `piston_acceleration_m_per_s2`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    columns: Vec<(String, Vec<f64>)>,
}

/// A table could not be written or read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {cause}", path.display())]
pub struct TableError {
    path: PathBuf,
    cause: csv::Error,
}

impl Table {
    /// Adds a column.
    pub fn push(&mut self, name: impl Into<String>, values: Vec<f64>) {
        self.columns.push((name.into(), values));
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
        self.columns.iter().map(|(_, values)| values.len()).max().unwrap_or(0)
    }

    /// Writes it as CSV: a header row, then numbers that read back to the same bits. Cells beyond a column's end are empty.
    ///
    /// # Errors
    /// [`TableError`] when the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), TableError> {
        let error = |cause| TableError { path: path.to_owned(), cause };
        let mut writer = csv::Writer::from_path(path).map_err(error)?;
        writer.write_record(self.columns.iter().map(|(name, _)| name)).map_err(error)?;
        for row in 0..self.rows() {
            let cell = |(_, values): &(String, Vec<f64>)| values.get(row).map(f64::to_string).unwrap_or_default();
            writer.write_record(self.columns.iter().map(cell)).map_err(error)?;
        }
        writer.flush().map_err(|cause| error(cause.into()))
    }

    /// Reads what [`Table::write_csv`] wrote; a cell that is not a number is NaN.
    ///
    /// # Errors
    /// [`TableError`] when the file cannot be read as CSV.
    pub fn read_csv(path: &Path) -> Result<Self, TableError> {
        let error = |cause| TableError { path: path.to_owned(), cause };
        let mut reader = csv::Reader::from_path(path).map_err(error)?;
        let names = reader.headers().map_err(error)?.clone();
        let mut columns: Vec<(String, Vec<f64>)> = names.iter().map(|name| (name.to_owned(), Vec::new())).collect();
        for record in reader.records() {
            for (cell, (_, values)) in record.map_err(error)?.iter().zip(&mut columns) {
                values.push(cell.parse().unwrap_or(f64::NAN));
            }
        }
        Ok(Table { columns })
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
        table.push("a_m", vec![0.1, 1e-300, -2.0 / 3.0]);
        table.push("b_n", vec![f64::MAX, -0.0, 5e-324]);
        table.write_csv(&path)?;
        assert_eq!(Table::read_csv(&path)?, table);
        Ok(())
    }
}
