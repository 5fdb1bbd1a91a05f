//! A recording opened for replay: its topics, and its messages from any time on, in order of log time.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::read::ChannelAccumulator;
use mcap::records::{ChunkIndex, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError, McapResult};

use super::chunk::Records;
use super::format::{RECORD_HEAD, RECORD_LIMIT, RecordedMessage};
use super::parse::parse;
use super::reader::{Messages, is_cut_off};
use super::{Channel, RecordingError};

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
        let mut file = File::open(path).map_err(RecordingError::file(path))?;
        match Index::read(&mut file).ok().flatten().and_then(|index| Self::indexed(path, index)) {
            Some(source) => Ok(source),
            None => Self::scanned(path),
        }
    }

    fn indexed(path: &Path, index: Index) -> Option<Self> {
        let Index { channels, mut chunks } = index;
        // A chunk without messages has no times.
        chunks.retain(|chunk| !chunk.message_index_offsets.is_empty() || chunk.message_end_time > 0);
        chunks.sort_by_key(|chunk| (chunk.message_start_time, chunk.chunk_start_offset));
        let begin_ns = chunks.first()?.message_start_time;
        let end_ns = chunks.iter().map(|chunk| chunk.message_end_time).max()?;
        let path = path.to_owned();
        (!channels.is_empty()).then_some(RecordingFile { path, channels, chunks, begin_ns, end_ns, cut_off: false })
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
            return Err(RecordingError::Empty { path: path.to_owned() });
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

    /// Messages from a log time on. With an index they come in order of log time, then of file position, and memory is bounded by
    /// the chunks that overlap. Without an index they come in file order. Ends at the first damage, with the error; a file that
    /// is cut off ends without one.
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
        let file = File::open(&self.path).map_err(RecordingError::file(&self.path))?;
        let chunks = self.chunks.iter().filter(|chunk| chunk.message_end_time >= from_ns).cloned().collect();
        let channels = self.channels.iter().map(|(id, channel)| (*id, Arc::clone(channel))).collect();
        Ok(Box::new(InOrder { path: self.path.clone(), file, channels, chunks, waiting: BTreeMap::new(), from_ns }))
    }
}

/// Channels and chunks listed in the summary at the end of a file.
struct Index {
    channels: BTreeMap<u16, Arc<Channel>>,
    chunks: Vec<ChunkIndex>,
}

/// Size of the footer record and the magic after it, bytes; position of the summary's start within.
const FOOTER: i64 = RECORD_HEAD as i64 + 20 + 8;
const SUMMARY_START: usize = RECORD_HEAD as usize;

impl Index {
    /// Reads the index; `None` if the file has no summary.
    fn read(file: &mut File) -> McapResult<Option<Self>> {
        let mut footer = [0; FOOTER as usize];
        file.seek(SeekFrom::End(-FOOTER))?;
        file.read_exact(&mut footer)?;
        let start = footer[SUMMARY_START..].first_chunk().map_or(0, |start| u64::from_le_bytes(*start));
        if footer[0] != op::FOOTER || !footer.ends_with(MAGIC) || start == 0 {
            return Ok(None);
        }
        file.seek(SeekFrom::Start(start))?;
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_emit_chunks(true)
            .with_record_length_limit(RECORD_LIMIT);
        let mut reader = LinearReader::new_with_options(options);
        let (mut known, mut ids, mut chunks) = (ChannelAccumulator::default(), Vec::new(), Vec::new());
        while let Some(event) = reader.next_event() {
            match event? {
                LinearReadEvent::ReadRequest(count) => {
                    let read = file.read(reader.insert(count))?;
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { opcode: op::FOOTER, .. } => break,
                LinearReadEvent::Record { opcode: opcode @ (op::SCHEMA | op::CHANNEL | op::CHUNK_INDEX), data } => {
                    match parse(opcode, data)? {
                        Record::Schema { header, data } => known.add_schema_from_slice(header, &data)?,
                        Record::Channel(channel) => {
                            ids.push(channel.id);
                            known.add_channel(channel)?;
                        }
                        Record::ChunkIndex(index) => chunks.push(index),
                        _ => {}
                    }
                }
                LinearReadEvent::Record { .. } => {}
            }
        }
        let channels = ids.into_iter().filter_map(|id| Some((id, known.get(id)?))).collect();
        Ok(Some(Index { channels, chunks }))
    }
}

/// Messages of an indexed file in order. Chunks that begin before the next message are loaded, their messages sorted by log time
/// and position.
struct InOrder {
    path: PathBuf,
    file: File,
    channels: HashMap<u16, Arc<Channel>>,
    chunks: VecDeque<ChunkIndex>,
    waiting: BTreeMap<(u64, u64, usize), RecordedMessage>,
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
                    if let Err(cause) = self.load(&chunk) {
                        self.chunks.clear();
                        self.waiting.clear();
                        return Some(Err(RecordingError::Chunk { path: self.path.clone(), at: chunk.chunk_start_offset, cause }));
                    }
                }
                _ => return self.waiting.pop_first().map(|(_, message)| Ok(message)),
            }
        }
    }
}

impl InOrder {
    fn load(&mut self, chunk: &ChunkIndex) -> McapResult<()> {
        let record = chunk_record(&mut self.file, chunk.chunk_start_offset)?;
        let mut place = 0;
        Records::of(record)?.find(|opcode, data| {
            let Record::Message { header, data } = parse(opcode, data)? else { return Ok(None::<()>) };
            place += 1;
            if header.log_time >= self.from_ns {
                let unknown = McapError::UnknownChannel(header.sequence, header.channel_id);
                let message = mcap::Message {
                    channel: Arc::clone(self.channels.get(&header.channel_id).ok_or(unknown)?),
                    sequence: header.sequence,
                    log_time: header.log_time,
                    publish_time: header.publish_time,
                    data: data.into_owned().into(),
                };
                self.waiting.insert((header.log_time, chunk.chunk_start_offset, place), message);
            }
            Ok(None)
        })?;
        Ok(())
    }
}

/// Reads the chunk record that begins at a byte of a file.
fn chunk_record(file: &mut File, at: u64) -> McapResult<Vec<u8>> {
    let mut head = [0; RECORD_HEAD as usize];
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut head)?;
    let [opcode, length @ ..] = head;
    let length = u64::from_le_bytes(length);
    match opcode {
        op::CHUNK if length <= RECORD_LIMIT as u64 => {}
        op::CHUNK => return Err(McapError::ChunkTooLarge(length)),
        _ => return Err(McapError::BadIndex),
    }
    let mut record = Vec::new();
    file.take(length).read_to_end(&mut record)?;
    Ok(record)
}
