//! Recovered messages are written to the new file, and missing ones are counted.

use std::collections::{BTreeMap, HashMap};
use std::io::{BufWriter, IntoInnerError};
use std::path::Path;

use mcap::records::{self, Record, op};
use mcap::write::NoSeek;
use mcap::{Attachment, McapResult, Writer};

use super::holes::Holes;
use crate::recording::definitions::DefinitionsSize;
use crate::recording::end::END;
use crate::recording::format::{CONTENT_LIMIT, RECORD_HEAD};
use crate::recording::parse::parse;
use crate::recording::records::Chunk;
use crate::recording::writer::{CHUNK_BYTES, options};
use crate::recording::{RecordingError, build_info, session_info};
use crate::whole_file::WholeFile;

/// Length of a message record beside its data, bytes.
const MESSAGE_BYTES: u64 = RECORD_HEAD as u64 + 22;

/// Name of the metadata record that states what a file was recovered from.
const METADATA: &str = "flexcrank-recovered";

/// Message counts of one topic.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Tally {
    pub saved: u64,
    /// Number of messages by the statistics of the file.
    pub stated: Option<u64>,
    /// One more than the largest sequence number.
    pub counted: u64,
    /// Messages that no chunk can hold so that it is read again.
    pub too_long: u64,
    /// Log time of the last message, ns.
    last_ns: u64,
}

/// The new file, and what is known of the damaged one.
pub(super) struct Salvage {
    mcap: Writer<NoSeek<BufWriter<WholeFile>>>,
    /// Messages in the open chunk, bytes.
    open_bytes: u64,
    schemas: HashMap<u16, (records::SchemaHeader, Vec<u8>)>,
    channels: HashMap<u16, records::Channel>,
    definitions: DefinitionsSize,
    /// Channel ids in the new file, by those in the damaged one.
    channel_ids: HashMap<u16, u16>,
    pub tallies: BTreeMap<String, Tally>,
    pub statistics: Option<records::Statistics>,
    /// Whether flexcrank recorded it: then messages are numbered from 0 in every topic.
    pub ours: bool,
    /// Messages from a chunk without a checked checksum.
    pub unchecked: u64,
    /// Messages of unknown channels.
    pub orphans: u64,
    /// Log times of the first and the last message.
    pub span_ns: Option<(u64, u64)>,
    /// Recorded time without any messages.
    pub holes: Holes,
    /// Whether flexcrank's metadata and the scene were found.
    pub has_metadata: bool,
    pub has_scene: bool,
    /// Whether a record said how the recording ended, and no chunk came after it.
    pub has_end: bool,
}

impl Salvage {
    /// Creates the new file; overwrites nothing.
    pub(super) fn create(path: &Path) -> Result<Self, RecordingError> {
        let file = BufWriter::new(WholeFile::create(path).map_err(RecordingError::file(path))?);
        Ok(Salvage {
            mcap: options().create(NoSeek::new(file)).map_err(RecordingError::mcap(path))?,
            open_bytes: 0,
            schemas: HashMap::new(),
            channels: HashMap::new(),
            definitions: DefinitionsSize::default(),
            channel_ids: HashMap::new(),
            tallies: BTreeMap::new(),
            statistics: None,
            ours: false,
            unchecked: 0,
            orphans: 0,
            span_ns: None,
            holes: Holes::default(),
            has_metadata: false,
            has_scene: false,
            has_end: false,
        })
    }

    /// Takes a topic or counts from the summary.
    pub(super) fn learn(&mut self, record: Record<'_>) {
        // Definitions beyond the limit are left out here, and are damage where they are read.
        _ = self.define(record);
    }

    /// Channels of the summary whose schema it does not repeat have none.
    pub(super) fn complete_channels(&mut self) {
        for channel in self.channels.values_mut().filter(|channel| !self.schemas.contains_key(&channel.schema_id)) {
            channel.schema_id = 0;
        }
    }

    fn define(&mut self, record: Record<'_>) -> McapResult<()> {
        match record {
            Record::Schema { header, data } => {
                self.definitions.add_schema(&header, &data)?;
                self.schemas.insert(header.id, (header, data.into_owned()));
            }
            Record::Channel(channel) => {
                self.definitions.add_channel(&channel)?;
                self.channel_ids.remove(&channel.id);
                self.channels.insert(channel.id, channel);
            }
            Record::Statistics(statistics) => self.statistics = Some(statistics),
            _ => {}
        }
        Ok(())
    }

    /// Adds a record of the damaged file; returns `false` if it is damaged.
    ///
    /// # Errors
    /// Fails if the new file cannot be written.
    pub(super) fn take(&mut self, opcode: u8, body: &[u8]) -> McapResult<bool> {
        match opcode {
            op::CHUNK => self.take_chunk(body, false),
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT | op::STATISTICS => {
                self.take_plain(opcode, body)
            }
            // Indexes are rebuilt.
            _ => Ok(true),
        }
    }

    /// Adds the readable messages of the chunk in which the file ends.
    ///
    /// # Errors
    /// Fails if the new file cannot be written.
    pub(super) fn take_cut_chunk(&mut self, body: &[u8]) -> McapResult<()> {
        let before = self.saved();
        self.take_chunk(body, true)?;
        self.unchecked = self.saved() - before;
        Ok(())
    }

    /// Whether it is a recording of a service without the metadata or the scene that belong to it.
    pub(super) fn is_anonymous(&self) -> bool {
        let is_of_service = self.schemas.values().any(|(schema, _)| schema.name.starts_with("flexcrank."));
        is_of_service && !(self.has_metadata && self.has_scene)
    }

    /// Number of messages that no chunk can hold.
    pub(super) fn too_long(&self) -> u64 {
        self.tallies.values().map(|tally| tally.too_long).sum()
    }

    /// Number of messages in the new file.
    pub(super) fn saved(&self) -> u64 {
        self.tallies.values().map(|tally| tally.saved).sum()
    }

    /// Adds the records of a chunk, up to damage; returns `false` if it is damaged. A complete chunk with a wrong checksum has no
    /// records.
    fn take_chunk(&mut self, body: &[u8], is_cut: bool) -> McapResult<bool> {
        self.has_end = false;
        let read = Chunk::open(body, is_cut).and_then(|mut chunk| {
            chunk.find(|record| {
                Ok(match self.take_plain(record.opcode, record.data) {
                    Ok(true) => None,
                    damaged_or_unwritten => Some(damaged_or_unwritten),
                })
            })
        });
        read.map_or(Ok(false), |stopped| stopped.unwrap_or(Ok(true)))
    }

    fn take_plain(&mut self, opcode: u8, body: &[u8]) -> McapResult<bool> {
        let Ok(record) = parse(opcode, body) else { return Ok(false) };
        match record {
            Record::Header(header) => self.ours = header.library.starts_with("flexcrank"),
            Record::Message { header, data } => {
                self.has_end = false;
                self.take_message(header, &data)?;
            }
            Record::Metadata(metadata) => {
                self.has_end |= metadata.name == END;
                self.has_metadata |= metadata.name == session_info::METADATA;
                self.mcap.write_metadata(&metadata)?;
            }
            Record::Attachment { header, data, .. } => {
                self.has_scene |= header.name == session_info::SCENE;
                self.mcap.attach(&Attachment {
                    log_time: header.log_time,
                    create_time: header.create_time,
                    name: header.name,
                    media_type: header.media_type,
                    data,
                })?;
            }
            record => return Ok(self.define(record).is_ok()),
        }
        Ok(true)
    }

    fn take_message(&mut self, header: records::MessageHeader, data: &[u8]) -> McapResult<()> {
        let Some(channel_id) = self.channel_id(header.channel_id)? else {
            self.orphans += 1;
            return Ok(());
        };
        let bytes = MESSAGE_BYTES + data.len() as u64;
        let is_saved = bytes <= CONTENT_LIMIT;
        let jumped_since_ns = self.count(&header, is_saved);
        if !is_saved {
            return Ok(());
        }
        if self.open_bytes + bytes > CHUNK_BYTES {
            self.mcap.flush()?;
            self.open_bytes = 0;
        }
        self.open_bytes += bytes;
        self.mcap.write_to_known_channel(&records::MessageHeader { channel_id, ..header }, data)?;
        self.holes.message(header.log_time, jumped_since_ns);
        let (first, last) = self.span_ns.unwrap_or((header.log_time, header.log_time));
        self.span_ns = Some((first.min(header.log_time), last.max(header.log_time)));
        Ok(())
    }

    /// Counts a message. Returns the log time of the last one of its topic, if messages between them are missing.
    fn count(&mut self, header: &records::MessageHeader, is_saved: bool) -> Option<u64> {
        let channel = self.channels.get(&header.channel_id)?;
        let tally = match self.tallies.get_mut(&channel.topic) {
            Some(tally) => tally,
            None => self.tallies.entry(channel.topic.clone()).or_default(),
        };
        let before = *tally;
        tally.saved += u64::from(is_saved);
        tally.too_long += u64::from(!is_saved);
        tally.counted = tally.counted.max(u64::from(header.sequence) + 1);
        tally.last_ns = header.log_time;
        (self.ours && u64::from(header.sequence) > before.counted).then_some(before.last_ns)
    }

    /// The new file's id for a channel; `None` if the channel is unknown.
    fn channel_id(&mut self, id: u16) -> McapResult<Option<u16>> {
        if let Some(outlet) = self.channel_ids.get(&id) {
            return Ok(Some(*outlet));
        }
        let Some(channel) = self.channels.get(&id) else { return Ok(None) };
        let schema = match self.schemas.get(&channel.schema_id) {
            Some((header, data)) => self.mcap.add_schema(&header.name, &header.encoding, data)?,
            None if channel.schema_id == 0 => 0,
            None => return Ok(None),
        };
        let outlet = self.mcap.add_channel(schema, &channel.topic, &channel.message_encoding, &channel.metadata)?;
        self.channel_ids.insert(id, outlet);
        Ok(Some(outlet))
    }

    /// Compares the statistics of the file with the recovered messages, topic by topic.
    pub(super) fn compare_with_statistics(&mut self) {
        let Some(statistics) = &self.statistics else { return };
        for (id, count) in &statistics.channel_message_counts {
            if let Some(channel) = self.channels.get(id) {
                let tally = self.tallies.entry(channel.topic.clone()).or_default();
                tally.stated = Some(tally.stated.unwrap_or(0).saturating_add(*count));
            }
        }
    }

    /// Records the origin in the new file, and completes its contents.
    pub(super) fn finish(mut self, from: &Path, lost_messages: Option<u64>) -> McapResult<WholeFile> {
        let lost = lost_messages.map_or("unknown".to_owned(), |lost| lost.to_string());
        let facts = [
            ("from", from.display().to_string()),
            ("version", build_info::VERSION.to_owned()),
            ("lost_messages", lost),
            ("unchecked_messages", self.unchecked.to_string()),
        ];
        let metadata = facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        self.mcap.write_metadata(&records::Metadata { name: METADATA.to_owned(), metadata })?;
        self.mcap.finish()?;
        Ok(self.mcap.into_inner().into_inner().into_inner().map_err(IntoInnerError::into_error)?)
    }
}
