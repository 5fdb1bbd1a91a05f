//! Walks a recording record by record, in file order, continues after damaged chunks, and checks everything the format allows to
//! check. Memory is bounded by the largest chunk and the index.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use mcap::records::{ChunkHeader, ChunkIndex, MessageIndex, MessageIndexEntry, Record, Statistics, op};
use mcap::sans_io::LinearReaderOptions;
use mcap::{MAGIC, McapError};

use super::RecordingError;
use super::definitions::Channels;
use super::format::{RECORD_HEAD, RecordedMessage, is_closed};
use super::open::open;
use super::records::{Chunk, RawRecord, Records};
use super::summary::summary;

/// A record that cannot be read or contradicts others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Position of the record, bytes.
    pub offset: u64,
    /// The fault, in words.
    pub what: String,
    /// Log times (ns) between which its messages are lost; `None` if none are.
    pub lost_ns: Option<[u64; 2]>,
}

/// An item of a walk, in file order.
pub enum WalkItem<'a> {
    /// A message.
    Message(&'a RecordedMessage),
    /// A metadata record: its name and entries.
    Metadata(&'a str, &'a BTreeMap<String, String>),
    /// An attachment: its name and bytes.
    Attachment(&'a str, &'a [u8]),
    /// A damaged record.
    Damage(&'a Damage),
}

/// Counts of a walk through a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Structure {
    /// Size of the file, bytes.
    pub bytes: u64,
    /// Number of readable chunks.
    pub chunks: u64,
    /// Number of messages in them.
    pub messages: u64,
    /// The damage found.
    pub damage: Vec<Damage>,
    /// Position at which the file ends early, as after a killed program; `None` if it was closed properly.
    pub cut_off: Option<u64>,
}

/// Whether a walk continues.
pub type WalkFlow = std::ops::ControlFlow<()>;

/// Walks through a recording. `visit` is called with every item and the position in bytes, and may end the walk.
///
/// # Errors
/// [`RecordingError::File`] if the file cannot be opened or read. Damage is not an error: the [`Structure`] lists it.
pub fn walk(path: &Path, visit: impl FnMut(WalkItem<'_>, u64) -> WalkFlow) -> Result<Structure, RecordingError> {
    begin(path, false, visit)
}

/// As [`walk`], and then through the readable messages of the chunk in which the file ends. No checksum covers them, and the
/// [`Structure`] does not count them.
///
/// # Errors
/// As of [`walk`].
pub(super) fn walk_to_the_cut(
    path: &Path,
    visit: impl FnMut(WalkItem<'_>, u64) -> WalkFlow,
) -> Result<Structure, RecordingError> {
    begin(path, true, visit)
}

fn begin(
    path: &Path,
    with_cut_chunk: bool,
    visit: impl FnMut(WalkItem<'_>, u64) -> WalkFlow,
) -> Result<Structure, RecordingError> {
    let mut file = BufReader::new(open(path)?);
    let closed = is_closed(&mut file).map_err(RecordingError::file(path))?;
    let bytes = file.get_ref().metadata().map_err(RecordingError::file(path))?.len();
    let walker = Walker {
        path,
        visit,
        structure: Structure { bytes, ..Structure::default() },
        position: MAGIC.len() as u64,
        channels: Channels::default(),
        has_learned: false,
        counts: BTreeMap::new(),
        chunks: BTreeMap::new(),
        awaited: BTreeMap::new(),
        indexed: [0; 2],
    };
    walker.through(file, closed, with_cut_chunk).map_err(RecordingError::file(path))
}

struct Walker<'a, V> {
    path: &'a Path,
    visit: V,
    structure: Structure,
    position: u64,
    channels: Channels,
    /// Whether the definitions of the summary are among them.
    has_learned: bool,
    /// Number of messages by channel.
    counts: BTreeMap<u16, u64>,
    /// Length and header of every chunk, by position.
    chunks: BTreeMap<u64, (u64, ChunkHeader)>,
    /// Entries of the last chunk that its message indexes must list.
    awaited: BTreeMap<u16, Vec<MessageIndexEntry>>,
    /// Number of chunks in the index, and of those at wrong positions.
    indexed: [u64; 2],
}

impl<V: FnMut(WalkItem<'_>, u64) -> WalkFlow> Walker<'_, V> {
    fn through(mut self, file: BufReader<File>, closed: bool, with_cut_chunk: bool) -> std::io::Result<Structure> {
        let options = LinearReaderOptions::default()
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true);
        let mut records = Records::of(file, options);
        let walked = records.find(|record| Ok(self.record(&record).break_value()));
        self.position = records.position();
        match walked {
            Ok(_) => {}
            Err(McapError::Io(error)) => return Err(error),
            Err(McapError::UnexpectedEof) if !closed => {
                self.structure.cut_off = Some(self.position);
                if with_cut_chunk {
                    self.cut_chunk(&mut records)?;
                }
            }
            // A wrong checksum over the whole file adds nothing if the damaged place is known.
            Err(McapError::BadDataCrc { .. }) if !self.structure.damage.is_empty() => {}
            Err(error) => {
                let _ = self.damaged(error.to_string(), None);
            }
        }
        Ok(self.structure)
    }

    fn damaged(&mut self, what: String, lost_ns: Option<[u64; 2]>) -> WalkFlow {
        let damage = Damage { offset: self.position, what, lost_ns };
        let going = (self.visit)(WalkItem::Damage(&damage), self.position);
        self.structure.damage.push(damage);
        going
    }

    fn record(&mut self, record: &RawRecord<'_>) -> WalkFlow {
        self.position = record.at;
        if record.opcode != op::MESSAGE_INDEX && !self.awaited.is_empty() {
            self.awaited.clear();
            self.damaged("the message indexes of the previous chunk are incomplete".to_owned(), None)?;
        }
        match record.parse() {
            Ok(Record::Chunk { header, .. }) => self.chunk(header, record.data),
            Ok(Record::MessageIndex(index)) => self.message_index(index),
            Ok(Record::ChunkIndex(index)) => {
                let there = self.is_there(&index);
                self.indexed[0] += 1;
                self.indexed[1] += u64::from(!there);
                WalkFlow::Continue(())
            }
            Ok(Record::Statistics(statistics)) => self.statistics(&statistics),
            Ok(Record::Metadata(metadata)) => (self.visit)(WalkItem::Metadata(&metadata.name, &metadata.metadata), self.position),
            Ok(Record::Attachment { header, data, .. }) => (self.visit)(WalkItem::Attachment(&header.name, &data), self.position),
            Ok(Record::Footer(_)) => self.footer(),
            Ok(Record::Message { .. }) => self.damaged("a message outside of any chunk".to_owned(), None),
            Ok(_) => WalkFlow::Continue(()),
            Err(error) => self.damaged(in_words(&error), None),
        }
    }

    fn chunk(&mut self, header: ChunkHeader, body: &[u8]) -> WalkFlow {
        let times = [header.message_start_time, header.message_end_time];
        self.chunks.insert(self.position, ((RECORD_HEAD + body.len()) as u64, header));
        let (mut messages, mut index) = (Vec::new(), BTreeMap::<u16, Vec<MessageIndexEntry>>::new());
        let read = Chunk::bounded(body).and_then(|mut chunk| {
            chunk.find(|record| {
                if let Some(message) = record.message(&mut self.channels)? {
                    let entry = MessageIndexEntry { log_time: message.log_time, offset: record.at };
                    index.entry(message.channel.id).or_default().push(entry);
                    messages.push(message);
                }
                Ok(None::<()>)
            })
        });
        if let Err(error) = read {
            self.learn();
            return self.damaged(format!("a chunk cannot be read: {}", in_words(&error)), Some(times));
        }
        self.structure.chunks += 1;
        self.structure.messages += messages.len() as u64;
        for message in &messages {
            *self.counts.entry(message.channel.id).or_default() += 1;
            (self.visit)(WalkItem::Message(message), self.position)?;
        }
        self.awaited = index;
        WalkFlow::Continue(())
    }

    /// Learns from the summary, once, what a damaged chunk may have defined first. A summary that cannot be read teaches nothing.
    fn learn(&mut self) {
        if std::mem::replace(&mut self.has_learned, true) {
            return;
        }
        for record in open(self.path).ok().and_then(|mut file| summary(&mut file)).into_iter().flatten() {
            // A definition that contradicts one that was read changes nothing.
            let _ = match record {
                Record::Schema { header, data } => self.channels.add_schema(header, &data),
                Record::Channel(channel) => self.channels.add_channel(channel),
                _ => Ok(()),
            };
        }
    }

    /// Visits the readable messages of the chunk in which the file ends, if it does.
    fn cut_chunk(&mut self, records: &mut Records<BufReader<File>>) -> std::io::Result<()> {
        let mut chunk = match records.cut_chunk() {
            Ok(chunk) => chunk,
            Err(McapError::Io(error)) => return Err(error),
            Err(_) => return Ok(()),
        };
        // It ends with an error, that of the cut.
        let _ = chunk.find(|record| {
            let message = record.message(&mut self.channels)?;
            Ok(message.and_then(|message| (self.visit)(WalkItem::Message(&message), self.position).break_value()))
        });
        Ok(())
    }

    fn message_index(&mut self, index: MessageIndex) -> WalkFlow {
        let expected = self.awaited.remove(&index.channel_id);
        // After an unreadable chunk, no message index is expected.
        let after_damage = self.structure.damage.last().is_some_and(|damage| damage.lost_ns.is_some());
        if expected.as_ref() == Some(&index.records) || expected.is_none() && (after_damage || index.records.is_empty()) {
            return WalkFlow::Continue(());
        }
        self.damaged("a message index does not fit the previous chunk".to_owned(), None)
    }

    fn is_there(&self, index: &ChunkIndex) -> bool {
        self.chunks.get(&index.chunk_start_offset).is_some_and(|(length, header)| {
            *length == index.chunk_length
                && header.message_start_time == index.message_start_time
                && header.message_end_time == index.message_end_time
                && header.compression == index.compression
                && header.compressed_size == index.compressed_size
                && header.uncompressed_size == index.uncompressed_size
        })
    }

    fn statistics(&mut self, stated: &Statistics) -> WalkFlow {
        let stated_counts: BTreeMap<u16, u64> =
            stated.channel_message_counts.iter().filter(|(_, count)| **count > 0).map(|(id, count)| (*id, *count)).collect();
        if stated.message_count == self.structure.messages && stated_counts == self.counts {
            return WalkFlow::Continue(());
        }
        let (stated, found) = (stated.message_count, self.structure.messages);
        self.damaged(format!("the statistics state {stated} messages, but {found} are readable"), None)
    }

    fn footer(&mut self) -> WalkFlow {
        let (chunks, [indexed, misplaced]) = (self.chunks.len() as u64, self.indexed);
        if indexed == chunks && misplaced == 0 {
            return WalkFlow::Continue(());
        }
        self.damaged(format!("the index lists {indexed} of {chunks} chunks, {misplaced} of them at wrong positions"), None)
    }
}

/// The system's or our own error explains more than the library's.
fn in_words(error: &McapError) -> String {
    match error {
        McapError::Io(cause) => cause.to_string(),
        error => error.to_string(),
    }
}
