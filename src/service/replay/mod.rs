//! A recording put back on the bus: telemetry byte for byte, in order and on time; status is the replayer's own.

mod command;
mod player;
mod read_ahead;
mod route;
mod timeline;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Duration;

use super::{OnStatus, ServiceError};
use crate::bus::{BusError, Name, ReplayEndpoint, ServiceEndpoint, Session, client};
use crate::recording::RecordingFile;
use crate::runtime::{DurationQuantiles, ReplyTo};
use crate::wire::replay_control;
use player::Player;
use route::Routes;

pub use command::{RATES, ReplayAction, ReplayCommand};
pub use route::{BadRemap, Remap};

/// What to replay and how.
#[derive(Debug, Clone)]
pub struct ReplayOptions {
    /// The recording.
    pub file: PathBuf,
    /// Recorded seconds per wall second.
    pub rate: f64,
    /// Begin restart_if_looped at the end.
    pub looped: bool,
    /// Recorded time to skip, s.
    pub start_offset_s: f64,
    /// Recorded time to play; to the end without it; s.
    pub duration_s: Option<f64>,
    /// Begin paused.
    pub start_paused: bool,
    /// Wall time to wait before the first message.
    pub delay: Duration,
    /// Recorded topics to play, whole or by their last chunks; all when empty.
    pub topics: Vec<String>,
    /// Topics to rename.
    pub remaps: Vec<Remap>,
    /// Speak under this name instead of the recorded one.
    pub name: Option<Name>,
    /// Put recorded commands on their keys, too.
    pub commands: bool,
    /// Sessions that must subscribe before the first message.
    pub wait_for: usize,
    /// How long they may take to come.
    pub wait_timeout: Duration,
    /// Speak under the name even if another service does.
    pub force: bool,
}

impl Default for ReplayOptions {
    /// No file; once, from beginning to end, as recorded, at once.
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
        }
    }
}

/// How a replay went.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayReport {
    /// The name it spoke under.
    pub name: Name,
    /// Messages put on the bus, status not counted.
    pub messages: u64,
    /// Recorded over wall time from the first message to the last, pauses and jumps left out.
    pub achieved_rate: Option<f64>,
    /// How late puts began, against their deadlines: quantiles 0.5, 0.99, 0.999 and the largest, s.
    pub lateness: Option<DurationQuantiles>,
    /// How often it fell behind by more than a second, and went on from there without catching up.
    pub slips: u64,
    /// Whether the recording ended early.
    pub cut_off: bool,
    /// Topics that cannot be keys, with the reason; they were left out.
    pub left_out: Vec<String>,
}

/// Ends of the queue of commands to a replayer.
pub type ReplayCommands = (Sender<ReplayCommand>, Receiver<ReplayCommand>);

/// Replays until the end, or until it is ordered to stop. ReplayCommands come from the bus, and from whoever has the queue's sender.
///
/// # Errors
/// [`ServiceError`] when the recording cannot be read, what is asked for is not in it, the name is taken, or the bus refuses.
pub fn replay(
    session: &Session,
    replay: &ReplayOptions,
    commands: ReplayCommands,
    on_status: OnStatus,
) -> Result<ReplayReport, ServiceError> {
    let source = Arc::new(RecordingFile::open(&replay.file)?);
    if replay.start_offset_s > source.duration_s() {
        return Err(ServiceError::PastTheEnd { offset_s: replay.start_offset_s, duration_s: source.duration_s() });
    }
    let plan = route::plan(replay, &source)?;
    if !replay.force {
        for name in &plan.names {
            if client::is_taken(session, name)? {
                return Err(BusError::Taken(name.clone()).into());
            }
        }
    }
    let (name, left_out) = (plan.name.clone(), plan.left_out.clone());
    let routes = Routes::declare(session, plan)?;
    let endpoint =
        ServiceEndpoint::declare(session, &name, &format!("# replayed from {}\n", player::file_name(&replay.file)), None)?;
    let (sender, commands) = commands;
    let take = move |id: String, action: replay_control::Action, reply: ReplyTo| match ReplayAction::try_from(action) {
        Ok(action) => command::submit(&sender, ReplayCommand { id, action, reply }),
        Err(reason) => command::refuse(id, reason, reply),
    };
    let remote = ReplayEndpoint::declare(session, &name, &(Arc::new(take) as _))?;
    let mut player = Player::new(session, replay, source, (endpoint, routes), commands, on_status)?;
    let played = player.play();
    let mut report = player.close(name)?;
    remote.close()?;
    played?;
    report.left_out = left_out;
    Ok(report)
}
