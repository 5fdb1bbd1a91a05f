//! A recording opened for replay: its topics, and its messages from any time on, in order of log time.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::{ChunkIndex, Record, op};
use mcap::{McapError, McapResult};

use super::definitions::Channels;
use super::format::{CONTENT_LIMIT, RECORD_HEAD, RECORD_LIMIT, RecordedMessage, message, record_head};
use super::open::open;
use super::reader::{Messages, is_cut_off};
use super::records::Chunk;
use super::summary::summary;
use super::{Channel, RecordingError};

/// Memory limit of the messages that wait because chunks overlap in time, bytes.
const WAITING_LIMIT: usize = 4 * CONTENT_LIMIT as usize;
/// Memory of a waiting message beside its data, bytes.
const MESSAGE_BYTES: usize = 128;

/// A recording with its index.
#[derive(Debug, Clone)]
pub struct RecordingFile {
    path: PathBuf,
    channels: BTreeMap<u16, Arc<Channel>>,
    /// Chunks in order of their first log time; empty if the file has no index.
    chunks: Vec<ChunkIndex>,
    begin_ns: u64,
    end_ns: u64,
    cut_off: bool,
}

impl RecordingFile {
    /// Opens a recording and reads its index; a file without one, because it was cut off, is scanned instead.
    ///
    /// # Errors
    /// [`RecordingError`] if the file cannot be read, is not MCAP or holds no messages.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut file = open(path)?;
        summary(&mut file).and_then(|summary| Self::indexed(path, summary)).map_or_else(|| Self::scanned(path), Ok)
    }

    fn indexed(path: &Path, summary: Vec<Record<'static>>) -> Option<Self> {
        let (mut known, mut channels, mut chunks) = (Channels::default(), BTreeMap::new(), Vec::new());
        let mut stated_ns = None;
        for record in summary {
            match record {
                Record::Schema { header, data } => known.add_schema(header, &data).ok()?,
                Record::Channel(channel) => {
                    let id = channel.id;
                    known.add_channel(channel).ok()?;
                    channels.insert(id, known.get(id)?);
                }
                // A chunk without messages has no times.
                Record::ChunkIndex(chunk) if !chunk.message_index_offsets.is_empty() || chunk.message_end_time > 0 => {
                    chunks.push(chunk);
                }
                Record::Statistics(stated) => stated_ns = Some([stated.message_start_time, stated.message_end_time]),
                _ => {}
            }
        }
        chunks.sort_by_key(|chunk| (chunk.message_start_time, chunk.chunk_start_offset));
        let begin_ns = chunks.first()?.message_start_time;
        let end_ns = chunks.iter().map(|chunk| chunk.message_end_time).max()?;
        let path = path.to_owned();
        // An index that contradicts the statistics is no help.
        let fits = stated_ns.is_none_or(|stated_ns| stated_ns == [begin_ns, end_ns]);
        (fits && !channels.is_empty()).then_some(RecordingFile { path, channels, chunks, begin_ns, end_ns, cut_off: false })
    }

    fn scanned(path: &Path) -> Result<Self, RecordingError> {
        let (mut begin_ns, mut end_ns, mut cut_off) = (u64::MAX, 0, false);
        let mut channels = BTreeMap::new();
        for message in Messages::open(path)? {
            let message = match message {
                Err(error) if is_cut_off(&error) => {
                    cut_off = true;
                    break;
                }
                message => message?,
            };
            (begin_ns, end_ns) = (begin_ns.min(message.log_time), end_ns.max(message.log_time));
            channels.entry(message.channel.id).or_insert(message.channel);
        }
        if channels.is_empty() {
            return Err(RecordingError::empty(path));
        }
        Ok(RecordingFile { path: path.to_owned(), channels, chunks: Vec::new(), begin_ns, end_ns, cut_off })
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Topics with their encodings and schemas, by id.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.channels.values().map(Arc::as_ref)
    }

    /// Log time of the first message, ns.
    pub fn begin_ns(&self) -> u64 {
        self.begin_ns
    }

    /// Log time of the last message, ns.
    pub fn end_ns(&self) -> u64 {
        self.end_ns
    }

    /// Log time from the first message to the last, s.
    pub fn duration_s(&self) -> f64 {
        self.seconds(self.end_ns)
    }

    /// A log time as seconds since the first message.
    pub fn seconds(&self, log_time_ns: u64) -> f64 {
        log_time_ns.saturating_sub(self.begin_ns) as f64 * 1e-9
    }

    /// Whether the recording ends early.
    pub fn is_cut_off(&self) -> bool {
        self.cut_off
    }

    /// Messages from a log time on. With an index they come in order of log time, then of file position; the messages that wait
    /// because chunks overlap have at most 256 MiB. Without an index they come in file order. Ends at the first damage, with the
    /// error; a file that is cut off ends without one.
    ///
    /// # Errors
    /// [`RecordingError`] if the file cannot be opened.
    pub fn messages_from(
        &self,
        from_ns: u64,
    ) -> Result<Box<dyn Iterator<Item = Result<RecordedMessage, RecordingError>> + Send>, RecordingError> {
        if self.chunks.is_empty() {
            let messages = Messages::open(&self.path)?;
            let whole = messages.take_while(|message| !message.as_ref().is_err_and(is_cut_off));
            return Ok(Box::new(
                whole.filter(move |message| message.as_ref().map_or(true, |message| message.log_time >= from_ns)),
            ));
        }
        let file = open(&self.path)?;
        let chunks = self.chunks.iter().filter(|chunk| chunk.message_end_time >= from_ns).cloned().collect();
        let (path, channels) = (self.path.clone(), self.channels.clone());
        Ok(Box::new(InOrder { path, file, channels, chunks, waiting: BTreeMap::new(), waiting_bytes: 0, from_ns }))
    }
}

/// Messages of an indexed file in order. Chunks that begin before the next message are loaded, their messages sorted by log time
/// and position.
struct InOrder {
    path: PathBuf,
    file: File,
    channels: BTreeMap<u16, Arc<Channel>>,
    chunks: VecDeque<ChunkIndex>,
    waiting: BTreeMap<(u64, u64, u64), RecordedMessage>,
    /// Memory of the waiting messages, bytes.
    waiting_bytes: usize,
    from_ns: u64,
}

impl Iterator for InOrder {
    type Item = Result<RecordedMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let first = self.waiting.first_key_value().map(|((log_time, ..), _)| *log_time);
            match self.chunks.front() {
                Some(chunk) if first.is_none_or(|first| chunk.message_start_time <= first) => {
                    let chunk = self.chunks.pop_front()?;
                    let failed = match self.load(&chunk) {
                        Ok(true) if self.waiting_bytes <= WAITING_LIMIT => continue,
                        Ok(true) => RecordingError::Overlap { path: self.path.clone() },
                        Ok(false) => RecordingError::ChunkTimes { path: self.path.clone(), at: chunk.chunk_start_offset },
                        Err(cause) => RecordingError::Chunk { path: self.path.clone(), at: chunk.chunk_start_offset, cause },
                    };
                    self.chunks.clear();
                    self.waiting.clear();
                    return Some(Err(failed));
                }
                _ => {
                    let (_, message) = self.waiting.pop_first()?;
                    self.waiting_bytes -= memory_of(&message);
                    return Some(Ok(message));
                }
            }
        }
    }
}

fn memory_of(message: &RecordedMessage) -> usize {
    message.data.len() + MESSAGE_BYTES
}

impl InOrder {
    /// Loads the messages of a chunk. Returns whether the times of its index are theirs: otherwise messages are left out, or late.
    fn load(&mut self, chunk: &ChunkIndex) -> McapResult<bool> {
        let at = chunk.chunk_start_offset;
        let mut span_ns = [u64::MAX, 0];
        let read = Chunk::bounded(chunk_body(&mut self.file, at)?)?.find(|record| {
            let Record::Message { header, data } = record.parse()? else { return Ok(None) };
            span_ns = [span_ns[0].min(header.log_time), span_ns[1].max(header.log_time)];
            if header.log_time >= self.from_ns {
                let message = message(header, data, self.channels.get(&header.channel_id).cloned())?;
                self.waiting_bytes += memory_of(&message);
                if let Some(same) = self.waiting.insert((header.log_time, at, record.at), message) {
                    self.waiting_bytes -= memory_of(&same);
                }
            }
            Ok(None)
        });
        let is_empty = span_ns[0] > span_ns[1];
        let fits = is_empty || span_ns == [chunk.message_start_time, chunk.message_end_time];
        read.map(|_: Option<()>| fits)
    }
}

/// Reads the body of the chunk record that begins at a byte of a file.
fn chunk_body(file: &mut File, at: u64) -> McapResult<Vec<u8>> {
    let (mut head, mut body) = ([0; RECORD_HEAD], Vec::new());
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut head)?;
    match record_head(&head) {
        Some((op::CHUNK, length)) if length <= RECORD_LIMIT => file.take(length).read_to_end(&mut body)?,
        Some((op::CHUNK, length)) => return Err(McapError::ChunkTooLarge(length)),
        _ => return Err(McapError::BadIndex),
    };
    Ok(body)
}
