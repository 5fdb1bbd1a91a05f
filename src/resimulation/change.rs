//! The change of a recorded session that a what-if asks about.

use super::ResimulationError;
use super::event::schema;
use super::recorded_session::RecordedSession;
use crate::recording::{WalkFlow, WalkItem, walk};
use crate::scene::SceneSource;
use crate::wire::Topic;

/// A pulse added to a recorded session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedPulse {
    /// Start, simulated s since the session began.
    pub start_s: f64,
    /// Mean torque, N·m.
    pub torque_nm: f64,
    /// Duration, s.
    pub duration_s: f64,
}

/// Changes to a recorded session.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Change {
    /// Added pulses.
    pub pulses: Vec<AddedPulse>,
    /// `KEY=VALUE` overrides of the scene.
    pub overrides: Vec<String>,
    /// The command line, for the new recording.
    pub command_line: String,
}

impl Change {
    /// The scene of the re-simulation.
    ///
    /// # Errors
    /// [`ResimulationError::Change`] if the overrides are refused.
    pub fn scene(&self, source: &RecordedSession) -> Result<SceneSource, ResimulationError> {
        SceneSource::parse(&source.scene.origin, &source.scene.text, &self.overrides).map_err(ResimulationError::Change)
    }

    /// Number of messages before the checkpoint to start from: the first at its instant, before resets and changes there. `first` is
    /// the first added pulse.
    pub(super) fn beginning(&self, source: &RecordedSession, first: Option<&AddedPulse>) -> Result<u64, ResimulationError> {
        let (mut number, mut begin, mut at_ns) = (0, None, None);
        let (mut first_ns, mut is_damaged) = (None, false);
        let until_ns = first.map_or(u64::MAX, |pulse| source.log_time_ns(pulse.start_s));
        walk(&source.path, |found, _| {
            let message = match found {
                WalkItem::Message(message) => message,
                WalkItem::Damage(damage) => {
                    is_damaged |= damage.lost_ns.is_some();
                    return WalkFlow::Continue(());
                }
                _ => return WalkFlow::Continue(()),
            };
            if number == 0 && !is_damaged {
                first_ns = Some(message.log_time);
            }
            let later = message.log_time <= until_ns && at_ns != Some(message.log_time);
            if schema(message) == Topic::Checkpoint.schema() && later {
                (begin, at_ns) = (Some(number), Some(message.log_time));
            }
            number += 1;
            let decided = begin.is_some() && (!self.overrides.is_empty() || message.log_time > until_ns);
            if decided { WalkFlow::Break(()) } else { WalkFlow::Continue(()) }
        })?;
        begin.ok_or_else(|| match first {
            Some(pulse) => source.before_checkpoints(pulse.start_s, first_ns),
            None => ResimulationError::NothingToResume(source.path.clone()),
        })
    }
}
