//! The signals that `watch --plain --signals` prints, and the refusal of names that no signal has.

use std::time::{Duration, Instant};

use super::super::failure::{CommandResult, Failure};
use super::signals::Signals;
use crate::nearest::did_you_mean;
use crate::shown::shown_name;
use crate::wire::{Message, Shadow, Stamp};

/// The chosen signals; none stands for all.
#[derive(Debug, Default)]
pub(super) struct ChosenSignals {
    /// Their names, as given.
    pub names: Vec<String>,
    /// All signals so far, until each name has one.
    seen: Signals,
    /// Arrival of the first sample.
    since: Option<Instant>,
}

impl ChosenSignals {
    pub(super) fn new(names: &[String]) -> Self {
        let mut seen = Signals::default();
        // A shadow may begin later, and has no samples while the service is paused.
        seen.shadow(&Shadow { stamp: Some(Stamp::default()), joint_force_n: Some(0.0), ..Shadow::default() });
        ChosenSignals { names: names.to_vec(), seen, since: None }
    }

    /// Adds the signals of a message.
    pub(super) fn add(&mut self, message: &Message) {
        if self.missing().is_some() {
            self.seen.add(message);
            if message.topic().is_telemetry() {
                self.since.get_or_insert_with(Instant::now);
            }
        }
    }

    /// Whether every name has a signal, or no sample has come yet. Topics have rates of their own, so that a signal may come later than
    /// others.
    ///
    /// # Errors
    /// [`Failure::Usage`] for a name that has none this long after the first sample.
    pub(super) fn are_there(&self, patience: Duration) -> CommandResult<bool> {
        let (Some(since), Some(missing)) = (self.since, self.missing()) else { return Ok(true) };
        if since.elapsed() < patience {
            return Ok(false);
        }
        let near = did_you_mean(missing, self.seen.names());
        let hint = if near.is_empty() { "; `watch --plain --json` prints all by name" } else { &near };
        Err(Failure::Usage(format!("no signal `{}`{hint}", shown_name(missing))))
    }

    fn missing(&self) -> Option<&str> {
        self.names.iter().map(String::as_str).find(|name| self.seen.find(name).is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Loads;

    fn chosen(names: &[&str]) -> ChosenSignals {
        ChosenSignals::new(&names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn val_a_name_is_refused_when_no_sample_has_it() {
        let loads = Message::Loads(Box::new(Loads { resistance_n: Some(1.0), ..Loads::default() }));
        for (name, refusal) in [
            ("driving_torque_nm", None),
            ("shadow.angle_rad", None),
            ("driving_torqe_nm", Some("no signal `driving_torqe_nm`; did you mean `driving_torque_nm`?")),
            ("xyz", Some("no signal `xyz`; `watch --plain --json` prints all by name")),
        ] {
            let mut chosen = chosen(&[name]);
            assert!(matches!(chosen.are_there(Duration::ZERO), Ok(true)), "{name}: no sample has come");
            chosen.add(&loads);
            let soon = chosen.are_there(Duration::from_secs(60));
            assert!(soon.is_ok_and(|there| there == refusal.is_none()), "{name}: it may come soon");
            let said = match chosen.are_there(Duration::ZERO) {
                Ok(true) => None,
                Err(Failure::Usage(said)) => Some(said),
                other => Some(format!("{other:?}")),
            };
            assert_eq!(said.as_deref(), refusal, "{name}");
        }
    }
}
