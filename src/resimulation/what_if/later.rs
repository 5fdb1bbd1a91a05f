//! Commands that a what-if applies between the messages of the recording: added pulses, and recorded commands that begin with the next
//! of its own steps.

use super::{Attempt, Stopped};
use crate::recording::RecordedMessage;
use crate::resimulation::ResimulationError;
use crate::resimulation::command_instant::begins_within;
use crate::resimulation::resimulator::EpochStep;
use crate::scene::PulseShape;
use crate::simulation::{PulseRefused, PulseRequest};
use crate::wire::{self, AppliedCommand, Stamp, applied_command};

/// A recorded command that falls into a step, and waits for its end. A pulse that falls into the same step, and begins there, may come
/// after it in the recording.
pub(super) struct WaitingCommand {
    /// The end of the step.
    pub(super) instant: EpochStep,
    pub(super) command: Box<AppliedCommand>,
    /// The message that brought it.
    pub(super) message: RecordedMessage,
}

impl Attempt<'_> {
    /// Applies the commands whose step ends by the instant of a stamp.
    pub(super) fn apply_waiting(&mut self, stamp: Stamp) -> Result<(), Stopped> {
        while let Some(WaitingCommand { instant: (epoch, step), .. }) = self.waiting.front() {
            let steps = self.resimulator.steps_at(*epoch, stamp.sim_time_s);
            if stamp.epoch == *epoch && begins_within(steps, *step as f64) {
                break;
            }
            self.apply_first_waiting()?;
        }
        Ok(())
    }

    /// Applies the commands that wait at the end of the recording.
    pub(super) fn apply_all_waiting(&mut self) -> Result<(), Stopped> {
        while !self.waiting.is_empty() {
            self.apply_first_waiting()?;
        }
        Ok(())
    }

    fn apply_first_waiting(&mut self) -> Result<(), Stopped> {
        let Some(WaitingCommand { instant, command, message }) = self.waiting.pop_front() else { return Ok(()) };
        let (epoch, step) = instant;
        if epoch == self.resimulator.instant().0 {
            let session_s = self.resimulator.stamp().epoch_start_s + self.resimulator.grid_in(epoch).time_s(step);
            self.add_pulses_before(session_s, &message)?;
        }
        self.resimulator.go_to(instant, |_| {})?;
        self.command(&command, &message)
    }

    /// Adds every pulse that begins before `session_s`, before the step that it acts in.
    pub(super) fn add_pulses_before(&mut self, session_s: f64, message: &RecordedMessage) -> Result<(), Stopped> {
        while let Some(pulse) = self.pulses.get(self.added).filter(|pulse| pulse.start_s < session_s).copied() {
            self.added += 1;
            let stamp = self.resimulator.stamp();
            let (epoch, now) = self.resimulator.instant();
            let in_epoch_s = pulse.start_s - stamp.epoch_start_s;
            let step = (self.resimulator.steps_at(epoch, in_epoch_s).floor().max(0.0) as u64).max(now);
            self.resimulator.go_to((epoch, step), |_| {})?;
            let request = PulseRequest {
                torque_nm: pulse.torque_nm,
                duration_s: pulse.duration_s,
                delay_s: (in_epoch_s - self.resimulator.simulation().time_s()).max(0.0),
                shape: PulseShape::Rectangular,
            };
            let refused = |why: PulseRefused| Stopped::Other(ResimulationError::Pulse { at_s: pulse.start_s, why });
            let effective = self.resimulator.apply(&request).map_err(refused)?;
            let id = format!("what-if-{}", self.added);
            let command = applied_command::Command::Torque(wire::pulse_message(&id, &request));
            self.record_torque(&id, Some(command), effective, message);
        }
        Ok(())
    }

    pub(super) fn all_added(&self) -> Result<(), Stopped> {
        let path = self.source.path.clone();
        match self.pulses.get(self.added) {
            Some(pulse) => {
                let last_s = Some(self.resimulator.stamp().session_s());
                Err(Stopped::Other(ResimulationError::Outside { path, at_s: pulse.start_s, last_s }))
            }
            None => Ok(()),
        }
    }
}
