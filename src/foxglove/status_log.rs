//! Changes of a service's status as a log.

use std::sync::{Arc, Mutex, PoisonError};

use ::foxglove::messages::{Log, Timestamp, log::Level};
use ::foxglove::{Channel, Context, PartialMetadata};
use prost::Message as _;

use crate::bus::{LogTime, Name};
use crate::wire::{Status, status::State};

/// Nanoseconds per second.
const NANOSECONDS: u64 = 1_000_000_000;

/// The log of one service: a line for every change of its state and its message.
pub(super) struct StatusLog {
    name: String,
    channel: Channel<Log>,
    log_time: LogTime,
    newest: Mutex<Newest>,
}

/// The newest line, and whether a viewer was subscribed when it was logged.
#[derive(Default)]
struct Newest {
    line: Option<(Level, String)>,
    was_received: bool,
}

impl StatusLog {
    /// Offers the log of a service to viewers.
    pub fn new(context: &Arc<Context>, name: &Name, log_time: LogTime) -> Self {
        let channel = context.channel_builder(name.key("log")).build::<Log>();
        StatusLog { name: name.presence(), channel, log_time, newest: Mutex::default() }
    }

    /// Logs an encoded status if it differs from the last, or if no viewer was subscribed then.
    pub fn follow(&self, payload: &[u8]) {
        let Ok(status) = Status::decode(payload) else { return };
        let line = line(&status);
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        let is_received = self.channel.has_sinks();
        let same = newest.line.as_ref() == Some(&line);
        if !same || (is_received && !newest.was_received) {
            self.log(&line);
        }
        *newest = Newest { line: Some(line), was_received: is_received };
    }

    fn log(&self, (level, message): &(Level, String)) {
        let time_ns = self.log_time.get();
        let seconds = u32::try_from(time_ns / NANOSECONDS).unwrap_or(u32::MAX);
        let log = Log {
            timestamp: Timestamp::new_checked(seconds, u32::try_from(time_ns % NANOSECONDS).unwrap_or(0)),
            level: (*level).into(),
            message: message.clone(),
            name: self.name.clone(),
            ..Log::default()
        };
        self.channel.log_with_meta(&log, PartialMetadata { log_time: Some(time_ns) });
    }
}

/// Level and text of a status.
fn line(status: &Status) -> (Level, String) {
    let state = status.state();
    let level = match state {
        State::Diverged => Level::Error,
        State::Running if !status.message.is_empty() => Level::Warning,
        _ => Level::Info,
    };
    let state = state.as_str_name().to_lowercase();
    let paused = if status.replay.as_ref().is_some_and(|replay| replay.paused) { ", paused" } else { "" };
    let message = if status.message.is_empty() { String::new() } else { format!(": {}", status.message) };
    let recording = status.recording.as_ref().map_or(String::new(), |file| format!(", recorded to {file}"));
    (level, format!("{state}{paused}{recording}{message}"))
}
