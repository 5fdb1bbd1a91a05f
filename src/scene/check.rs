//! Single values checked, and refusals worded.

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

    /// `value` if it is a number from `low` to `high`.
    pub(super) fn number(&self, key: &str, value: f64, low: f64, high: f64) -> Result<f64, SceneError> {
        if value >= low && value <= high {
            return Ok(value);
        }
        Err(self.refuse(key, format!("must be a number from {} to {}", short(low), short(high))))
    }

    pub(super) fn number_or(&self, key: &str, value: Option<f64>, default: f64, low: f64, high: f64) -> Result<f64, SceneError> {
        value.map_or(Ok(default), |value| self.number(key, value, low, high))
    }

    pub(super) fn count_or(
        &self,
        key: &str,
        value: Option<i64>,
        default: usize,
        low: usize,
        high: usize,
    ) -> Result<usize, SceneError> {
        let Some(value) = value else { return Ok(default) };
        usize::try_from(value)
            .ok()
            .filter(|count| (low..=high).contains(count))
            .ok_or_else(|| self.refuse(key, format!("must be a whole number from {low} to {high}")))
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

/// A bound as a person would write it.
fn short(bound: f64) -> String {
    if bound == 0.0 || (1e-3..1e5).contains(&bound.abs()) { format!("{bound}") } else { format!("{bound:e}") }
}
