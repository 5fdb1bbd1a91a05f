//! A viewer in the same process, beside a replay.

use crate::bus::{LogTime, Name};
use crate::recording::Channel;
use crate::service::OnStatus;

/// A replay on the bus that has not begun to play.
#[derive(Debug)]
pub struct ReplayStart<'a> {
    /// Name of the replay.
    pub name: &'a Name,
    /// Recorded topics that are played, with their keys.
    pub channels: &'a [(Channel, String)],
    /// Log times of the first and the last message, ns since 1970.
    pub span_ns: (u64, u64),
}

/// The wishes of a viewer in the same process.
pub struct ReplayViewer {
    /// Receives every status of the replay.
    pub on_status: OnStatus,
    /// Receives the log time of every message.
    pub log_time: Option<LogTime>,
    /// At the end of the recording, the replay stays there, paused, instead of ending.
    pub stays_at_end: bool,
}

impl From<OnStatus> for ReplayViewer {
    /// A viewer that only sees the status.
    fn from(on_status: OnStatus) -> Self {
        ReplayViewer { on_status, log_time: None, stays_at_end: false }
    }
}
