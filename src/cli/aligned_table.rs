//! Aligned tables in the terminal.

use std::io::{self, Write as _};

use super::output::output;

/// Prints rows in aligned columns: those before column `figures` to the left, the others to the right.
pub(super) fn print(rows: &[Vec<String>], figures: usize) -> io::Result<()> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = output();
    for row in rows {
        let pad = |(column, (cell, &width)): (usize, (&String, &usize))| {
            if column < figures { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        };
        let cells: Vec<String> = row.iter().zip(&widths).enumerate().map(pad).collect();
        writeln!(out, "  {}", cells.join("  ").trim_end())?;
    }
    Ok(())
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
    use super::figure;

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
