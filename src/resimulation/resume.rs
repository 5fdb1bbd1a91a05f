//! A session taken up where its recording left it.

use super::ResimulationError;
use super::event::Event;
use super::recorded_session::RecordedSession;
use super::resimulator::{EpochStep, Resimulator};
use crate::recording::{RecordedMessage, WalkFlow, WalkItem, walk};
use crate::simulation::Simulation;
use crate::wire::{self, AppliedCommand, Checkpoint, CommandReply};

/// A session as it was at an instant of its recording.
pub struct Resumed {
    /// Its state: pulses that wait or act are among it.
    pub simulation: Simulation,
    /// Simulated time of the session at which the epoch began, s.
    pub epoch_start_s: f64,
    /// The answers to the commands taken until then, in order.
    pub answers: Vec<CommandReply>,
}

/// Goes from the last checkpoint on, with the recorded commands, to the end of a recording, or to `at_s`, simulated s since the
/// session began (commands of that very instant are taken). `progress` is told the byte reached.
///
/// What comes after damage can be taken up only at a checkpoint.
///
/// # Errors
/// [`ResimulationError`] when it cannot be read, `at_s` is not in it, or its scene no longer gives what was recorded.
pub fn resume(source: &RecordedSession, at_s: Option<f64>, progress: &dyn Fn(u64)) -> Result<Resumed, ResimulationError> {
    let until_ns = at_s.map_or(u64::MAX, |at_s| source.log_time_ns(at_s));
    let mut trail = Trail::default();
    walk(&source.path, |found, position| {
        progress(position);
        match found {
            WalkItem::Message(message) if message.log_time > until_ns => {
                trail.goes_on = true;
                return WalkFlow::Break(());
            }
            WalkItem::Message(message) => trail.take(source, message),
            WalkItem::Damage(damage) => trail.broken |= damage.lost_ns.is_some(),
            _ => {}
        }
        WalkFlow::Continue(())
    })?;
    let checkpoint = trail.checkpoint.as_ref().ok_or_else(|| ResimulationError::NothingToResume(source.path.clone()))?;
    let mut resimulator = Resimulator::new(&source.scene.scene)?;
    let unlike = |what: String| ResimulationError::Unlike { path: source.path.clone(), what };
    let state = wire::recorded_checkpoint(checkpoint).map_err(|error| unlike(error.to_string()))?;
    if !resimulator.restore(&state, checkpoint.epoch_start_s) {
        return Err(unlike("its checkpoint is not one of its scene".to_owned()));
    }
    let sampling = |simulation: &mut Simulation| {
        // A sample that was due ended the time that the next one's mean torque is of.
        if source.publish.is_some_and(|rates| rates.loads.is_due(simulation.step_count(), simulation.step_s())) {
            simulation.take_mean_torque_nm();
        }
    };
    resimulator.with_simulation(sampling);
    for command in &trail.commands {
        let at = command.stamp.map(|stamp| (stamp.epoch, stamp.step)).unwrap_or_default();
        resimulator.go_to(at, sampling).map_err(|fault| unlike(fault.to_string()))?;
        resimulator.command(command).map_err(|refused| unlike(refused.to_string()))?;
    }
    let end = match at_s {
        Some(at_s) => trail
            .instant_at(at_s, &resimulator, source)
            .ok_or_else(|| ResimulationError::Outside { path: source.path.clone(), at_s })?,
        None => trail.last.max(resimulator.instant()),
    };
    resimulator.go_to(end, sampling).map_err(|fault| unlike(fault.to_string()))?;
    let (simulation, epoch_start_s) = resimulator.into_parts();
    Ok(Resumed { simulation, epoch_start_s, answers: trail.answers })
}

/// What leads to the instant to resume at.
#[derive(Default)]
struct Trail {
    checkpoint: Option<Checkpoint>,
    /// Since the checkpoint.
    commands: Vec<AppliedCommand>,
    /// Last instant recorded.
    last: EpochStep,
    answers: Vec<CommandReply>,
    /// Something was lost since the checkpoint.
    broken: bool,
    /// The recording goes on after that.
    goes_on: bool,
}

impl Trail {
    fn take(&mut self, source: &RecordedSession, message: &RecordedMessage) {
        let Ok(event) = Event::of(message) else { return };
        let Some(stamp) = event.stamp().filter(|stamp| source.is_timely(stamp, message.log_time)) else { return };
        match event {
            Event::Gap(gap) => {
                self.broken |= gap.topic == "commands";
                return;
            }
            Event::Checkpoint(checkpoint) => {
                self.commands.clear();
                self.broken = false;
                self.checkpoint = Some(*checkpoint);
            }
            Event::Command(command) => {
                self.answers.extend(command.reply.clone());
                if !self.broken {
                    self.commands.push(*command);
                }
            }
            _ => {}
        }
        if !self.broken {
            self.last = (stamp.epoch, stamp.step);
        }
    }

    /// The instant nearest to `at_s` of the session; `None` when it is not in the recording.
    fn instant_at(&self, at_s: f64, resimulator: &Resimulator, source: &RecordedSession) -> Option<EpochStep> {
        let step_s = source.scene.scene.solver.step_s;
        let stamp = resimulator.stamp();
        let step = ((at_s - stamp.epoch_start_s) / step_s).round().max(0.0) as u64;
        let at = (stamp.epoch, step.max(stamp.step));
        (self.goes_on && !self.broken || at <= self.last).then_some(at)
    }
}
