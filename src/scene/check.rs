//! Single values checked, and refusals worded.

use super::key::{Count, Default, Number, short};
use super::{SceneError, document::SceneText};
use crate::nearest::nearest;

/// Checks values and words the refusals.
pub(super) struct Checker<'a> {
    pub text: &'a SceneText,
}

impl Checker<'_> {
    pub(super) fn refuse(&self, key: &str, problem: impl Into<String>) -> SceneError {
        SceneError { place: self.text.place(key), key: key.to_owned(), value: self.text.value(key), problem: problem.into() }
    }

    /// `value` if the key allows it. `table` is the path of the table that the key stands in: `crank`, `pulse.0`.
    pub(super) fn number(&self, key: &Number, table: &str, value: f64) -> Result<f64, SceneError> {
        if key.allows(value) {
            return Ok(value);
        }
        let Number { name, low, high, .. } = key;
        Err(self.refuse(&format!("{table}.{name}"), format!("must be a number from {} to {}", short(*low), short(*high))))
    }

    /// `value` if the key allows it, or the key's default.
    pub(super) fn number_or(&self, key: &Number, table: &str, value: Option<f64>) -> Result<f64, SceneError> {
        match (value, key.default) {
            (Some(value), _) => self.number(key, table, value),
            (None, Default::Value(default)) => Ok(default),
            (None, _) => Err(self.refuse(table, format!("missing key `{}`", key.name))),
        }
    }

    pub(super) fn count_or(&self, key: &Count, table: &str, value: Option<i64>) -> Result<usize, SceneError> {
        match (value, key.default) {
            (Some(value), _) => self.count(key, table, value),
            (None, Default::Value(default)) => Ok(default),
            (None, _) => Err(self.refuse(table, format!("missing key `{}`", key.name))),
        }
    }

    /// `value` if the key allows it.
    pub(super) fn count(&self, key: &Count, table: &str, value: i64) -> Result<usize, SceneError> {
        let Count { name, low, high, .. } = *key;
        let problem = || self.refuse(&format!("{table}.{name}"), format!("must be a whole number from {low} to {high}"));
        usize::try_from(value).ok().filter(|count| (low..=high).contains(count)).ok_or_else(problem)
    }

    pub(super) fn word<T: Copy>(&self, key: &str, value: &str, words: &[(&str, T)]) -> Result<T, SceneError> {
        if let Some((_, found)) = words.iter().find(|(word, _)| *word == value) {
            return Ok(*found);
        }
        let names: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        let hint = nearest(value, names.iter().copied()).map(|name| format!("; did you mean \"{name}\"?")).unwrap_or_default();
        Err(self.refuse(key, format!("must be one of {}{hint}", names.join(", "))))
    }
}
