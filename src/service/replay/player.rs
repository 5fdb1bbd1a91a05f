//! The playing thread: it waits for deadlines, publishes recorded messages and handles commands in between.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime};

use prost::{Message as _, Name as _};

use super::command::{RATES, ReplayAction, ReplayCommand, refuse};
use super::read_ahead::ReadAhead;
use super::route::Routes;
use super::timeline::Timeline;
use super::{ReplayOptions, ReplayReport, ReplayViewer};
use crate::bus::{Name, ServiceEndpoint, Session, Topic, client, subscribed_sessions};
use crate::recording::{RecordedMessage, RecordingFile};
use crate::runtime::{DeadlineWait, DurationHistogram, Reply, ReplyCache, STATUS_PERIOD, deadline_wait, exact_timers};
use crate::service::status::with_lateness;
use crate::service::{OnStatus, ServiceError};
use crate::shown::{figure, shown_s};
use crate::simulation::Effective;
use crate::wire::{self, AppliedCommand, Control, Setpoint, Status, TorquePulse, applied_command::Command, status::State};

/// Busy-waiting time before a deadline: about as much as a sleep ends late on a quiet machine.
const SPIN: Duration = Duration::from_micros(100);
/// Time between two looks at the subscriptions.
const POLL_PERIOD: Duration = Duration::from_millis(20);
/// Subscriptions count as settled after this time without a change: a program subscribes to several topics one by one.
const SETTLED: Duration = Duration::from_millis(200);

pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The result of waiting for a message's deadline.
enum WaitOutcome {
    /// The message is due.
    Due,
    /// The message is obsolete: the replay has jumped.
    Moved,
    /// The replay has ended.
    Stop,
}

/// The place in the recording, as commands change it.
#[derive(Default)]
pub(super) struct Cursor {
    /// Recorded time of the next message, s.
    pub next_s: f64,
    /// Messages to be played one by one while paused.
    pending_single_messages: u64,
    /// Whether the replay has jumped since it began to wait for a message.
    pub moved: bool,
    pub stopping: bool,
    /// Whether the replay stays at the end of the recording, paused.
    pub stays_at_end: bool,
}

pub(super) struct Player<'a> {
    session: &'a Session,
    pub replay: &'a ReplayOptions,
    pub source: Arc<RecordingFile>,
    endpoint: ServiceEndpoint,
    routes: Routes,
    commands: Receiver<ReplayCommand>,
    on_status: OnStatus,
    read_ahead: ReadAhead,
    pub clock: Instant,
    pub timeline: Timeline,
    pub cursor: Cursor,
    pub next_status: Duration,
    replies: ReplyCache,
    lateness: DurationHistogram,
    pub messages: u64,
}

impl<'a> Player<'a> {
    pub fn new(
        session: &'a Session,
        replay: &'a ReplayOptions,
        source: Arc<RecordingFile>,
        (endpoint, routes): (ServiceEndpoint, Routes),
        commands: Receiver<ReplayCommand>,
        viewer: ReplayViewer,
    ) -> Result<Self, ServiceError> {
        let begin_s = replay.start_offset_s;
        let ReplayViewer { on_status, log_time, stays_at_end } = viewer;
        let read_ahead = ReadAhead::start(&source, log_time_ns(&source, begin_s))?;
        Ok(Player {
            session,
            replay,
            source,
            endpoint: endpoint.with_log_time(log_time),
            routes,
            commands,
            on_status,
            read_ahead,
            clock: Instant::now(),
            timeline: Timeline::new(replay.rate, begin_s),
            cursor: Cursor { next_s: begin_s, stays_at_end, ..Cursor::default() },
            next_status: Duration::ZERO,
            replies: ReplyCache::default(),
            lateness: DurationHistogram::new()?,
            messages: 0,
        })
    }

    /// Plays until the end or a stop command.
    pub fn play(&mut self) -> Result<(), ServiceError> {
        exact_timers();
        self.await_subscribers()?;
        // The sessions that were waited for have not received a status yet.
        self.next_status = Duration::ZERO;
        let begin = self.clock.elapsed() + self.replay.delay;
        while !self.cursor.stopping && self.clock.elapsed() < begin {
            self.wait_and_serve(Some(begin))?;
        }
        if !self.replay.start_paused {
            self.timeline.go(self.clock.elapsed());
        }
        self.status(State::Replaying);
        while !self.cursor.stopping {
            let Some(message) = self.read_ahead.next() else {
                if !self.goes_on_at_end()? {
                    break;
                }
                continue;
            };
            let message = message?;
            let at_s = self.source.seconds(message.log_time);
            if at_s > self.end_s() {
                if !self.goes_on_at_end()? {
                    break;
                }
                continue;
            }
            if self.routes.of(message.channel.id).is_none() {
                continue;
            }
            self.cursor.next_s = at_s;
            match self.wait_until_due(at_s)? {
                WaitOutcome::Due => self.put(&message, at_s)?,
                WaitOutcome::Moved => {}
                WaitOutcome::Stop => break,
            }
        }
        Ok(())
    }

    /// Recorded time at which the replay ends, s.
    pub fn end_s(&self) -> f64 {
        self.replay.duration_s.map_or(f64::INFINITY, |duration_s| self.replay.start_offset_s + duration_s)
    }

    /// Waits until enough programs subscribe. Whether someone subscribes is asked often; how many do, only when nothing has changed
    /// for a while: see [`subscribed_sessions`].
    fn await_subscribers(&mut self) -> Result<(), ServiceError> {
        let wanted = self.replay.wait_for;
        let begun = Instant::now();
        let (mut subscribed, mut since, mut found) = (BTreeSet::new(), begun, 0);
        while !self.cursor.stopping && wanted > 0 {
            let now = self.routes.subscribed()?;
            if now != subscribed {
                (subscribed, since) = (now, Instant::now());
            }
            let (settled, over) = (since.elapsed() >= SETTLED, begun.elapsed() > self.replay.wait_timeout);
            if !subscribed.is_empty() && (settled || over) {
                found = if wanted == 1 { 1 } else { subscribed_sessions(self.session, &self.routes.keys)? };
                if settled && found >= wanted {
                    break;
                }
                if settled {
                    since = Instant::now();
                }
            }
            if over && found < wanted {
                return Err(ServiceError::NobodyListens { found, wanted, waited_s: begun.elapsed().as_secs_f64() });
            }
            self.wait_and_serve(Some(self.clock.elapsed() + POLL_PERIOD))?;
        }
        Ok(())
    }

    fn wait_until_due(&mut self, at_s: f64) -> Result<WaitOutcome, ServiceError> {
        self.cursor.moved = false;
        while let Ok(command) = self.commands.try_recv() {
            self.handle_command(command)?;
        }
        loop {
            if self.cursor.stopping {
                return Ok(WaitOutcome::Stop);
            }
            if self.cursor.moved {
                return Ok(WaitOutcome::Moved);
            }
            if !self.timeline.is_running() && self.cursor.pending_single_messages > 0 {
                self.cursor.pending_single_messages -= 1;
                return Ok(WaitOutcome::Due);
            }
            let deadline = self.timeline.deadline(at_s);
            if deadline.is_some_and(|deadline| self.clock.elapsed() >= deadline) {
                return Ok(WaitOutcome::Due);
            }
            self.wait_and_serve(deadline)?;
        }
    }

    /// Waits until the deadline, the next status or a command, and handles that.
    pub fn wait_and_serve(&mut self, deadline: Option<Duration>) -> Result<(), ServiceError> {
        let now = self.clock.elapsed();
        if now >= self.next_status {
            self.status(State::Replaying);
        }
        let until = deadline.map_or(self.next_status, |deadline| deadline.min(self.next_status));
        match deadline_wait(self.clock.elapsed(), until, SPIN) {
            DeadlineWait::Due => Ok(()),
            DeadlineWait::Watch => {
                std::hint::spin_loop();
                Ok(())
            }
            DeadlineWait::Sleep(time) => self.sleep(time),
        }
    }

    /// Sleeps; a command ends the sleep early.
    fn sleep(&mut self, time: Duration) -> Result<(), ServiceError> {
        match self.commands.recv_timeout(time) {
            Ok(command) => self.handle_command(command),
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => {
                self.cursor.stopping = true;
                Ok(())
            }
        }
    }

    fn handle_command(&mut self, command: ReplayCommand) -> Result<(), ServiceError> {
        let ReplayCommand { id, action, reply } = command;
        if let Some(answer) = self.replies.get(&id, action.kind()) {
            reply(answer.into());
            return Ok(());
        }
        let kind = action.kind();
        match self.apply(action)? {
            Ok(reason) => {
                let effective = Effective { step: 0, sim_time_s: self.position_s() };
                let answer = Reply { reason, ..Reply::accepted(id, effective) };
                self.replies.insert(&answer, Some(kind));
                reply(answer.into());
            }
            Err(reason) => refuse(id, reason, reply),
        }
        // A change is published at once.
        self.next_status = Duration::ZERO;
        Ok(())
    }

    /// Applies an action. Returns what was done, or why not.
    fn apply(&mut self, action: ReplayAction) -> Result<Result<String, String>, ServiceError> {
        let now = self.clock.elapsed();
        let duration_s = self.source.duration_s();
        Ok(Ok(match action {
            ReplayAction::Toggle if self.timeline.is_running() => return self.apply(ReplayAction::Pause),
            ReplayAction::Toggle => return self.apply(ReplayAction::Resume),
            ReplayAction::Pause if !self.timeline.is_running() => "was paused already".to_owned(),
            ReplayAction::Pause => {
                self.timeline.hold(now, self.cursor.next_s);
                "paused".to_owned()
            }
            ReplayAction::Resume if self.timeline.is_running() => "was playing already".to_owned(),
            ReplayAction::Resume => {
                self.cursor.pending_single_messages = 0;
                self.timeline.go(now);
                "playing".to_owned()
            }
            ReplayAction::Seek(to_s) if !(0.0..=duration_s).contains(&to_s) => {
                return Ok(Err(format!("the recording goes from 0 to {} s", shown_s(duration_s))));
            }
            ReplayAction::Seek(to_s) => {
                self.move_to(to_s)?;
                "moved".to_owned()
            }
            ReplayAction::Skip(by_s) => return self.apply(ReplayAction::Seek((self.position_s() + by_s).clamp(0.0, duration_s))),
            ReplayAction::Rate(rate) => {
                self.timeline.set_rate(now, rate, self.cursor.next_s);
                format!("{} times the recorded speed", figure(rate))
            }
            ReplayAction::Faster(factor) => {
                let rate = (self.timeline.rate() * factor).clamp(*RATES.start(), *RATES.end());
                return self.apply(ReplayAction::Rate(rate));
            }
            ReplayAction::Next(_) if self.timeline.is_running() => {
                return Ok(Err("messages are played one by one only when paused: pause first".to_owned()));
            }
            ReplayAction::Next(count) => {
                self.cursor.pending_single_messages = self.cursor.pending_single_messages.saturating_add(count);
                format!("playing {count} message{}", if count == 1 { "" } else { "s" })
            }
            ReplayAction::Stop => {
                self.cursor.stopping = true;
                "ending".to_owned()
            }
        }))
    }

    pub fn move_to(&mut self, to_s: f64) -> Result<(), ServiceError> {
        self.read_ahead = ReadAhead::start(&self.source, log_time_ns(&self.source, to_s))?;
        self.timeline.jump(self.clock.elapsed(), to_s);
        (self.cursor.next_s, self.cursor.moved, self.cursor.pending_single_messages) = (to_s, true, 0);
        Ok(())
    }

    /// Position in recorded time, never past the next message, s.
    fn position_s(&self) -> f64 {
        self.timeline.position_s(self.clock.elapsed()).min(self.cursor.next_s)
    }

    fn put(&mut self, message: &RecordedMessage, at_s: f64) -> Result<(), ServiceError> {
        let Some(route) = self.routes.of(message.channel.id) else { return Ok(()) };
        if let Some(late) = self.timeline.put(self.clock.elapsed(), at_s) {
            self.lateness.record(late);
        }
        self.endpoint.note_log_time(|| message.log_time);
        // Kept first, as by a service: a client that subscribes too late for the message finds it in the snapshot.
        let number = route.topic.map(|topic| self.endpoint.keep(topic, message.data.to_vec()).0);
        route.publisher.put(&message.data, number)?;
        self.messages += 1;
        if route.topic == Some(Topic::Commands) {
            self.put_command(message)?;
        }
        Ok(())
    }

    /// Publishes a recorded command on the key it was sent to.
    fn put_command(&self, message: &RecordedMessage) -> Result<(), ServiceError> {
        let Ok(applied) = AppliedCommand::decode(message.data.as_ref()) else { return Ok(()) };
        let keys = &self.routes.commands;
        let (key, payload, schema) = match applied.command {
            Some(Command::Torque(pulse)) => (&keys.torque, pulse.encode_to_vec(), TorquePulse::full_name()),
            Some(Command::Setpoint(setpoint)) => (&keys.setpoint, setpoint.encode_to_vec(), Setpoint::full_name()),
            Some(Command::Control(control)) => (&keys.control, control.encode_to_vec(), Control::full_name()),
            // An advance is sent as a query only.
            Some(Command::Advance(_)) | None => return Ok(()),
        };
        Ok(client::put(self.session, key, &payload, &schema)?)
    }

    fn status(&mut self, state: State) {
        self.next_status = self.clock.elapsed() + STATUS_PERIOD;
        let file = file_name(&self.replay.file);
        let status = Status {
            stamp: Some(wire::Stamp {
                sim_time_s: self.position_s(),
                wall_time: Some(wire::timestamp(SystemTime::now())),
                ..wire::Stamp::default()
            }),
            state: state.into(),
            real_time_factor: self.timeline.achieved_rate(),
            message: format!("replaying {file}"),
            replay: Some(wire::Replay {
                file,
                duration_s: self.source.duration_s(),
                rate: self.timeline.rate(),
                paused: !self.timeline.is_running(),
            }),
            ..with_lateness(self.lateness.quantiles())
        };
        (self.on_status)(&status);
        self.endpoint.note_log_time(|| log_time_ns(&self.source, self.position_s()));
        self.endpoint.publish(Topic::Status, status.encode_to_vec());
    }

    /// Publishes the final status, leaves the bus, and reports.
    pub fn close(mut self, name: Name) -> Result<ReplayReport, ServiceError> {
        self.status(State::Finished);
        let report = ReplayReport {
            name,
            messages: self.messages,
            achieved_rate: self.timeline.achieved_rate(),
            lateness: self.lateness.quantiles(),
            slips: self.timeline.slips,
            cut_off: self.source.is_cut_off(),
            left_out: Vec::new(),
        };
        self.endpoint.close()?;
        Ok(report)
    }
}

fn log_time_ns(source: &RecordingFile, at_s: f64) -> u64 {
    source.begin_ns().saturating_add((at_s.max(0.0) * 1e9).round() as u64)
}
