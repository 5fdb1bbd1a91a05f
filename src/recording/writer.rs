//! One file of a session: channels with full schemas, scene attached, chunks closed at a stated period.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Compression, WriteOptions, Writer};

use super::message::Message;
use super::session_info::SessionInfo;
use super::settings::{Settings, Split};
use super::{RecordingError, build_info};
use crate::wire;

/// Chunks are closed when they reach this size, or are due.
const CHUNK_BYTES: u64 = 256 * 1024;
/// Schemas, channels and statistics at the end of a file are no larger than this.
const SUMMARY_BYTES: u64 = 128 * 1024;
/// Nor is what the index says of a chunk.
const CHUNK_INDEX_BYTES: u64 = 256;

/// What a finished recording holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Where.
    pub path: PathBuf,
    /// How many messages.
    pub messages: u64,
    /// Whether it ends early, because it would have become larger than allowed.
    pub limited: bool,
}

/// How MCAP files are written here: chunks small enough to be lost, and an order that needs no going back.
pub(super) fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
        .library(format!("flexcrank {}", build_info::VERSION))
}

/// Makes a new file, and its folder; never overwrites one.
pub(super) fn create_new(path: &Path) -> Result<File, RecordingError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(RecordingError::file(folder))?;
    }
    File::create_new(path).map_err(|cause| match cause.kind() {
        std::io::ErrorKind::AlreadyExists => RecordingError::Exists(path.to_owned()),
        _ => RecordingError::file(path)(cause),
    })
}

/// An open recording, written to by whoever holds it. [`Recorder`](super::Recorder) does so on a thread of its own.
pub struct SessionWriter {
    path: PathBuf,
    mcap: Writer<NoSeek<BufWriter<File>>>,
    /// The same file, for what the writer above does not do.
    file: File,
    settings: Settings,
    channels: BTreeMap<String, Channel>,
    /// When the oldest message came that the system has not got yet.
    waiting_since: Option<Instant>,
    span_ns: Option<(u64, u64)>,
    messages: u64,
    /// At most so many chunks were closed.
    chunks: u64,
    /// Of all messages, before compression.
    payload_bytes: u64,
}

#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    sequence: u32,
}

impl SessionWriter {
    /// Makes a new file; never overwrites one. `part` is its number where the session fills several.
    ///
    /// # Errors
    /// [`RecordingError`] when the file exists already or cannot be written.
    pub fn create(path: &Path, session: &SessionInfo, part: Option<u32>, settings: Settings) -> Result<Self, RecordingError> {
        let file = create_new(path)?;
        let output = file.try_clone().map_err(RecordingError::file(path))?;
        let mut mcap = options().create(NoSeek::new(BufWriter::new(output))).map_err(RecordingError::unwritten(path))?;
        session.write(&mut mcap, part).map_err(RecordingError::unwritten(path))?;
        let mut writer = SessionWriter {
            path: path.to_owned(),
            mcap,
            file,
            settings,
            channels: BTreeMap::new(),
            waiting_since: None,
            span_ns: None,
            messages: 0,
            chunks: 0,
            payload_bytes: 0,
        };
        writer.flush()?;
        if settings.fsync {
            sync_folder(path).map_err(RecordingError::file(path))?;
        }
        Ok(writer)
    }

    /// Writes a message; hands what was written so far to the system when it is time.
    ///
    /// # Errors
    /// [`RecordingError`] when it cannot be written.
    pub fn write(&mut self, message: &Message) -> Result<(), RecordingError> {
        self.append(message).map_err(RecordingError::unwritten(&self.path))?;
        self.messages += 1;
        self.payload_bytes += message.payload.len() as u64;
        let (first, last) = self.span_ns.unwrap_or((message.log_time_ns, message.log_time_ns));
        self.span_ns = Some((first.min(message.log_time_ns), last.max(message.log_time_ns)));
        let since = *self.waiting_since.get_or_insert_with(Instant::now);
        if since.elapsed() >= self.longest_wait() { self.flush() } else { Ok(()) }
    }

    fn append(&mut self, message: &Message) -> mcap::McapResult<()> {
        let Channel { id, sequence } = match self.channels.get_mut(&message.topic) {
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
        let channel = Channel { id, sequence: 0 };
        self.channels.insert(message.topic.clone(), channel);
        Ok(channel)
    }

    /// How long a message may wait to be flushed: less than the period, so that what flushing takes fits in as well.
    fn longest_wait(&self) -> Duration {
        self.settings.flush_period * 3 / 4
    }

    /// How long until a flush is due; `None` when nothing waits for one.
    pub(super) fn due_in(&self) -> Option<Duration> {
        self.waiting_since.map(|since| self.longest_wait().saturating_sub(since.elapsed()))
    }

    /// Closes the open chunk and hands it to the system, and to the disk if that was asked for.
    pub(super) fn flush(&mut self) -> Result<(), RecordingError> {
        self.waiting_since = None;
        self.chunks += 1;
        self.mcap.flush().map_err(RecordingError::unwritten(&self.path))?;
        if self.settings.fsync {
            self.file.sync_data().map_err(RecordingError::file(&self.path))?;
        }
        Ok(())
    }

    /// Whether it is time to go on in a new file.
    pub(super) fn is_full(&self) -> bool {
        match self.settings.split {
            None => false,
            Some(Split::Bytes(limit)) => self.file.metadata().is_ok_and(|file| file.len() >= limit),
            Some(Split::Time(limit)) => self.span_ns.is_some_and(|(first, last)| Duration::from_nanos(last - first) >= limit),
        }
    }

    /// Bytes of the file when it is closed, at most: what is there, an open chunk, and the index of all chunks.
    pub(super) fn size_when_closed(&self) -> u64 {
        let there = self.file.metadata().map_or(0, |file| file.len());
        let chunks = self.chunks + self.payload_bytes / CHUNK_BYTES + 1;
        there + CHUNK_BYTES + SUMMARY_BYTES + CHUNK_INDEX_BYTES * chunks
    }

    /// Closes the file, with statistics and index, and says what it holds.
    ///
    /// # Errors
    /// [`RecordingError`] when it cannot be written.
    pub fn finish(mut self) -> Result<Written, RecordingError> {
        self.mcap.finish().map_err(RecordingError::unwritten(&self.path))?;
        let flushed = self.mcap.into_inner().into_inner().flush();
        flushed
            .and_then(|()| if self.settings.fsync { self.file.sync_all() } else { Ok(()) })
            .map_err(RecordingError::file(&self.path))?;
        Ok(Written { path: self.path, messages: self.messages, limited: false })
    }
}

/// Waits until the disk knows the file's name.
fn sync_folder(path: &Path) -> std::io::Result<()> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => File::open(folder)?.sync_all(),
        None => File::open(".")?.sync_all(),
    }
}
