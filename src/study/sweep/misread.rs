//! Why the text of a specification is none: the refusal with its line and its key.

use std::ops::Range;

use toml_edit::{Document, TomlError};

use super::spec::SpecError;
use crate::repeated_table::repeated_table;
use crate::scene::{syntax_problem, toml_problem};
use crate::shown::Shown;

/// Lists of tables in a specification.
const LISTS: [&str; 2] = ["vary", "pulse"];

/// The origin with the line of a byte of its text.
pub(super) fn at_line(origin: &str, text: &str, byte: usize) -> String {
    format!("{origin}:{}", 1 + text.bytes().take(byte).filter(|byte| *byte == b'\n').count())
}

/// The key that a fault at `span` is of, with its value if the fault is the value's; empty if the fault is not within a line.
fn named(text: &str, span: Range<usize>) -> String {
    let (Some(before), Some(part)) = (text.get(..span.start), text.get(span)) else { return String::new() };
    let before = before.rsplit('\n').next().unwrap_or_default().trim();
    match before.strip_suffix('=') {
        _ if part.is_empty() || part.contains('\n') => String::new(),
        Some(keys) => {
            let key = keys.rsplit([',', '{']).next().unwrap_or_default().trim();
            format!("{} = {}: ", Shown(key, 100), Shown(part, 100))
        }
        None if before.is_empty() && !part.contains('=') => format!("{}: ", Shown(part, 100)),
        None => String::new(),
    }
}

/// The refusal of a text that is no TOML or has other keys or values.
pub(super) fn misread(origin: &str, text: &str, error: &toml::de::Error) -> SpecError {
    if let Err(error) = Document::parse(text) {
        return not_toml(origin, text, &error);
    }
    let key = || unknown_list(text, error).or_else(|| Some(named(text, error.span()?))).unwrap_or_default();
    let hint = || list_example(text, error).or_else(|| key_of_vary(error.message())).unwrap_or_default();
    let problem = || key() + &toml_problem(error.message()) + &hint();
    let place = error.span().map_or(origin.to_owned(), |span| at_line(origin, text, span.start));
    SpecError::new(&place, no_list_problem(text, error).unwrap_or_else(problem))
}

/// The place of a key of `[[vary]]` that stands outside of tables.
fn key_of_vary(message: &str) -> Option<String> {
    let (key, known) = message.strip_prefix("unknown field `")?.split_once('`')?;
    let is_outside = known.contains("`method`");
    (is_outside && ["key", "values", "min", "max", "count", "log"].contains(&key)).then(|| "; it is a key of [[vary]]".to_owned())
}

/// The refusal of a text that is no TOML.
fn not_toml(origin: &str, text: &str, error: &TomlError) -> SpecError {
    let repeated = repeated_table(text, (error.message(), error.span()), |name| LISTS.contains(&name));
    let place = repeated.as_ref().map(|(place, _)| *place).or_else(|| error.span().map(|span| span.start));
    let place = place.map_or(origin.to_owned(), |place| at_line(origin, text, place));
    SpecError::new(&place, repeated.map_or_else(|| syntax_problem("", text, error), |(_, problem)| problem))
}

/// The problem with a table `[name]` or a value, where a campaign has a list of such tables.
fn no_list_problem(text: &str, error: &toml::de::Error) -> Option<String> {
    let line = from_line(text, error.span()?.start)?.trim_start_matches(['[', ' ', '\t']);
    let given: toml::Table = toml::from_str(text).ok()?;
    let is_no_list = |name: &str| given.get(name).is_some_and(|given| !given.is_array());
    let name = LISTS.into_iter().find(|&name| line.starts_with(name) && is_no_list(name))?;
    Some(format!("{name}: must be a list, each entry in a table [[{name}]]"))
}

/// The list to write for its only entry, as the rest of a sentence.
fn list_example(text: &str, error: &toml::de::Error) -> Option<String> {
    let entry = text.get(error.span()?)?;
    let is_text = entry.starts_with(['"', '\'']) && !entry.contains([',', ':', '\n']);
    let is_entry = is_text || entry.parse::<f64>().is_ok_and(f64::is_finite);
    (is_entry && toml_problem(error.message()) == "must be a list").then(|| format!(", such as [{}]", Shown(entry, 100)))
}

/// The title `[[name]]` of an unknown list, where the parser names none.
fn unknown_list(text: &str, error: &toml::de::Error) -> Option<String> {
    let line = from_line(text, error.span()?.start)?.lines().next()?.split('#').next()?.trim();
    (error.message().starts_with("unknown field") && line.starts_with('[')).then(|| format!("{}: ", Shown(line, 100)))
}

/// The text from the line of a byte on.
fn from_line(text: &str, byte: usize) -> Option<&str> {
    let begin = text.get(..byte)?.rfind('\n').map_or(0, |line_break| line_break + 1);
    text.get(begin..)
}
