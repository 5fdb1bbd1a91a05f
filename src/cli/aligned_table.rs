//! Aligned tables in the terminal.

use std::io::{self, Write as _};

use super::output::output;
pub(super) use crate::shown::figure;
use crate::shown::shown_name;

/// Prints rows in aligned columns: those before column `figures` to the left, the others to the right. A cell may be a name from outside.
pub(super) fn print(rows: &[Vec<String>], figures: usize) -> io::Result<()> {
    let rows = as_shown(rows);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = output();
    for row in &rows {
        let pad = |(column, (cell, &width)): (usize, (&String, &usize))| {
            if column < figures { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        };
        let cells: Vec<String> = row.iter().zip(&widths).enumerate().map(pad).collect();
        writeln!(out, "  {}", cells.join("  ").trim_end())?;
    }
    Ok(())
}

/// Columns of a terminal that every table fits.
const WIDTH: usize = 80;
/// Fewest characters that a cut cell keeps.
const LEAST: usize = 12;

/// Prints rows of words within 80 columns: the last column, and then the widest, is cut in front, where paths have their folders.
pub(super) fn print_narrow(rows: &[Vec<String>]) -> io::Result<()> {
    print(&narrowed(&as_shown(rows)), usize::MAX)
}

fn as_shown(rows: &[Vec<String>]) -> Vec<Vec<String>> {
    rows.iter().map(|row| row.iter().map(|cell| shown_name(cell).to_string()).collect()).collect()
}

/// The rows with cells cut until they fit.
fn narrowed(rows: &[Vec<String>]) -> Vec<Vec<String>> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let mut widths: Vec<usize> = (0..columns).map(width).collect();
    while widths.iter().sum::<usize>() + 2 * columns > WIDTH {
        let cut = match widths.last_mut() {
            Some(last) if *last > LEAST => Some(last),
            _ => widths.iter_mut().max().filter(|widest| **widest > LEAST),
        };
        let Some(cut) = cut else { break };
        *cut -= 1;
    }
    let cut = |(cell, &width): (&String, &usize)| {
        let length = cell.chars().count();
        if length <= width {
            cell.clone()
        } else {
            cell.chars().skip(length + 1 - width).fold("…".to_owned(), |cut, c| cut + &c.to_string())
        }
    };
    rows.iter().map(|row| row.iter().zip(&widths).map(cut).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::narrowed;

    #[test]
    fn prop_narrow_tables_keep_the_ends_of_long_cells() {
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let long = "recordings/a-very-long-name-of-a-service-that-records-20260101T120000Z.mcap";
        let rows = narrowed(&[row(["name", "scene", "recording"]), row(["crank", "crank-slider", long])]);
        let length: usize = rows[1].iter().map(|cell| cell.chars().count() + 2).sum();
        assert!(length <= 80 && rows[1][2].starts_with('…') && rows[1][2].ends_with("T120000Z.mcap"), "{rows:?}");
        assert_eq!(rows[1][..2], row(["crank", "crank-slider", ""])[..2]);
        assert_eq!(narrowed(&[row(["a", "b", "c"])]), [row(["a", "b", "c"])]);
    }
}
