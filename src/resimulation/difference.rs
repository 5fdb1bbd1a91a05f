//! Difference between a recorded message and the re-simulated one.

use std::fmt;

use super::resimulator::EpochStep;
use crate::recording::scalars;
use crate::shown::shown_s;

/// A recorded message that re-simulation does not reproduce.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Last chunk of its topic.
    pub topic: String,
    /// Epoch and step of the recorded message.
    pub instant: EpochStep,
    /// Simulated time, s.
    pub sim_time_s: f64,
    /// The first field that differs, and its two values.
    pub field: Option<Field>,
    /// The last command before the message, if any.
    pub after: Option<String>,
}

/// A field with its recorded and computed value.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Dotted name, as in the tables of `export`.
    pub name: String,
    /// Recorded value; empty if absent.
    pub recorded: String,
    /// Computed value; empty if absent.
    pub computed: String,
}

impl Field {
    /// Finds the first field in which two messages of a type differ; `None` if only their bytes do.
    pub(super) fn first(schema: &str, recorded: &[u8], computed: &[u8]) -> Option<Self> {
        let recorded = scalars(schema, recorded).unwrap_or_default();
        let computed = scalars(schema, computed).unwrap_or_default();
        let value = |row: &[(String, String)], name: &str| {
            row.iter().find(|(other, _)| other == name).map(|(_, value)| value.clone()).unwrap_or_default()
        };
        recorded.iter().chain(&computed).find_map(|(name, _)| {
            let field = Field { name: name.clone(), recorded: value(&recorded, name), computed: value(&computed, name) };
            (field.recorded != field.computed).then_some(field)
        })
    }

    /// Recorded minus computed value, if both are numbers.
    pub fn size(&self) -> Option<f64> {
        Some(self.recorded.parse::<f64>().ok()? - self.computed.parse::<f64>().ok()?)
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Difference { topic, instant: (epoch, step), sim_time_s, field, after } = self;
        write!(f, "step {step} (t = {} s", shown_s(*sim_time_s))?;
        if *epoch > 0 {
            write!(f, ", epoch {epoch}")?;
        }
        write!(f, "), {topic}")?;
        match field {
            Some(field) => {
                let shown = |text: &str| if text.is_empty() { "nothing".to_owned() } else { text.to_owned() };
                write!(f, ".{}: {} recorded, {} computed", field.name, shown(&field.recorded), shown(&field.computed))?;
                if let Some(size) = field.size() {
                    write!(f, ", difference {size:e}")?;
                }
            }
            None => write!(f, ": other bytes for the same values")?,
        }
        match after {
            Some(after) => write!(f, "; the last command before it is {after}"),
            None => Ok(()),
        }
    }
}
