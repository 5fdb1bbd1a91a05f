//! Difference between a recorded message and the re-simulated one.

use std::collections::HashMap;
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
        Self::find(schema, recorded, computed, |field| field.recorded != field.computed)
    }

    /// Finds the first field in which two messages of a type differ by more than the sign of zero. An absent value counts as zero:
    /// a rigid model has no deflection.
    pub(super) fn first_unequal(schema: &str, recorded: &[u8], computed: &[u8]) -> Option<Self> {
        Self::find(schema, recorded, computed, |field| field.recorded != field.computed && !field.is_same_number())
    }

    fn find(schema: &str, recorded: &[u8], computed: &[u8], differs: impl Fn(&Field) -> bool) -> Option<Self> {
        let recorded = scalars(schema, recorded).unwrap_or_default();
        let computed = scalars(schema, computed).unwrap_or_default();
        let (was, is) = (by_name(&recorded), by_name(&computed));
        recorded.iter().chain(&computed).find_map(|(name, _)| {
            let value = |of: &HashMap<&str, &str>| of.get(name.as_str()).copied().unwrap_or_default().to_owned();
            let field = Field { name: name.clone(), recorded: value(&was), computed: value(&is) };
            differs(&field).then_some(field)
        })
    }

    /// Whether both values are the same number; an absent one is zero.
    fn is_same_number(&self) -> bool {
        let number = |text: &str| if text.is_empty() { Some(0.0) } else { text.parse::<f64>().ok() };
        number(&self.recorded).zip(number(&self.computed)).is_some_and(|(was, is)| was == is)
    }

    /// Recorded minus computed value, if both are numbers.
    pub fn size(&self) -> Option<f64> {
        Some(self.recorded.parse::<f64>().ok()? - self.computed.parse::<f64>().ok()?)
    }
}

fn by_name(scalars: &[(String, String)]) -> HashMap<&str, &str> {
    scalars.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect()
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
