//! One chunk, decoded as a whole or not at all.

use std::collections::BTreeMap;

use mcap::read::ChannelAccumulator;
use mcap::records::{ChunkHeader, MessageIndexEntry, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};

use super::parse::parse;
use super::reader::{RECORD_LIMIT, Recorded};

/// Channels and schemas seen so far.
pub(super) type Channels = ChannelAccumulator<'static>;

/// Bytes of a chunk's header without its compression's name.
const HEADER: usize = 40;
/// Opcode and length before every record.
const RECORD_HEAD: u64 = 9;

/// The messages of a chunk whose sum is right.
#[derive(Default)]
pub(super) struct Chunk {
    /// With the number of their channel.
    pub messages: Vec<(u16, Recorded)>,
    /// What its message indexes must say.
    pub index: BTreeMap<u16, Vec<MessageIndexEntry>>,
}

impl Chunk {
    /// From a chunk record, whose parsed header is `header`.
    pub(super) fn read(header: &ChunkHeader, record: &[u8], channels: &mut Channels) -> McapResult<Self> {
        let length = usize::try_from(header.compressed_size).unwrap_or(usize::MAX);
        let length = length.saturating_add(HEADER + header.compression.len());
        let record = record.get(..length).ok_or(McapError::UnexpectedEoc)?;
        let head = [&[op::CHUNK][..], &(record.len() as u64).to_le_bytes()].concat();
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(RECORD_LIMIT);
        let mut reader = LinearReader::new_with_options(options);
        reader.insert(head.len()).copy_from_slice(&head);
        reader.notify_read(head.len());
        let (mut rest, mut chunk, mut offset) = (record, Chunk::default(), 0);
        while let Some(event) = reader.next_event() {
            match event? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let (piece, left) = rest.split_at(wanted.min(rest.len()));
                    reader.insert(piece.len()).copy_from_slice(piece);
                    reader.notify_read(piece.len());
                    rest = left;
                }
                LinearReadEvent::Record { opcode, data } => {
                    chunk.take(parse(opcode, data)?, offset, channels)?;
                    offset += RECORD_HEAD + data.len() as u64;
                }
            }
        }
        Ok(chunk)
    }

    fn take(&mut self, record: Record<'_>, offset: u64, channels: &mut Channels) -> McapResult<()> {
        match record {
            Record::Schema { header, data } => channels.add_schema_from_slice(header, &data)?,
            Record::Channel(channel) => channels.add_channel(channel)?,
            Record::Message { header, data } => {
                let id = header.channel_id;
                let channel = channels.get(id).ok_or(McapError::UnknownChannel(header.sequence, id))?;
                self.index.entry(id).or_default().push(MessageIndexEntry { log_time: header.log_time, offset });
                let message = Recorded {
                    channel,
                    sequence: header.sequence,
                    log_time: header.log_time,
                    publish_time: header.publish_time,
                    data: data.into_owned().into(),
                };
                self.messages.push((id, message));
            }
            _ => {}
        }
        Ok(())
    }
}
