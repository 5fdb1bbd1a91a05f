//! Session information in a recording: the metadata record, and the scene as an attachment.

use std::fs;
use std::io::{Seek, Write};
use std::time::{Duration, SystemTime};

use mcap::{Attachment, Writer};

use super::build_info;
use crate::wire;

/// Name of the metadata record.
pub(crate) const METADATA: &str = "flexcrank";
/// Name of the attachment with the scene.
pub(crate) const SCENE: &str = "scene.toml";
/// File in which Linux states the clock source.
const CLOCK_SOURCE: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";

/// Facts about a session, for its recordings.
#[derive(Debug, Clone)]
pub struct SessionInfo {
    /// The service's name on the bus.
    pub name: String,
    /// The scene, TOML.
    pub scene: String,
    /// Wall clock at the start of the session, the origin of `log_time`.
    pub started: SystemTime,
    /// The command line.
    pub command_line: String,
    /// Further facts, by name.
    pub facts: Vec<(&'static str, String)>,
}

impl SessionInfo {
    /// `log_time` of an instant of the session, ns.
    pub fn log_time_ns(&self, session_s: f64) -> u64 {
        log_time_ns(self.started, session_s)
    }

    /// Writes metadata and scene; `part` is the number of the file if the session fills several.
    pub(super) fn write<W: Write + Seek>(&self, mcap: &mut Writer<W>, part: Option<u32>) -> mcap::McapResult<()> {
        let facts = [
            ("name", self.name.clone()),
            ("started", wire::timestamp(self.started).to_string()),
            ("wall_clock", "system clock (UTC)".to_owned()),
            ("clock_source", clock_source()),
            ("command_line", self.command_line.clone()),
            ("scene_crc32", sum(&self.scene)),
        ];
        let part = part.map(|part| ("part", part.to_string()));
        let build = build_info::FACTS.map(|(key, value)| (key, value.to_owned()));
        let all = facts.into_iter().chain(self.facts.iter().cloned()).chain(build).chain(part);
        let metadata = all.map(|(key, value)| (key.to_owned(), value)).collect();
        mcap.write_metadata(&mcap::records::Metadata { name: METADATA.to_owned(), metadata })?;
        mcap.attach(&Attachment {
            log_time: nanoseconds(self.started),
            create_time: nanoseconds(self.started),
            name: SCENE.to_owned(),
            media_type: "application/toml".to_owned(),
            data: self.scene.as_bytes().into(),
        })
    }
}

/// `log_time` of an instant of a session that began at `started`, ns.
pub fn log_time_ns(started: SystemTime, session_s: f64) -> u64 {
    let elapsed = Duration::try_from_secs_f64(session_s.max(0.0)).unwrap_or(Duration::MAX);
    started.checked_add(elapsed).map_or(u64::MAX, nanoseconds)
}

/// Checksum of a scene, to detect changes.
pub(super) fn sum(scene: &str) -> String {
    format!("{:08x}", crc32fast::hash(scene.as_bytes()))
}

/// Nanoseconds since 1970.
pub fn nanoseconds(time: SystemTime) -> u64 {
    time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))
}

/// The clock source of the host, as far as known.
fn clock_source() -> String {
    fs::read_to_string(CLOCK_SOURCE).map_or_else(|_| "unknown".to_owned(), |source| source.trim().to_owned())
}
