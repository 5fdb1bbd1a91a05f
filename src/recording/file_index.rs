//! The index and the statistics of a file, computed from its records, beside those that it states. Memory grows with the topics alone.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};

use mcap::records::{
    AttachmentHeader, AttachmentIndex, ChunkHeader, ChunkIndex, Footer, MessageIndex, MetadataIndex, Record, Statistics,
    SummaryOffset,
};

use super::format::{RECORD_HEAD, RecordedMessage};
use super::records::RawRecord;

/// Longer names of topics are cut, so that many of them take little memory, characters.
const LONGEST_TOPIC: usize = 256;

/// Records of one kind in the file, and entries of the index, in any order: their numbers, and the sums of their hashes.
#[derive(Default)]
struct Listing {
    there: u64,
    listed: u64,
    there_sum: u64,
    listed_sum: u64,
}

impl Listing {
    fn there(&mut self, entry: impl Hash) {
        self.there += 1;
        self.there_sum = self.there_sum.wrapping_add(hash(entry));
    }

    fn listed(&mut self, entry: impl Hash) {
        self.listed += 1;
        self.listed_sum = self.listed_sum.wrapping_add(hash(entry));
    }

    /// The fault of the index, if it has one.
    fn fault(&self, what: &str) -> Option<String> {
        let Listing { there, listed, .. } = self;
        match listed == there {
            false => Some(format!("the index lists {listed} {what}, but the file has {there}")),
            true => (self.listed_sum != self.there_sum)
                .then(|| format!("the index states other places or properties of {what} than they have")),
        }
    }
}

fn hash(entry: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    entry.hash(&mut hasher);
    hasher.finish()
}

/// The content of a file, as far as it was read.
#[derive(Default)]
pub(super) struct FileIndex {
    /// The last chunk, whose message indexes come after it.
    chunk: Option<ChunkIndex>,
    chunks: Listing,
    attachments: Listing,
    metadata: Listing,
    /// Topics by the id of their channels.
    topics: BTreeMap<u16, String>,
    schemas: BTreeSet<u16>,
    /// Number of messages, and those of each channel.
    messages: u64,
    counts: BTreeMap<u16, u64>,
    /// Earliest and latest log time, ns.
    span_ns: Option<[u64; 2]>,
    has_data_end: bool,
    has_statistics: bool,
    /// Like records behind the end of the data, by kind.
    groups: BTreeMap<u8, SummaryOffset>,
    /// Position of the first stated group; 0 if there is none. Whether one is stated wrongly.
    groups_start: u64,
    has_wrong_group: bool,
}

impl FileIndex {
    /// Notes a chunk, before its messages.
    pub fn chunk(&mut self, record: &RawRecord<'_>, header: ChunkHeader) {
        self.close_chunk();
        let ChunkHeader { message_start_time, message_end_time, compression, compressed_size, uncompressed_size, .. } = header;
        let [chunk_start_offset, chunk_length] = extent(record);
        self.chunk = Some(ChunkIndex {
            message_start_time,
            message_end_time,
            chunk_start_offset,
            chunk_length,
            message_index_offsets: BTreeMap::new(),
            message_index_length: 0,
            compression,
            compressed_size,
            uncompressed_size,
        });
    }

    fn close_chunk(&mut self) {
        self.chunk.take().iter().for_each(|chunk| self.chunks.there(of_chunk(chunk)));
    }

    /// Notes the messages of the last chunk. Returns its fault: log times that are not those of its messages.
    pub fn messages(&mut self, messages: &[RecordedMessage]) -> Option<String> {
        self.messages += messages.len() as u64;
        for message in messages {
            *self.counts.entry(message.channel.id).or_default() += 1;
            self.topics.entry(message.channel.id).or_insert_with(|| shortened(&message.channel.topic));
        }
        let times = || messages.iter().map(|message| message.log_time);
        let [first, last] = [times().min()?, times().max()?];
        let [earliest, latest] = self.span_ns.unwrap_or([first, last]);
        self.span_ns = Some([earliest.min(first), latest.max(last)]);
        let ChunkIndex { message_start_time: from, message_end_time: to, .. } = self.chunk.as_ref()?;
        ([*from, *to] != [first, last])
            .then(|| format!("a chunk states log times from {from} to {to} ns, but its messages have {first} to {last} ns"))
    }

    /// Notes a definition, also one within a chunk.
    pub fn definition(&mut self, record: &Record<'_>) {
        match record {
            Record::Schema { header, .. } => _ = self.schemas.insert(header.id),
            Record::Channel(channel) => _ = self.topics.insert(channel.id, shortened(&channel.topic)),
            _ => {}
        }
    }

    /// Notes the index of a channel's messages in the last chunk. Returns its fault: there is no chunk.
    pub fn message_index(&mut self, record: &RawRecord<'_>, index: &MessageIndex) -> Option<String> {
        let Some(chunk) = &mut self.chunk else { return Some("a message index belongs to no chunk".to_owned()) };
        let [at, length] = extent(record);
        chunk.message_index_length = chunk.message_index_length.saturating_add(length);
        chunk.message_index_offsets.insert(index.channel_id, at);
        None
    }

    /// Notes an attachment.
    pub fn attachment(&mut self, record: &RawRecord<'_>, header: &AttachmentHeader, data_size: usize) {
        let AttachmentHeader { log_time, create_time, name, media_type } = header;
        self.attachments.there((extent(record), log_time, create_time, data_size as u64, name, media_type));
    }

    /// Notes a metadata record.
    pub fn metadata(&mut self, record: &RawRecord<'_>, name: &str) {
        self.metadata.there((extent(record), name));
    }

    /// Notes what comes behind the data, and what it states of the file. Statistics are compared apart.
    pub fn summary(&mut self, raw: &RawRecord<'_>, record: &Record<'_>) {
        let [at, length] = extent(raw);
        match record {
            Record::DataEnd(_) => {
                self.has_data_end = true;
                return self.close_chunk();
            }
            Record::SummaryOffset(group) => {
                self.groups_start = if self.groups_start == 0 { at } else { self.groups_start };
                // Some programs also state where records would be that they did not write.
                let fits = self.groups.get(&group.group_opcode).map_or(group.group_length == 0, |there| there == group);
                self.has_wrong_group |= !fits;
                return;
            }
            Record::ChunkIndex(index) => self.chunks.listed(of_chunk(index)),
            Record::AttachmentIndex(index) => {
                let AttachmentIndex { offset, length, log_time, create_time, data_size, name, media_type } = index;
                self.attachments.listed(([*offset, *length], log_time, create_time, data_size, name, media_type));
            }
            Record::MetadataIndex(MetadataIndex { offset, length, name }) => self.metadata.listed(([*offset, *length], name)),
            _ => {}
        }
        if self.has_data_end {
            let new = SummaryOffset { group_opcode: raw.opcode, group_start: at, group_length: 0 };
            self.groups.entry(raw.opcode).or_insert(new).group_length += length;
        }
    }

    /// The fault of the index, if it has one. Other programs may leave out that of attachments and metadata.
    pub fn fault(&self, footer: &Footer) -> Option<String> {
        let optional = |listing: &Listing, what: &str| listing.fault(what).filter(|_| listing.listed > 0);
        let of_groups = || {
            let first = self.groups.values().map(|group| group.group_start).min();
            let starts_there = first.is_none_or(|start| start == footer.summary_start);
            let offsets_there = self.groups_start == 0 || self.groups_start == footer.summary_offset_start;
            let fits = !self.has_wrong_group && starts_there && offsets_there;
            (!fits).then(|| "the footer states other places in the index than it has".to_owned())
        };
        (self.chunks.fault("chunks"))
            .or_else(|| optional(&self.attachments, "attachments"))
            .or_else(|| optional(&self.metadata, "metadata records"))
            .or_else(of_groups)
    }

    /// The fault of the statistics, if they have one. `is_whole`: nothing that was read is damaged.
    pub fn fault_of_statistics(&mut self, stated: &Statistics, is_whole: bool) -> Option<String> {
        if std::mem::replace(&mut self.has_statistics, true) {
            return Some("the statistics are there more than once".to_owned());
        }
        let [first, last] = self.span_ns.unwrap_or_default();
        let others = [
            (u64::from(stated.schema_count), self.schemas.len() as u64, "schemas"),
            (u64::from(stated.channel_count), self.topics.len() as u64, "topics"),
            (u64::from(stated.attachment_count), self.attachments.there, "attachments"),
            (u64::from(stated.metadata_count), self.metadata.there, "metadata records"),
            (u64::from(stated.chunk_count), self.chunks.there, "chunks"),
        ];
        let times = || {
            let [from, to] = [stated.message_start_time, stated.message_end_time];
            let what =
                || format!("the statistics state log times from {from} to {to} ns, but the messages have {first} to {last} ns");
            ([from, to] != [first, last]).then(what)
        };
        let differs = |stated: u64, found: u64, what: &str| {
            (stated != found).then(|| format!("the statistics state {stated} {what}, and {found} can be read"))
        };
        let of_channel = |id: &u16| {
            let [stated, found] =
                [&stated.channel_message_counts, &self.counts].map(|counts| counts.get(id).copied().unwrap_or(0));
            let topic = self.topics.get(id).map_or_else(|| format!("channel {id}, which is not there"), String::clone);
            differs(stated, found, &format!("messages of {topic}"))
        };
        let of_all = || others.into_iter().find_map(|(stated, found, what)| differs(stated, found, what)).or_else(times);
        differs(stated.message_count, self.messages, "messages")
            .or_else(|| stated.channel_message_counts.keys().chain(self.counts.keys()).find_map(of_channel))
            .or_else(|| if is_whole { of_all() } else { None })
    }

    /// Topics that are defined, and have no message.
    pub fn silent_topics(&self) -> Vec<String> {
        let silent = self.topics.iter().filter(|(id, _)| !self.counts.contains_key(id));
        silent.map(|(_, topic)| topic.clone()).collect()
    }
}

fn shortened(topic: &str) -> String {
    topic.chars().take(LONGEST_TOPIC).collect()
}

/// The properties of a chunk in an index.
fn of_chunk(index: &ChunkIndex) -> impl Hash + '_ {
    let ChunkIndex { message_start_time, message_end_time, chunk_start_offset, chunk_length, .. } = index;
    let ChunkIndex { message_index_offsets, message_index_length, compression, compressed_size, uncompressed_size, .. } = index;
    (
        [message_start_time, message_end_time, chunk_start_offset, chunk_length],
        (message_index_offsets, message_index_length),
        (compression, compressed_size, uncompressed_size),
    )
}

/// Position and length of a record, bytes.
fn extent(record: &RawRecord<'_>) -> [u64; 2] {
    [record.at, (RECORD_HEAD + record.data.len()) as u64]
}
