//! Aligned tables in the terminal.

use std::io::{self, Write as _};

use super::output::output;
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

/// Formats with six significant digits, and a power of ten only where needed.
pub(super) fn figure(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e7).contains(&magnitude) {
        return format!("{value:.5e}");
    }
    let digits = (5 - magnitude.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::{figure, narrowed};

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

    #[test]
    fn val_figures_have_six_digits() {
        for (value, text) in [
            (0.0, "0"),
            (-0.25, "-0.25"),
            (157.07963267948966, "157.08"),
            (1234567.0, "1234567"),
            (1e-13, "1.00000e-13"),
            (0.00123456789, "0.00123457"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
