//! Replay: publishes a recording on the bus again, byte for byte, in order and on time. The status is the replay's own.

mod command;
mod end;
mod player;
mod read_ahead;
mod route;
mod timeline;
mod viewer;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SendError, Sender};
use std::time::Duration;

use super::{OnStatus, ServiceError};
use crate::bus::{self, About, BusError, Name, ServiceEndpoint, Session, client};
use crate::recording::{RecordingFile, RecordingMetadata};
use crate::runtime::{DurationQuantiles, ReplyTo};
use crate::wire::replay_control;
use command::refuse;
use player::Player;
use route::Routes;

pub use command::{RATES, ReplayAction, ReplayCommand};
pub use route::{BadRemap, Remap};
pub use viewer::{ReplayStart, ReplayViewer};

/// Options of a replay.
#[derive(Debug, Clone)]
pub struct ReplayOptions {
    /// The recording.
    pub file: PathBuf,
    /// Recorded seconds per wall second.
    pub rate: f64,
    /// Start again at the end.
    pub looped: bool,
    /// Recorded time to skip, s.
    pub start_offset_s: f64,
    /// Recorded time to play, s; `None` plays to the end.
    pub duration_s: Option<f64>,
    /// Start paused.
    pub start_paused: bool,
    /// Wall time to wait before the first message.
    pub delay: Duration,
    /// Topics to play, by full name or last chunks; empty plays all.
    pub topics: Vec<String>,
    /// Topics to rename.
    pub remaps: Vec<Remap>,
    /// Name of the service on the bus instead of the recorded one.
    pub name: Option<Name>,
    /// Also publish recorded commands on their keys, whether `topics` names them or not.
    pub commands: bool,
    /// Sessions that must subscribe before the first message.
    pub wait_for: usize,
    /// Longest time to wait for those sessions.
    pub wait_timeout: Duration,
    /// Use the name even if another service has it.
    pub force: bool,
    /// Endpoints that the session listens on, for [`About`].
    pub endpoints: Vec<String>,
}

impl Default for ReplayOptions {
    /// No file; plays once, from beginning to end, at the recorded speed, without waiting.
    fn default() -> Self {
        ReplayOptions {
            file: PathBuf::new(),
            rate: 1.0,
            looped: false,
            start_offset_s: 0.0,
            duration_s: None,
            start_paused: false,
            delay: Duration::ZERO,
            topics: Vec::new(),
            remaps: Vec::new(),
            name: None,
            commands: false,
            wait_for: 0,
            wait_timeout: Duration::from_secs(60),
            force: false,
            endpoints: Vec::new(),
        }
    }
}

/// The result of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayReport {
    /// Name of the service on the bus.
    pub name: Name,
    /// Messages published, status messages excluded.
    pub messages: u64,
    /// Recorded over wall time from first to last message, pauses and jumps excluded.
    pub achieved_rate: Option<f64>,
    /// Lateness of the messages against their deadlines.
    pub lateness: Option<DurationQuantiles>,
    /// Number of times the replay fell behind by more than a second and did not catch up.
    pub slips: u64,
    /// Whether the recording ended early.
    pub cut_off: bool,
    /// Topics left out because their names are not valid keys, with the reason.
    pub left_out: Vec<String>,
}

/// Both ends of the queue of commands to a replay.
pub type ReplayCommands = (Sender<ReplayCommand>, Receiver<ReplayCommand>);

/// Replays until the end or a stop command. Commands come from the bus, and from other holders of the queue's sender.
/// `on_the_bus` is called once, with the name of the replay, and returns the function that receives every status.
///
/// # Errors
/// [`ServiceError`] if the recording cannot be read, a requested topic or time is not in it, the name is taken, or the bus
/// refuses.
pub fn replay(
    session: &Session,
    replay: &ReplayOptions,
    commands: ReplayCommands,
    on_the_bus: impl FnOnce(&Name) -> OnStatus,
) -> Result<ReplayReport, ServiceError> {
    replay_beside(session, replay, commands, |start| Ok(on_the_bus(start.name).into()))
}

/// Replays as [`replay()`] does, beside a viewer in the same process. `on_the_bus` is called once, before the first message.
///
/// # Errors
/// [`ServiceError`] as [`replay()`], or that of `on_the_bus`.
pub fn replay_beside(
    session: &Session,
    replay: &ReplayOptions,
    commands: ReplayCommands,
    on_the_bus: impl FnOnce(&ReplayStart<'_>) -> Result<ReplayViewer, ServiceError>,
) -> Result<ReplayReport, ServiceError> {
    let source = Arc::new(RecordingFile::open(&replay.file)?);
    if replay.start_offset_s > source.duration_s() {
        return Err(ServiceError::PastTheEnd { offset_s: replay.start_offset_s, duration_s: source.duration_s() });
    }
    let plan = route::plan(replay, &source)?;
    let wary: Vec<_> = plan.names.iter().filter(|_| !replay.force).collect();
    if let Some(taken) = client::first_taken(session, &wary)? {
        return Err(BusError::Taken(taken).into());
    }
    let (name, left_out) = (plan.name.clone(), plan.left_out.clone());
    let channels = plan.channels.clone();
    let routes = Routes::declare(session, plan)?;
    let (sender, commands) = commands;
    let handle = move |id: String, action: replay_control::Action, reply: ReplyTo| match ReplayAction::try_from(action) {
        Ok(action) => {
            if let Err(SendError(command)) = sender.send(ReplayCommand { id, action, reply }) {
                refuse(command.id, "the replay is over".to_owned(), command.reply);
            }
        }
        Err(reason) => refuse(id, reason, reply),
    };
    let command_keys = bus::replay_commands(session, &name, handle)?;
    let recorded = RecordingMetadata::read(&replay.file).ok().and_then(|metadata| metadata.scene).unwrap_or_default();
    let scene = format!("# replayed from {}\n{}", player::file_name(&replay.file), recorded);
    let about = About::new(replay.file.display().to_string(), &replay.endpoints);
    let endpoint = ServiceEndpoint::declare(session, &name, (&scene, &about), command_keys)?;
    let span_ns = (source.begin_ns(), source.end_ns());
    let viewer = on_the_bus(&ReplayStart { name: &name, channels: &channels, span_ns })?;
    let mut player = Player::new(session, replay, source, (endpoint, routes), commands, viewer)?;
    let played = player.play();
    let mut report = player.close(name)?;
    played?;
    report.left_out = left_out;
    Ok(report)
}
