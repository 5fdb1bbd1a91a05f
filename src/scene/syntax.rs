//! Why a text is no TOML, with hints at numbers that are written otherwise there.

use toml_edit::TomlError;

use super::document::lines_before;
use super::keys;
use crate::decimal_comma::{decimal_comma_hint, thousands_commas_hint};
use crate::percent::percent_hint;

/// The reason why a scene, or the value of `key`, is no TOML. A number with commas, in per cent or with its unit gets a hint.
pub(super) fn syntax_problem(key: &str, text: &str, error: &TomlError) -> String {
    let span = error.span().unwrap_or_default();
    let line = text.lines().nth(lines_before(text, &span));
    let message = error.message().trim().replace('\n', " ");
    let value = value_at(text, span.start);
    let key = key_before(text, span.start).unwrap_or(key);
    let hint = || line.and_then(comma_in).or_else(|| share_hint(key, value)).or_else(|| unit_hint(value));
    let hint = if message == "duplicate key" { None } else { hint() };
    format!("not TOML: {}", hint.unwrap_or(message))
}

/// A hint at the first number with commas in a line of `KEY = VALUE`, or in a value.
fn comma_in(line: &str) -> Option<String> {
    let hint = |value: &str| {
        let value = value.trim_start();
        let end = value.find(|c: char| !c.is_ascii_digit() && !"+-.,eE".contains(c)).unwrap_or(value.len());
        let number = value[..end].trim_end_matches(',');
        thousands_commas_hint(number).or_else(|| decimal_comma_hint(number))
    };
    line.split('=').find_map(hint)
}

/// The value without quotes that covers `offset` of a text.
fn value_at(text: &str, offset: usize) -> &str {
    let (before, after) = text.split_at_checked(offset).unwrap_or_default();
    let start = before.rfind(['=', ',', '[', '{', '\n']).map_or(0, |delimiter| delimiter + 1);
    let length = after.find([',', ']', '}', '#', '\n']).unwrap_or(after.len());
    text.get(start..offset + length).unwrap_or_default().trim()
}

/// The name of the key that stands before `offset` of a text, in the same line.
fn key_before(text: &str, offset: usize) -> Option<&str> {
    let (key, _) = text.get(..offset)?.rsplit('\n').next()?.rsplit_once('=')?;
    key.trim_end().trim_end_matches('"').rsplit(|c: char| !c.is_ascii_alphanumeric() && c != '_').next()
}

/// A hint at a value in per cent: the number to write, or why the key is no share.
fn share_hint(key: &str, value: &str) -> Option<String> {
    let number = percent_hint(value)?;
    let Some(measure) = keys::measure(key) else { return Some(number) };
    let is_damping = key.ends_with(keys::DAMPING.name);
    let formula = if is_damping { ": `flexcrank guide scenes` has its value for a damping ratio" } else { "" };
    Some(format!("`{value}` is a share, and {key} is {measure}{formula}"))
}

/// A hint at the unit of a value that is a number with one: `0.42 m`, `210GPa`.
fn unit_hint(value: &str) -> Option<String> {
    let number = value.trim_start_matches(['+', '-']);
    let unit = number.trim_start_matches(|c: char| c.is_ascii_digit() || "+-._eE".contains(c)).trim_start();
    let has_unit =
        number.starts_with(|c: char| c.is_ascii_digit()) && unit.starts_with(|c: char| c.is_alphabetic() || "%°".contains(c));
    has_unit.then(|| format!("`{value}`: write the number alone, as its key names the unit"))
}
