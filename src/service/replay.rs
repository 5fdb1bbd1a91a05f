//! A recording put back on the bus: telemetry byte for byte, in order and on time; status is the replayer's own.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime};

use prost::Message as _;

use super::ServiceError;
use crate::bus::{BusError, Endpoint, Name, Session, Topic, client};
use crate::recording::{Messages, Recorded, RecordingError, is_cut_off};
use crate::runtime::{Pace, Pacer};
use crate::wire::{self, AppliedCommand, Status, applied_command::Command, status::State};

const STATUS_PERIOD: Duration = Duration::from_millis(500);
/// How long a subscriber may take to come.
const PATIENCE: Duration = Duration::from_secs(60);
const LOOK_AGAIN: Duration = Duration::from_millis(20);

/// What to replay and how.
#[derive(Debug, Clone)]
pub struct Replay {
    /// The recording.
    pub file: PathBuf,
    /// Recorded seconds per wall second.
    pub rate: f64,
    /// Begin again at the end.
    pub looped: bool,
    /// Recorded time to skip, s.
    pub start_offset_s: f64,
    /// Speak under this name instead of the recorded one.
    pub name: Option<Name>,
    /// Put recorded commands on their keys, too.
    pub commands: bool,
    /// Wait for a subscriber before the first message.
    pub wait_for_subscriber: bool,
    /// Speak under the name even if another service does.
    pub force: bool,
}

/// How a replay went.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayReport {
    /// The name it spoke under.
    pub name: Name,
    /// Messages put on the bus, status not counted.
    pub messages: u64,
    /// Recorded over wall time.
    pub achieved_rate: Option<f64>,
    /// Whether the recording ended early.
    pub cut_off: bool,
}

/// Replays until the end, or until `stop` hangs up or says anything.
///
/// # Errors
/// [`ServiceError`] when the recording cannot be read, the name is taken, or the bus refuses.
pub fn replay(session: &Session, replay: &Replay, stop: &Receiver<()>) -> Result<ReplayReport, ServiceError> {
    let first = Messages::open(&replay.file)?.next().ok_or_else(|| RecordingError::Empty { path: replay.file.clone() })??;
    let Some((recorded, _)) = Name::split(&first.channel.topic) else {
        return Err(ServiceError::NotOurs(replay.file.clone()));
    };
    let name = replay.name.clone().unwrap_or(recorded);
    if !replay.force && client::is_taken(session, &name)? {
        return Err(BusError::Taken(name).into());
    }
    let scene = format!("# replayed from {}\n", file_name(&replay.file));
    let endpoint = Endpoint::declare(session, &name, &scene, None)?;
    if replay.wait_for_subscriber {
        wait_for_subscriber(&endpoint, stop)?;
    }
    let begin_s = replay.start_offset_s;
    let mut player = Player {
        session,
        endpoint,
        replay,
        name,
        begin_ns: first.log_time,
        clock: Instant::now(),
        pacer: Pacer::new(Pace::Factor(replay.rate), Duration::ZERO, begin_s),
        next_status: Duration::ZERO,
        now_s: begin_s,
        messages: 0,
    };
    let cut_off = player.play(stop)?;
    player.status(State::Finished);
    let achieved_rate = player.pacer.real_time_factor(player.clock.elapsed(), player.now_s);
    let Player { endpoint, name, messages, .. } = player;
    endpoint.close()?;
    Ok(ReplayReport { name, messages, achieved_rate, cut_off })
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn wait_for_subscriber(endpoint: &Endpoint, stop: &Receiver<()>) -> Result<(), ServiceError> {
    let begun = Instant::now();
    while !endpoint.has_subscriber()? {
        if begun.elapsed() > PATIENCE {
            return Err(ServiceError::NobodyListens(PATIENCE.as_secs()));
        }
        if stop.recv_timeout(LOOK_AGAIN) != Err(RecvTimeoutError::Timeout) {
            break;
        }
    }
    Ok(())
}

struct Player<'a> {
    session: &'a Session,
    endpoint: Endpoint,
    replay: &'a Replay,
    name: Name,
    begin_ns: u64,
    clock: Instant,
    pacer: Pacer,
    next_status: Duration,
    now_s: f64,
    messages: u64,
}

impl Player<'_> {
    /// Plays once, or again and again; returns whether the recording ended early.
    fn play(&mut self, stop: &Receiver<()>) -> Result<bool, ServiceError> {
        loop {
            let mut cut_off = false;
            for message in Messages::open(&self.replay.file)? {
                match message {
                    Ok(message) if self.play_one(&message, stop)? => {}
                    Ok(_) => return Ok(cut_off),
                    Err(error) if is_cut_off(&error) => cut_off = true,
                    Err(error) => return Err(error.into()),
                }
            }
            if !self.replay.looped {
                return Ok(cut_off);
            }
            self.pacer.anchor(self.clock.elapsed(), self.replay.start_offset_s);
        }
    }

    /// Waits until a message is due and puts it on the bus; `false` when told to stop.
    fn play_one(&mut self, message: &Recorded, stop: &Receiver<()>) -> Result<bool, ServiceError> {
        let at_s = (message.log_time as f64 - self.begin_ns as f64) * 1e-9;
        if at_s < self.replay.start_offset_s {
            return Ok(true);
        }
        loop {
            let now = self.clock.elapsed();
            if now >= self.next_status {
                self.status(State::Replaying);
            }
            let wait = self.pacer.deadline(at_s).unwrap_or(now).saturating_sub(now);
            match stop.recv_timeout(wait.min(STATUS_PERIOD)) {
                Err(RecvTimeoutError::Timeout) if wait <= STATUS_PERIOD => break,
                Err(RecvTimeoutError::Timeout) => {}
                Ok(()) | Err(RecvTimeoutError::Disconnected) => return Ok(false),
            }
        }
        self.now_s = at_s;
        self.put(message)?;
        Ok(true)
    }

    fn put(&mut self, message: &Recorded) -> Result<(), ServiceError> {
        let topic = &message.channel.topic;
        let ours = Name::split(topic).and_then(|(_, chunk)| Topic::ALL.into_iter().find(|topic| topic.chunk() == chunk));
        match ours {
            Some(Topic::Status) => return Ok(()),
            Some(Topic::Commands) if !self.replay.commands => return Ok(()),
            Some(Topic::Commands) => self.put_command(message)?,
            Some(_) => {}
            None => return Ok(()),
        }
        if let Some(topic) = ours {
            self.endpoint.publish(topic, message.data.to_vec());
            self.messages += 1;
        }
        Ok(())
    }

    fn put_command(&self, message: &Recorded) -> Result<(), ServiceError> {
        let Ok(applied) = AppliedCommand::decode(message.data.as_ref()) else { return Ok(()) };
        match applied.command {
            Some(Command::Torque(pulse)) => {
                client::put(self.session, &self.name.torque(), &pulse.encode_to_vec(), "flexcrank.v1.TorquePulse")?;
            }
            Some(Command::Control(control)) => {
                client::put(self.session, &self.name.control(), &control.encode_to_vec(), "flexcrank.v1.Control")?;
            }
            None => {}
        }
        Ok(())
    }

    fn status(&mut self, state: State) {
        let now = self.clock.elapsed();
        self.next_status = now + STATUS_PERIOD;
        let status = Status {
            stamp: Some(wire::Stamp {
                sim_time_s: self.now_s,
                wall_time: Some(wire::timestamp(SystemTime::now())),
                ..wire::Stamp::default()
            }),
            state: state.into(),
            real_time_factor: self.pacer.real_time_factor(now, self.now_s),
            message: format!("replaying {}", file_name(&self.replay.file)),
            ..Status::default()
        };
        self.endpoint.publish(Topic::Status, status.encode_to_vec());
    }
}
