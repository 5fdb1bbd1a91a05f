//! Aligned tables in the terminal.

use std::io::{self, Write as _};

use super::output::output;
pub(super) use crate::shown::figure;
use crate::shown::shown_name;

/// Prints rows in aligned columns: those before column `figures` to the left, the others to the right. A cell may be a name from outside.
pub(super) fn print(rows: &[Vec<String>], figures: usize) -> io::Result<()> {
    let rows = as_shown(rows);
    let widths = widths(&rows);
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
pub(super) const WIDTH: usize = 80;
/// Fewest characters that a cut cell keeps.
const LEAST: usize = 12;

/// Prints rows of words within 80 columns: the last column, and then the widest, is cut in front, where paths have their folders.
pub(super) fn print_narrow(rows: &[Vec<String>]) -> io::Result<()> {
    print(&narrowed(&as_shown(rows)), usize::MAX)
}

/// The rows within 80 columns: words of a cell in `column` for which there is no room go to rows of their own below.
pub(super) fn with_column_wrapped(rows: &[Vec<String>], column: usize) -> Vec<Vec<String>> {
    let widths = widths(rows);
    let others = widths.iter().sum::<usize>() - widths.get(column).unwrap_or(&0);
    let room = WIDTH.saturating_sub(others + 2 * widths.len());
    let wrapped = |row: &Vec<String>| {
        let with_cell = |(place, cell): (usize, String)| {
            let mut line = if place == 0 { row.clone() } else { vec![String::new(); column + 1] };
            if let Some(there) = line.get_mut(column) {
                *there = cell;
            }
            line
        };
        lines(row.get(column).map_or("", String::as_str), room).into_iter().enumerate().map(with_cell).collect::<Vec<_>>()
    };
    rows.iter().flat_map(wrapped).collect()
}

/// The text in lines of at most `room` characters, broken at spaces; a longer word has a line of its own.
pub(super) fn lines(text: &str, room: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= room) {
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The width of each column, in characters.
pub(super) fn widths(rows: &[Vec<String>]) -> Vec<usize> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    (0..columns).map(width).collect()
}

fn as_shown(rows: &[Vec<String>]) -> Vec<Vec<String>> {
    rows.iter().map(|row| row.iter().map(|cell| shown_name(cell).to_string()).collect()).collect()
}

/// The rows with cells cut until they fit.
fn narrowed(rows: &[Vec<String>]) -> Vec<Vec<String>> {
    let mut widths = widths(rows);
    while widths.iter().sum::<usize>() + 2 * widths.len() > WIDTH {
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
    use super::{WIDTH, lines, narrowed, with_column_wrapped};

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
    fn prop_a_wrapped_column_keeps_its_words_within_80_columns() {
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let (left, right) = ("l".repeat(30), "r".repeat(30));
        let wrapped = with_column_wrapped(&[row(["a", "head", "b"]), row([&left, "two modes, crank rigid", &right])], 1);
        assert_eq!(wrapped[0], row(["a", "head", "b"]));
        assert_eq!(wrapped[1], row([&left, "two modes,", &right]));
        assert_eq!(wrapped[2..], [vec![String::new(), "crank rigid".to_owned()]]);
        let fits = [row(["a", "two modes, crank rigid", "b"])];
        assert_eq!(with_column_wrapped(&fits, 1), fits);
    }

    #[test]
    fn regress_long_sentences_fit_80_columns() {
        let text = "rod bending 1, ".repeat(20);
        let lines = lines(text.trim(), WIDTH - 4);
        assert!(lines.iter().all(|line| line.chars().count() <= WIDTH - 4) && lines.len() == 4, "{lines:?}");
        assert_eq!(lines.join(" "), text.trim());
    }
}
