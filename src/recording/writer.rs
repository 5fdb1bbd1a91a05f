//! Writes one file of a session: channels with full schemas, the scene as an attachment, chunks closed at a given period.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Compression, WriteOptions, Writer};

use super::end::{EndReason, RecordingEnd};
use super::message::Message;
use super::session_info::SessionInfo;
use super::settings::{Settings, Split};
use super::size_bound::SizeBound;
use super::{RecordingError, build_info};
use crate::whole_file::not_made;
use crate::wire;

/// Size at which a chunk is closed before it is due, bytes.
pub(super) const CHUNK_BYTES: u64 = 256 * 1024;

/// A finished recording or table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Path of the file.
    pub path: PathBuf,
    /// Number of messages or rows.
    pub messages: u64,
    /// Whether it ended early at the size limit.
    pub limited: bool,
}

/// Options of MCAP files: small chunks, so that a crash loses little, written without seeking back.
pub(super) fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
        .library(format!("flexcrank {}", build_info::VERSION))
}

/// Creates a new file, and its folder; overwrites nothing.
fn create_new(path: &Path) -> Result<File, RecordingError> {
    let folder = folder(path);
    std::fs::create_dir_all(folder).map_err(|refused| RecordingError::file(folder)(not_made(refused, folder)))?;
    File::create_new(path).map_err(|refused| RecordingError::new_file(path)(not_made(refused, path)))
}

/// An open recording, written by the calling thread. [`Recorder`](super::Recorder) writes on a thread of its own.
pub struct SessionWriter {
    path: PathBuf,
    mcap: Writer<NoSeek<BufWriter<File>>>,
    /// The same file, for flushing and syncing.
    file: File,
    settings: Settings,
    channels: BTreeMap<String, Channel>,
    /// Arrival of the oldest message that is not flushed.
    waiting_since: Option<Instant>,
    span_ns: Option<(u64, u64)>,
    messages: u64,
    size: SizeBound,
    /// Size of the file before its first message, bytes.
    begin_bytes: u64,
}

#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    schema: &'static str,
    sequence: u32,
}

impl SessionWriter {
    /// Creates a new file; overwrites nothing. `part` is its number if the session fills several.
    ///
    /// # Errors
    /// [`RecordingError`] if the file exists already or cannot be written.
    pub fn create(path: &Path, session: &SessionInfo, part: Option<u32>, settings: Settings) -> Result<Self, RecordingError> {
        let file = create_new(path)?;
        let begun = Self::begin(path, file, session, part, settings);
        if begun.is_err() {
            // A file without a beginning is useless, and would be in the way of the next attempt.
            let _ = std::fs::remove_file(path);
        }
        begun
    }

    fn begin(
        path: &Path,
        file: File,
        session: &SessionInfo,
        part: Option<u32>,
        settings: Settings,
    ) -> Result<Self, RecordingError> {
        let output = file.try_clone().map_err(RecordingError::file(path))?;
        let mut mcap = options().create(NoSeek::new(BufWriter::new(output))).map_err(RecordingError::mcap(path))?;
        session.write(&mut mcap, part).map_err(RecordingError::mcap(path))?;
        let mut writer = SessionWriter {
            path: path.to_owned(),
            mcap,
            file,
            settings,
            channels: BTreeMap::new(),
            waiting_since: None,
            span_ns: None,
            messages: 0,
            size: SizeBound::new(0),
            begin_bytes: 0,
        };
        writer.flush()?;
        writer.begin_bytes = writer.size.there();
        if settings.fsync {
            // The name of the file is on the disk, too.
            File::open(folder(path)).and_then(|folder| folder.sync_all()).map_err(RecordingError::file(path))?;
        }
        Ok(writer)
    }

    /// Writes a message, and flushes when due.
    ///
    /// # Errors
    /// [`RecordingError`] if the file cannot be written.
    pub fn write(&mut self, message: &Message) -> Result<(), RecordingError> {
        self.size = self.size.with(message, self.definition(message));
        self.append(message).map_err(RecordingError::mcap(&self.path))?;
        self.messages += 1;
        let (first, last) = self.span_ns.unwrap_or((message.log_time_ns, message.log_time_ns));
        self.span_ns = Some((first.min(message.log_time_ns), last.max(message.log_time_ns)));
        let since = *self.waiting_since.get_or_insert_with(Instant::now);
        if self.size.open() >= CHUNK_BYTES || since.elapsed() >= self.longest_wait() { self.flush() } else { Ok(()) }
    }

    /// Length of the schema that the first message of a topic brings along: none if another topic has it.
    fn definition(&self, message: &Message) -> Option<usize> {
        let is_known = || self.channels.values().any(|channel| channel.schema == message.schema);
        let schema = || if is_known() { 0 } else { wire::descriptor_set(message.schema).len() };
        (!self.channels.contains_key(&message.topic)).then(schema)
    }

    fn append(&mut self, message: &Message) -> mcap::McapResult<()> {
        let Channel { id, sequence, .. } = match self.channels.get_mut(&message.topic) {
            Some(channel) => {
                channel.sequence = channel.sequence.wrapping_add(1);
                *channel
            }
            None => self.open_channel(message)?,
        };
        let header =
            MessageHeader { channel_id: id, sequence, log_time: message.log_time_ns, publish_time: message.publish_time_ns };
        self.mcap.write_to_known_channel(&header, &message.payload)
    }

    fn open_channel(&mut self, message: &Message) -> mcap::McapResult<Channel> {
        let schema = self.mcap.add_schema(message.schema, "protobuf", wire::descriptor_set(message.schema))?;
        let id = self.mcap.add_channel(schema, &message.topic, "protobuf", &BTreeMap::new())?;
        let channel = Channel { id, schema: message.schema, sequence: 0 };
        self.channels.insert(message.topic.clone(), channel);
        Ok(channel)
    }

    /// Longest wait of a message for its flush: less than the period, to leave time for flushing itself.
    fn longest_wait(&self) -> Duration {
        self.settings.flush_period * 3 / 4
    }

    /// Time until a flush is due; `None` if no message waits for one.
    pub(super) fn due_in(&self) -> Option<Duration> {
        self.waiting_since.map(|since| self.longest_wait().saturating_sub(since.elapsed()))
    }

    /// Closes the open chunk and passes it to the system; with `fsync`, waits for the disk.
    pub(super) fn flush(&mut self) -> Result<(), RecordingError> {
        self.waiting_since = None;
        self.mcap.flush().map_err(RecordingError::mcap(&self.path))?;
        self.size.close_chunk(self.file.metadata().map_err(RecordingError::file(&self.path))?.len());
        if self.settings.fsync {
            self.file.sync_data().map_err(RecordingError::file(&self.path))?;
        }
        Ok(())
    }

    /// Whether the file has reached its part size or time.
    pub(super) fn is_full(&self) -> bool {
        match self.settings.split {
            None => false,
            Some(Split::Bytes(limit)) => self.size.there() >= limit,
            Some(Split::Time(limit)) => self.span_ns.is_some_and(|(first, last)| Duration::from_nanos(last - first) >= limit),
        }
    }

    /// Upper bound for the size of the file if it is closed after another message.
    pub(super) fn size_with(&self, message: &Message) -> u64 {
        self.size.with(message, self.definition(message)).closed()
    }

    /// Upper bound for the size of a further part that holds this message only.
    pub(super) fn size_of_part(&self, message: &Message) -> u64 {
        SizeBound::new(self.begin_bytes).with(message, Some(wire::descriptor_set(message.schema).len())).closed()
    }

    /// Closes the file, with its end, statistics and index, and returns a summary.
    ///
    /// # Errors
    /// [`RecordingError`] if the file cannot be written.
    pub fn finish(mut self, reason: EndReason) -> Result<Written, RecordingError> {
        let counts = self.channels.iter().map(|(topic, channel)| (topic.clone(), u64::from(channel.sequence) + 1)).collect();
        let end = RecordingEnd { reason: reason.to_string(), counts };
        self.mcap.write_metadata(&end.into()).map_err(RecordingError::mcap(&self.path))?;
        self.mcap.finish().map_err(RecordingError::mcap(&self.path))?;
        let flushed = self.mcap.into_inner().into_inner().flush();
        flushed
            .and_then(|()| if self.settings.fsync { self.file.sync_all() } else { Ok(()) })
            .map_err(RecordingError::file(&self.path))?;
        Ok(Written { path: self.path, messages: self.messages, limited: false })
    }
}

/// The folder of a file.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
