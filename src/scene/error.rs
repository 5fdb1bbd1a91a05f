//! Why a scene was refused, and where.

use std::fmt;

/// A scene was refused. Displays as `FILE:LINE: KEY = VALUE: PROBLEM`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    /// File, built-in scene or command-line option that the fault stands in, with the line where known.
    pub place: String,
    /// Dotted key path, such as `rod.length_m`; empty when the fault is the whole file's.
    pub key: String,
    /// The value given, as written, where there is one.
    pub value: Option<String>,
    /// The problem, and the allowed values.
    pub problem: String,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.place)?;
        match (&*self.key, &self.value) {
            ("", _) => {}
            (key, Some(value)) => write!(f, "{key} = {value}: ")?,
            (key, None) => write!(f, "{key}: ")?,
        }
        f.write_str(&self.problem)
    }
}
