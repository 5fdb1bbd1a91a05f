//! Why a scene was refused, and where.

use std::fmt;

use crate::shown::Shown;

/// A scene was refused. Displays as `FILE:LINE: KEY = VALUE: PROBLEM`, without further refusals.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    /// File, built-in scene or command-line option that the fault stands in, with the line where known.
    pub place: String,
    /// Dotted key path, such as `rod.length_m`; empty when the fault is the whole file's.
    pub key: String,
    /// The value given, as written, where there is one.
    pub value: Option<Box<str>>,
    /// The problem, and the allowed values.
    pub problem: String,
    /// Whether the key allows this value in no scene, whatever the other keys are.
    pub never_allowed: bool,
    /// Further refusals of the same scene, which do not follow from this one.
    pub further: Box<[SceneError]>,
}

/// Most refusals of a scene beside the first: each searches the whole text for its line.
pub(super) const MOST_FURTHER: usize = 9;

impl SceneError {
    /// The refusal of a whole file or of an option.
    pub(super) fn whole(place: impl Into<String>, problem: impl Into<String>) -> Self {
        let (place, problem) = (place.into(), problem.into());
        SceneError { place, key: String::new(), value: None, problem, never_allowed: false, further: Box::default() }
    }

    /// This refusal and the further ones.
    pub fn all(&self) -> impl Iterator<Item = &SceneError> {
        std::iter::once(self).chain(self.further.iter())
    }

    /// This refusal and the further ones, a line each.
    pub fn in_full(&self) -> String {
        let further = self.further.iter().map(|refused| format!("\n  {refused}"));
        std::iter::once(self.to_string()).chain(further).collect()
    }

    /// Key, value and problem, without the place.
    pub(super) fn reason(&self) -> String {
        match (&*self.key, &self.value) {
            ("", _) => self.problem.clone(),
            (key, Some(value)) => format!("{key} = {value}: {}", self.problem),
            (key, None) => format!("{key}: {}", self.problem),
        }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", Shown(&self.place, 300))?;
        match (&*self.key, &self.value) {
            ("", _) => {}
            (key, Some(value)) => write!(f, "{} = {}: ", Shown(key, 100), Shown(value, 100))?,
            (key, None) => write!(f, "{}: ", Shown(key, 100))?,
        }
        Shown(&self.problem, 1000).fmt(f)
    }
}
