//! The viewers' timeline on a replay: play, pause, seek, rate.

use std::sync::mpsc::Sender;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use ::foxglove::websocket::{PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus};
use prost::Message as _;

use crate::service::{RATES, ReplayAction, ReplayCommand};
use crate::wire::{Replay, Status, status::State};

/// A position that differs by more than this from where playing would have led is a jump, s of wall time.
const JUMP_S: f64 = 0.25;

/// The timeline of a replay, driven by viewers.
pub struct Timeline {
    /// Log times of the first and the last message, ns since 1970.
    span_ns: (u64, u64),
    commands: Mutex<Sender<ReplayCommand>>,
    /// The last known place.
    place: Mutex<Option<Place>>,
}

/// The place of a replay at an instant.
#[derive(Debug, Clone, Copy)]
struct Place {
    at: Instant,
    position_s: f64,
    rate: f64,
    status: PlaybackStatus,
}

impl Place {
    /// The position at which playing on arrives at `now`, s.
    fn position_at(&self, now: Instant) -> f64 {
        let played_s = if self.status == PlaybackStatus::Playing { (now - self.at).as_secs_f64() * self.rate } else { 0.0 };
        self.position_s + played_s
    }
}

impl Timeline {
    /// The timeline of a replay of messages within `span_ns`, whose commands go into this queue.
    pub fn new(span_ns: (u64, u64), commands: Sender<ReplayCommand>) -> Self {
        Timeline { span_ns, commands: Mutex::new(commands), place: Mutex::default() }
    }

    /// Log times of the first and the last message, ns since 1970.
    pub(super) fn span_ns(&self) -> (u64, u64) {
        self.span_ns
    }

    /// Sends a viewer's request to the replay, and returns the state that it leads to.
    pub(super) fn request(&self, request: &PlaybackControlRequest) -> PlaybackState {
        let mut known = self.place.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        let start = Place { at: now, position_s: 0.0, rate: 1.0, status: PlaybackStatus::Paused };
        let before = known.unwrap_or(start);
        let mut after = Place { at: now, position_s: before.position_at(now), ..before };
        let rate = f64::from(request.playback_speed);
        if rate.is_finite() && rate > 0.0 {
            after.rate = rate.clamp(*RATES.start(), *RATES.end());
            self.send(ReplayAction::Rate(after.rate));
        }
        if let Some(to_ns) = request.seek_time {
            after.position_s = self.position_s(to_ns);
            self.send(ReplayAction::Seek(after.position_s));
        }
        (after.status, _) = match request.playback_command {
            PlaybackCommand::Play => (PlaybackStatus::Playing, self.send(ReplayAction::Resume)),
            PlaybackCommand::Pause => (PlaybackStatus::Paused, self.send(ReplayAction::Pause)),
        };
        *known = Some(after);
        self.state(after, request.seek_time.is_some())
    }

    /// Follows an encoded status of the replay. Returns its state if the viewers do not know it yet.
    pub(super) fn follow(&self, payload: &[u8]) -> Option<PlaybackState> {
        let status = Status::decode(payload).ok()?;
        let Replay { duration_s, rate, paused, .. } = *status.replay.as_ref()?;
        let position_s = status.stamp.as_ref()?.sim_time_s;
        let ended = status.state() == State::Finished || paused && position_s >= duration_s;
        let playback = match (ended, paused) {
            (true, _) => PlaybackStatus::Ended,
            (false, true) => PlaybackStatus::Paused,
            (false, false) => PlaybackStatus::Playing,
        };
        let now = Instant::now();
        let mut known = self.place.lock().unwrap_or_else(PoisonError::into_inner);
        let after = Place { at: now, position_s, rate, status: playback };
        let before = known.replace(after);
        let jumped = before.is_some_and(|before| (position_s - before.position_at(now)).abs() > JUMP_S * rate.max(before.rate));
        let changed = before.is_none_or(|before| before.status != playback || before.rate != rate);
        (jumped || changed).then(|| self.state(after, jumped))
    }

    fn send(&self, action: ReplayAction) {
        // A replay that is over needs no command.
        let _ = self.commands.lock().unwrap_or_else(PoisonError::into_inner).send(ReplayCommand::quiet(action));
    }

    /// A log time as a position within the recording, s.
    fn position_s(&self, log_time_ns: u64) -> f64 {
        let (first, last) = self.span_ns;
        (log_time_ns.clamp(first, last) - first) as f64 * 1e-9
    }

    fn state(&self, place: Place, did_seek: bool) -> PlaybackState {
        let (first, last) = self.span_ns;
        let current_time = first.saturating_add((place.position_s.max(0.0) * 1e9).round() as u64).min(last);
        PlaybackState { status: place.status, current_time, playback_speed: place.rate as f32, did_seek, request_id: None }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;
    use crate::wire::Stamp;

    const SPAN_NS: (u64, u64) = (1_000_000_000_000, 1_010_000_000_000);

    fn request(playback_command: PlaybackCommand, playback_speed: f32, seek_time: Option<u64>) -> PlaybackControlRequest {
        PlaybackControlRequest { playback_command, playback_speed, seek_time, request_id: "one".to_owned() }
    }

    fn status(position_s: f64, rate: f64, paused: bool) -> Vec<u8> {
        let replay = Replay { duration_s: 10.0, rate, paused, ..Replay::default() };
        let stamp = Some(Stamp { sim_time_s: position_s, ..Stamp::default() });
        Status { stamp, state: State::Replaying.into(), replay: Some(replay), ..Status::default() }.encode_to_vec()
    }

    #[test]
    fn prop_a_request_becomes_commands_within_the_recording() {
        let (sender, commands) = channel();
        let timeline = Timeline::new(SPAN_NS, sender);
        let state = timeline.request(&request(PlaybackCommand::Play, 2.0, Some(SPAN_NS.0 + 3_500_000_000)));
        let sent: Vec<ReplayAction> = commands.try_iter().map(|command| command.action).collect();
        assert_eq!(sent, [ReplayAction::Rate(2.0), ReplayAction::Seek(3.5), ReplayAction::Resume]);
        assert_eq!((state.current_time, state.did_seek), (SPAN_NS.0 + 3_500_000_000, true));
        timeline.request(&request(PlaybackCommand::Pause, f32::NAN, Some(u64::MAX)));
        let sent: Vec<ReplayAction> = commands.try_iter().map(|command| command.action).collect();
        assert_eq!(sent, [ReplayAction::Seek(10.0), ReplayAction::Pause]);
    }

    #[test]
    fn prop_viewers_receive_changes_only() {
        let timeline = Timeline::new(SPAN_NS, channel().0);
        assert!(timeline.follow(&status(1.0, 1.0, true)).is_some_and(|state| state.status == PlaybackStatus::Paused));
        assert_eq!(timeline.follow(&status(1.0, 1.0, true)), None);
        assert!(timeline.follow(&status(4.0, 1.0, true)).is_some_and(|state| state.did_seek));
        assert!(timeline.follow(&status(4.0, 2.0, true)).is_some_and(|state| !state.did_seek && state.playback_speed == 2.0));
        assert!(timeline.follow(&status(10.0, 2.0, true)).is_some_and(|state| state.status == PlaybackStatus::Ended));
        assert_eq!(timeline.follow(b"\xff"), None);
    }
}
