//! Whether a what-if is refused a recorded command for its change, or the recorded session would be without one.

use std::ops::RangeInclusive;

use super::ResimulationError;
use super::event::{decode, is_report};
use super::recorded_session::RecordedSession;
use super::resimulator::{ResimulationFault, Resimulator};
use super::timeline::Timeline;
use crate::recording::{RecordedMessage, WalkFlow, WalkItem, walk};
use crate::wire::{self, Message};

/// The error of a what-if that a fault ends at a session time, after messages of these numbers.
///
/// The service accepted the recorded torques and changes. Where one is refused, the reason is the change that was asked for, unless
/// the recorded session is refused one without it: a command before may be lost.
pub(super) fn error_of_what_if(
    source: &RecordedSession,
    (fault, at_s): (&ResimulationFault, f64),
    messages: RangeInclusive<u64>,
) -> ResimulationError {
    let (path, what) = (source.path.clone(), fault.to_string());
    if !matches!(fault, ResimulationFault::Refused(_) | ResimulationFault::Unchanged(_)) {
        return ResimulationError::Unlike { path, what };
    }
    match own_refusal(source, messages) {
        Some(what) => ResimulationError::Unlike { path, what },
        None => ResimulationError::Unsuited { path, at_s, what },
    }
}

/// Why the recorded session, without a change, cannot follow messages of these numbers; `None` if it can.
fn own_refusal(source: &RecordedSession, messages: RangeInclusive<u64>) -> Option<String> {
    let resimulator = Resimulator::new(&source.scene).ok()?;
    let mut session = Unchanged { source, timeline: Timeline::new(source), resimulator, begun: false };
    let (mut number, mut followed) = (0_u64, Ok(()));
    walk(&source.path, |found, _| {
        let WalkItem::Message(message) = found else { return WalkFlow::Continue(()) };
        number += 1;
        if messages.contains(&number) {
            followed = session.follow(message);
        }
        if followed.is_ok() && number < *messages.end() { WalkFlow::Continue(()) } else { WalkFlow::Break(()) }
    })
    .ok()?;
    let fault = followed.err()?;
    Some(format!("at t = {:.3} s, {fault}", session.resimulator.stamp().session_s()))
}

/// A recorded session that is re-simulated as it is.
struct Unchanged<'a> {
    source: &'a RecordedSession,
    timeline: Timeline,
    resimulator: Resimulator,
    begun: bool,
}

impl Unchanged<'_> {
    fn follow(&mut self, message: &RecordedMessage) -> Result<(), ResimulationFault> {
        let Ok(Some(event)) = decode(message) else { return Ok(()) };
        self.timeline.take(&event);
        let timely = |stamp: &wire::Stamp| self.timeline.is_timely(self.source, stamp, message.log_time);
        let Some(stamp) = event.stamp().filter(timely) else { return Ok(()) };
        if let (Message::Checkpoint(checkpoint), false) = (&event, self.begun) {
            self.begun = self.resimulator.restore(checkpoint);
        }
        if !self.begun || is_report(&event) {
            return Ok(());
        }
        self.resimulator.go_to((stamp.epoch, stamp.step), |_| {})?;
        match &event {
            Message::Commands(command) => self.resimulator.command(command),
            _ => Ok(()),
        }
    }
}
