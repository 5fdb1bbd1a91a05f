//! Faults of a table of comma-separated values, told to those who wrote it.

use crate::decimal_comma::decimal_comma_hint;

/// The reason why columns are not separated by commas, if this first row shows it.
pub(crate) fn other_separator(header: &csv::StringRecord) -> Option<&'static str> {
    let has = |separator: char| header.iter().any(|cell| cell.contains(separator));
    if has(';') {
        return Some("columns are separated by semicolons: separate them by commas, and write decimals with a point");
    }
    has('\t').then_some("columns are separated by tabs: separate them by commas")
}

/// A row that cannot be read, without its line.
pub(crate) fn broken_row(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            let point = if len > expected_len { "; if a number was meant, it has a decimal point, not a comma" } else { "" };
            let (values, columns) = (counted(*len, "value"), counted(*expected_len, "column"));
            format!("{values} in a table of {columns}{point}")
        }
        csv::ErrorKind::Utf8 { .. } => "is not text in UTF-8".to_owned(),
        _ => error.to_string(),
    }
}

/// Why a cell is no number.
pub(crate) fn no_number(cell: &str) -> String {
    decimal_comma_hint(cell).unwrap_or_else(|| "not a finite number".to_owned())
}

fn counted(count: u64, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The line of the row that starts at byte `from`, without blank lines before it, nor comments if there are any.
pub(crate) fn line_at(text: &str, from: u64, has_comments: bool) -> u64 {
    let (before, rest) = text.split_at_checked(usize::try_from(from).unwrap_or(0)).unwrap_or(("", text));
    let skipped = rest.lines().take_while(|line| line.is_empty() || has_comments && line.starts_with('#')).count();
    1 + (before.matches('\n').count() + skipped) as u64
}
