//! Single values checked, and refusals worded.

use std::cell::RefCell;

use super::error::MOST_FURTHER;
use super::key::{Count, Default, Number, short};
use super::{SceneError, document::SceneText, keys};
use crate::nearest::nearest;

/// Checks values. A value that is refused is noted, and the checks go on, so that one call finds what is wrong in several places.
pub(super) struct Checker<'a> {
    text: &'a SceneText,
    refused: RefCell<Vec<SceneError>>,
}

impl<'a> Checker<'a> {
    pub(super) fn new(text: &'a SceneText) -> Self {
        Checker { text, refused: RefCell::new(Vec::new()) }
    }

    pub(super) fn refuse(&self, key: &str, problem: impl Into<String>) -> SceneError {
        self.text.refuse(key, problem)
    }

    /// Whether an override gave `key`, and none `other`: then it is `key` that is wrong.
    pub(super) fn is_to_blame(&self, key: &str, other: &str) -> bool {
        self.text.is_overridden(key) && !self.text.is_overridden(other)
    }

    /// The refusal of keys that exclude one another: of the one that an override added to the scene, or of the usual one.
    pub(super) fn refuse_one_of(&self, usual: &str, others: &[&str], problem: &str) -> SceneError {
        let added = std::iter::once(&usual).chain(others).find_map(|key| self.text.added(key));
        self.refuse(added.unwrap_or(usual), problem)
    }

    /// Whether an override brought `key` into the scene.
    pub(super) fn is_added(&self, key: &str) -> bool {
        self.text.added(key).is_some()
    }

    /// Whether the scene had `key`, and no override changes it.
    pub(super) fn is_of_scene(&self, key: &str) -> bool {
        self.text.had(key) && !self.text.is_overridden(key)
    }

    /// The refusal of tables that exclude one another, chosen as by [`refuse_one_of`](Self::refuse_one_of). If an override added
    /// the table, the refusal names the tables that the scene has instead, and their key of the same name.
    pub(super) fn refuse_one_table_of(&self, usual: &str, others: &[&str], problem: &str) -> SceneError {
        let refused = self.refuse_one_of(usual, others, problem);
        let present: Vec<&str> = std::iter::once(&usual).chain(others).copied().filter(|table| self.text.had(table)).collect();
        let (table, key) = refused.key.split_once('.').unwrap_or((refused.key.as_str(), ""));
        if present.is_empty() || present.contains(&table) {
            return refused;
        }
        let titles = present.iter().map(|table| format!("[{table}]")).collect::<Vec<_>>().join(" and ");
        let problem = format!("this scene has {titles} instead of [{table}]{}", same_key_hint(&present, key));
        SceneError { problem, ..refused }
    }

    /// The refusal of a value that its key never allows.
    fn refuse_value(&self, key: &str, problem: String) -> SceneError {
        SceneError { never_allowed: true, ..self.refuse(key, problem) }
    }

    /// Notes a refusal, unless there are many.
    pub(super) fn note(&self, refusal: impl FnOnce() -> SceneError) {
        let mut refused = self.refused.borrow_mut();
        if refused.len() <= MOST_FURTHER {
            refused.push(refusal());
        }
    }

    /// The value of a result. A refusal is noted.
    pub(super) fn noted<T>(&self, result: Result<T, SceneError>) -> Option<T> {
        result.map_err(|refused| self.refused.borrow_mut().push(refused)).ok()
    }

    /// The result of all checks, unless a refusal was noted.
    ///
    /// # Errors
    /// All refusals, as one.
    pub(super) fn conclude<T>(&self, result: Result<T, SceneError>) -> Result<T, SceneError> {
        let mut noted = self.refused.take();
        let last = match result {
            Err(refused) => refused,
            Ok(value) => match noted.pop() {
                Some(refused) => refused,
                None => return Ok(value),
            },
        };
        Err(self.text.joined(last, noted))
    }

    /// `value`, or NaN, of which no comparison holds, if the key does not allow it. `table` is the path of the table that the key
    /// stands in: `crank`, `pulse.0`.
    pub(super) fn number(&self, key: &Number, table: &str, value: f64) -> f64 {
        if key.allows(value) {
            return value;
        }
        let Number { name, low, high, .. } = key;
        let problem = || format!("must be a number from {} to {}", short(*low), short(*high));
        self.note(|| self.refuse_value(&format!("{table}.{name}"), problem()));
        f64::NAN
    }

    /// `value`, as [`number`](Self::number) checks it, or the key's default. A key without one must be given.
    pub(super) fn number_or(&self, key: &Number, table: &str, value: Option<f64>) -> f64 {
        match (value, key.default) {
            (Some(value), _) => self.number(key, table, value),
            (None, Default::Value(default)) => default,
            (None, _) => {
                self.note(|| self.refuse(table, format!("missing key `{}`", key.name)));
                f64::NAN
            }
        }
    }

    /// `value`; `None` if the key does not allow it.
    pub(super) fn count(&self, key: &Count, table: &str, value: i64) -> Option<usize> {
        let Count { name, low, high, .. } = *key;
        let allowed = usize::try_from(value).ok().filter(|count| (low..=high).contains(count));
        if allowed.is_none() {
            let problem = || format!("must be a whole number from {low} to {high}");
            self.note(|| self.refuse_value(&format!("{table}.{name}"), problem()));
        }
        allowed
    }

    /// `value`, or the least that the key allows; of a key that is left out, its default. A key without one must be given.
    pub(super) fn count_or(&self, key: &Count, table: &str, value: Option<i64>) -> usize {
        match (value, key.default) {
            (Some(value), _) => self.count(key, table, value).unwrap_or(key.low),
            (None, Default::Value(default)) => default,
            (None, _) => {
                self.note(|| self.refuse(table, format!("missing key `{}`", key.name)));
                key.low
            }
        }
    }

    /// The meaning of `value`.
    ///
    /// # Errors
    /// The refusal of a value that is none of the words.
    pub(super) fn word<T: Copy>(&self, key: &str, value: &str, words: &[(&str, T)]) -> Result<T, SceneError> {
        meaning(value, words).map_err(|problem| self.refuse_value(key, problem))
    }

    /// The meaning of `value`, or the usual one.
    pub(super) fn word_or<T: Copy>(&self, key: &str, value: Option<&str>, words: &[(&str, T)], usual: T) -> T {
        let note = |problem: String| {
            self.note(|| self.refuse_value(key, problem));
            usual
        };
        value.map_or(usual, |value| meaning(value, words).unwrap_or_else(note))
    }
}

/// A question whether a key of one of `tables` was meant, if they have it. `key` may be a path: `section.height_m`.
fn same_key_hint(tables: &[&str], key: &str) -> String {
    let name = key.split('.').next().unwrap_or_default();
    let has_key = |table: &&&str| {
        let title = format!("[{table}]");
        keys::reference().iter().any(|row| row.table.contains(&title) && row.key == name)
    };
    let alike: Vec<String> = tables.iter().filter(has_key).map(|table| format!("`{table}.{key}`")).collect();
    if alike.is_empty() { String::new() } else { format!("; did you mean {}?", alike.join(" or ")) }
}

/// The meaning of a word, or the problem with it.
fn meaning<T: Copy>(value: &str, words: &[(&str, T)]) -> Result<T, String> {
    if let Some((_, found)) = words.iter().find(|(word, _)| *word == value) {
        return Ok(*found);
    }
    let names: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
    let hint = nearest(value, names.iter().copied()).map(|name| format!("; did you mean \"{name}\"?")).unwrap_or_default();
    Err(format!("must be one of {}{hint}", names.join(", ")))
}
