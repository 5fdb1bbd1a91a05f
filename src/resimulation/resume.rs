//! Resuming a session where its recording ended.

use super::ResimulationError;
use super::event::{decode, is_report};
use super::recorded_session::RecordedSession;
use super::resimulator::{EpochStep, PROVED_S, Resimulator};
use super::timeline::Timeline;
use crate::recording::{RecordedMessage, WalkFlow, WalkItem, walk};
use crate::runtime::{CHECKPOINT_PERIOD_S, Reply};
use crate::scene::SceneAtLevel;
use crate::simulation::{PerTelemetry, Simulation};
use crate::wire::{self, AppliedCommand, Checkpoint, Message, Topic};

/// A session at an instant of its recording.
pub struct Resumed {
    /// The simulation, with its pending and active pulses.
    pub simulation: Simulation,
    /// Session time at which the epoch began, s.
    pub epoch_start_s: f64,
    /// The scene in force there.
    pub scene: SceneAtLevel,
    /// Replies to the commands accepted until then, in order.
    pub answers: Vec<Reply>,
    /// The topics on which the recording lacks the sample of that instant: a crash may cut off some of them.
    pub missing: PerTelemetry<bool>,
}

/// Re-simulates from the last checkpoint, with the recorded commands, to the end of a recording or to `at_s`, in simulated s
/// since the session began (commands at that very instant are applied). `progress` is called with the position in bytes.
///
/// After damage, a session can be resumed only from a checkpoint.
///
/// # Errors
/// [`ResimulationError`] if the recording cannot be read, `at_s` is not in it, or its scene does not reproduce it.
pub fn resume(source: &RecordedSession, at_s: Option<f64>, progress: &dyn Fn(u64)) -> Result<Resumed, ResimulationError> {
    let until_ns = at_s.map_or(u64::MAX, |at_s| source.log_time_ns(at_s));
    let (mut trail, mut first_ns) = (Trail::new(source), None);
    walk(&source.path, |found, position| {
        progress(position);
        if let WalkItem::Message(message) = &found {
            first_ns = first_ns.or((!trail.broken).then_some(message.log_time));
        }
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
    let checkpoint = trail.checkpoint.as_ref().ok_or_else(|| match at_s.filter(|_| trail.goes_on) {
        Some(at_s) => source.before_checkpoints(at_s, first_ns),
        None => ResimulationError::NothingToResume(source.path.clone()),
    })?;
    let mut resimulator = Resimulator::new(&source.scene)?;
    let unlike = |what: String| ResimulationError::Unlike { path: source.path.clone(), what };
    if !resimulator.restore(checkpoint) {
        return Err(unlike("its checkpoint is not one of its scene".to_owned()));
    }
    let sampling = |simulation: &mut Simulation| {
        // A published sample ends the period of the mean torque.
        let is_lacking = (simulation.epoch(), simulation.step_count()) == trail.last && !trail.sampled.loads;
        if due(source, simulation).loads && !is_lacking {
            simulation.take_mean_torque_nm();
        }
    };
    resimulator.with_simulation(sampling);
    let last = checkpoint.stamp.map(|stamp| (stamp.epoch, stamp.step)).unwrap_or_default();
    let shortest_s = trail.timeline.shortest_step_s();
    let check = |at: EpochStep| match is_proved(at, last, shortest_s) {
        true => Ok(()),
        false => Err(unlike(format!(
            "it states step {}, but its last checkpoint is of step {}, and one is due every {CHECKPOINT_PERIOD_S} s",
            at.1, last.1
        ))),
    };
    for command in &trail.commands {
        let at = command.stamp.map(|stamp| (stamp.epoch, stamp.step)).unwrap_or_default();
        check(at)?;
        resimulator.go_to(at, sampling).map_err(|fault| unlike(fault.to_string()))?;
        resimulator.command(command).map_err(|refused| unlike(refused.to_string()))?;
    }
    let end = match at_s {
        Some(at_s) => trail.instant_at(at_s, &resimulator).ok_or_else(|| ResimulationError::Outside {
            path: source.path.clone(),
            at_s,
            last_s: trail.ends_at_s(&resimulator),
        })?,
        None => trail.last.max(resimulator.instant()),
    };
    check(end)?;
    resimulator.go_to(end, sampling).map_err(|fault| unlike(fault.to_string()))?;
    let (simulation, epoch_start_s, scene) = resimulator.into_parts();
    let lacks = |(is_due, is_sampled): (bool, bool)| is_due && !is_sampled && end == trail.last;
    let missing = due(source, &simulation).zip(trail.sampled).map(lacks);
    Ok(Resumed { simulation, epoch_start_s, scene, answers: trail.answers, missing })
}

/// The topics that a recording samples at the present step.
fn due(source: &RecordedSession, simulation: &Simulation) -> PerTelemetry<bool> {
    let (step, grid) = (simulation.step_count(), simulation.grid());
    source.publish.map_or(PerTelemetry::default(), |rates| rates.map(|rate| rate.is_due(step, &grid)))
}

/// Whether a stamp is believed: no further than two periods of checkpoints after the last one, or after a reset. One checkpoint
/// may be lost to a full queue.
fn is_proved(at: EpochStep, last: EpochStep, step_s: f64) -> bool {
    let begin = if at.0 == last.0 { last.1 } else { 0 };
    let steps = (PROVED_S / step_s).ceil() as u64;
    at.1 <= begin.saturating_add(steps).saturating_add(2)
}

/// The topic of a sample; none of other messages.
fn telemetry(event: &Message) -> PerTelemetry<bool> {
    PerTelemetry {
        displacements: matches!(event, Message::Displacements(_)),
        angles: matches!(event, Message::Angles(_)),
        loads: matches!(event, Message::Loads(_)),
        energies: matches!(event, Message::Energies(_)),
    }
}

/// The checkpoint and commands that lead to the instant to resume at.
struct Trail {
    timeline: Timeline,
    checkpoint: Option<Checkpoint>,
    /// Commands since the checkpoint.
    commands: Vec<AppliedCommand>,
    /// Last recorded instant.
    last: EpochStep,
    /// The topics that have the sample of that instant.
    sampled: PerTelemetry<bool>,
    answers: Vec<Reply>,
    /// Whether messages are missing since the checkpoint.
    broken: bool,
    /// Whether the recording continues after the instant.
    goes_on: bool,
}

impl Trail {
    fn new(source: &RecordedSession) -> Self {
        Trail {
            timeline: Timeline::new(source),
            checkpoint: None,
            commands: Vec::new(),
            last: EpochStep::default(),
            sampled: PerTelemetry::default(),
            answers: Vec::new(),
            broken: false,
            goes_on: false,
        }
    }

    fn take(&mut self, source: &RecordedSession, message: &RecordedMessage) {
        let Ok(Some(event)) = decode(message) else { return };
        self.timeline.take(&event);
        let timely = |stamp: &wire::Stamp| self.timeline.is_timely(source, stamp, message.log_time);
        let Some(stamp) = event.stamp().filter(timely) else { return };
        let sampled = telemetry(&event);
        match event {
            Message::Gaps(gap) => {
                self.broken |= gap.topic == Topic::Commands.chunk();
                return;
            }
            report if is_report(&report) => return,
            Message::Checkpoint(checkpoint) => {
                self.commands.clear();
                self.broken = false;
                self.checkpoint = Some(*checkpoint);
            }
            Message::Commands(command) => {
                self.answers.extend(command.reply.clone().map(Reply::from));
                if !self.broken {
                    self.commands.push(*command);
                }
            }
            _ => {}
        }
        let instant = (stamp.epoch, stamp.step);
        if !self.broken {
            let before = if instant == self.last { self.sampled } else { PerTelemetry::default() };
            self.sampled = before.zip(sampled).map(|(before, now)| before || now);
            self.last = instant;
        }
    }

    /// The end of the recording, session s, unless it goes on or the end is in another epoch.
    fn ends_at_s(&self, resimulator: &Resimulator) -> Option<f64> {
        let (stamp, (epoch, step)) = (resimulator.stamp(), self.last);
        let is_end = !self.goes_on && epoch == stamp.epoch;
        is_end.then(|| stamp.epoch_start_s + resimulator.simulation().grid().time_s(step))
    }

    /// Returns the instant nearest to session time `at_s`; `None` if it is not in the recording.
    fn instant_at(&self, at_s: f64, resimulator: &Resimulator) -> Option<EpochStep> {
        let (stamp, grid) = (resimulator.stamp(), resimulator.simulation().grid());
        let steps = (at_s - stamp.epoch_start_s - grid.origin_s) / grid.step_s;
        let step = (grid.origin_step as f64 + steps.round()).max(0.0) as u64;
        let at = (stamp.epoch, step.max(stamp.step));
        (self.goes_on && !self.broken || at <= self.last).then_some(at)
    }
}
