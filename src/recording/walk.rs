//! Walks a recording record by record, in file order, continues after damaged chunks, and checks everything the format allows to
//! check. Memory is bounded by the largest chunk, the topics and the damage.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use mcap::records::{ChunkHeader, MessageIndex, MessageIndexEntry, Record, op};
use mcap::sans_io::LinearReaderOptions;
use mcap::{MAGIC, McapError};

use super::RecordingError;
use super::definitions::Channels;
use super::file_index::FileIndex;
use super::format::{RecordedMessage, is_closed};
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
    /// Topics that are defined and have no message.
    pub silent_topics: Vec<String>,
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
        index: FileIndex::default(),
        awaited: BTreeMap::new(),
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
    /// The index and the statistics that the file should have.
    index: FileIndex,
    /// Entries of the last chunk that its message indexes must list.
    awaited: BTreeMap<u16, Vec<MessageIndexEntry>>,
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
        self.structure.silent_topics = self.index.silent_topics();
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
        let parsed = match record.parse() {
            Ok(parsed) => parsed,
            Err(error) => return self.damaged(in_words(&error), None),
        };
        self.index.definition(&parsed);
        match parsed {
            Record::Chunk { header, .. } => self.chunk(header, record),
            Record::MessageIndex(index) => self.message_index(record, index),
            Record::Metadata(metadata) => {
                self.index.metadata(record, &metadata.name);
                (self.visit)(WalkItem::Metadata(&metadata.name, &metadata.metadata), self.position)
            }
            Record::Attachment { header, data, .. } => {
                self.index.attachment(record, &header, data.len());
                (self.visit)(WalkItem::Attachment(&header.name, &data), self.position)
            }
            Record::Message { .. } => self.damaged("a message outside of any chunk".to_owned(), None),
            Record::Footer(footer) => self.fault(self.index.fault(&footer)),
            summary => {
                self.index.summary(record, &summary);
                let fault = match summary {
                    Record::Statistics(stated) => self.index.fault_of_statistics(&stated, self.structure.damage.is_empty()),
                    Record::Schema { header, data } => {
                        self.channels.add_schema(header, &data).err().map(|error| in_words(&error))
                    }
                    Record::Channel(channel) => self.channels.add_channel(channel).err().map(|error| in_words(&error)),
                    _ => None,
                };
                self.fault(fault)
            }
        }
    }

    fn fault(&mut self, what: Option<String>) -> WalkFlow {
        what.map_or(WalkFlow::Continue(()), |what| self.damaged(what, None))
    }

    fn chunk(&mut self, header: ChunkHeader, record: &RawRecord<'_>) -> WalkFlow {
        let times = [header.message_start_time, header.message_end_time];
        self.index.chunk(record, header);
        let (mut messages, mut index) = (Vec::new(), BTreeMap::<u16, Vec<MessageIndexEntry>>::new());
        let read = Chunk::bounded(record.data).and_then(|mut chunk| {
            chunk.find(|record| {
                if matches!(record.opcode, op::SCHEMA | op::CHANNEL) {
                    self.index.definition(&record.parse()?);
                }
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
        let fault = self.index.messages(&messages);
        self.fault(fault)?;
        for message in &messages {
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
            self.index.definition(&record);
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

    fn message_index(&mut self, record: &RawRecord<'_>, index: MessageIndex) -> WalkFlow {
        if let Some(what) = self.index.message_index(record, &index) {
            return self.damaged(what, None);
        }
        let expected = self.awaited.remove(&index.channel_id);
        // After an unreadable chunk, no message index is expected.
        let after_damage = self.structure.damage.last().is_some_and(|damage| damage.lost_ns.is_some());
        if expected.as_ref() == Some(&index.records) || expected.is_none() && (after_damage || index.records.is_empty()) {
            return WalkFlow::Continue(());
        }
        self.damaged("a message index does not fit the previous chunk".to_owned(), None)
    }
}

/// The system's or our own error explains more than the library's.
fn in_words(error: &McapError) -> String {
    match error {
        McapError::Io(cause) => cause.to_string(),
        error => error.to_string(),
    }
}
