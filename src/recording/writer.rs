//! One session as an MCAP file: channels with full schemas, scene attached, chunks closed at a stated period.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, WriteOptions, Writer};

use super::RecordingError;
use super::message::Message;
use crate::wire;

/// Chunks are closed when they reach this size, or the flush period is over.
const CHUNK_BYTES: u64 = 256 * 1024;

/// What a recording says about its session.
#[derive(Debug, Clone)]
pub struct Session {
    /// The service's name on the bus.
    pub name: String,
    /// The scene in force, TOML.
    pub scene: String,
    /// Wall clock at the session's start: what `log_time` counts from.
    pub started: SystemTime,
    /// The command line.
    pub command_line: String,
}

impl Session {
    /// `log_time` of an instant of the session, ns.
    pub fn log_time_ns(&self, session_s: f64) -> u64 {
        nanoseconds(self.started + Duration::from_secs_f64(session_s.max(0.0)))
    }
}

/// Nanoseconds since 1970.
pub fn nanoseconds(time: SystemTime) -> u64 {
    time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))
}

/// What a finished recording holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Where.
    pub path: PathBuf,
    /// How many messages.
    pub messages: u64,
}

/// An open recording.
pub(super) struct SessionWriter {
    path: PathBuf,
    mcap: Writer<NoSeek<BufWriter<File>>>,
    channels: BTreeMap<String, (u16, u32)>,
    flush_period: Duration,
    flushed: Instant,
    messages: u64,
}

impl SessionWriter {
    /// Makes a new file; never overwrites one.
    pub(super) fn create(path: &Path, session: &Session, flush_period: Duration) -> Result<Self, RecordingError> {
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(RecordingError::file(folder))?;
        }
        let file = File::create_new(path).map_err(RecordingError::file(path))?;
        let mut mcap = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            .library(concat!("flexcrank ", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(BufWriter::new(file)))
            .map_err(RecordingError::mcap(path))?;
        describe(&mut mcap, session).map_err(RecordingError::mcap(path))?;
        mcap.flush().map_err(RecordingError::mcap(path))?;
        let path = path.to_owned();
        Ok(SessionWriter { path, mcap, channels: BTreeMap::new(), flush_period, flushed: Instant::now(), messages: 0 })
    }

    pub(super) fn write(&mut self, message: &Message) -> Result<(), RecordingError> {
        self.append(message).map_err(RecordingError::mcap(&self.path))?;
        self.messages += 1;
        self.flush_if_due()
    }

    fn append(&mut self, message: &Message) -> mcap::McapResult<()> {
        if !self.channels.contains_key(&message.topic) {
            let schema = self.mcap.add_schema(message.schema, "protobuf", wire::DESCRIPTOR_SET)?;
            let channel = self.mcap.add_channel(schema, &message.topic, "protobuf", &BTreeMap::new())?;
            self.channels.insert(message.topic.clone(), (channel, 0));
        }
        let Some((channel_id, sequence)) = self.channels.get_mut(&message.topic) else { return Ok(()) };
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: message.log_time_ns,
            publish_time: message.publish_time_ns,
        };
        *sequence = sequence.wrapping_add(1);
        self.mcap.write_to_known_channel(&header, &message.payload)
    }

    /// Closes the open chunk and hands it to the system, when it is time.
    pub(super) fn flush_if_due(&mut self) -> Result<(), RecordingError> {
        if self.flushed.elapsed() < self.flush_period {
            return Ok(());
        }
        self.flushed = Instant::now();
        self.mcap.flush().map_err(RecordingError::mcap(&self.path))
    }

    pub(super) fn finish(mut self) -> Result<Written, RecordingError> {
        self.mcap.finish().map_err(RecordingError::mcap(&self.path))?;
        Ok(Written { path: self.path, messages: self.messages })
    }
}

fn describe(mcap: &mut Writer<NoSeek<BufWriter<File>>>, session: &Session) -> mcap::McapResult<()> {
    let started = wire::timestamp(session.started).to_string();
    let facts = [
        ("name", session.name.as_str()),
        ("version", env!("CARGO_PKG_VERSION")),
        ("started", &started),
        ("wall_clock", "system clock (UTC)"),
        ("command_line", &session.command_line),
    ];
    let metadata = facts.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    mcap.write_metadata(&mcap::records::Metadata { name: "flexcrank".to_owned(), metadata })?;
    mcap.attach(&Attachment {
        log_time: nanoseconds(session.started),
        create_time: nanoseconds(session.started),
        name: "scene.toml".to_owned(),
        media_type: "application/toml".to_owned(),
        data: session.scene.as_bytes().into(),
    })
}
