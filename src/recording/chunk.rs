//! Chunks of MCAP files: their records and messages.

use std::borrow::Cow;
use std::collections::BTreeMap;

use mcap::records::{MessageIndexEntry, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};

use super::format::{Channels, RECORD_HEAD, RECORD_LIMIT, RecordedMessage};
use super::parse::parse;

/// Size of a chunk's header without the name of its compression, bytes.
const HEADER: usize = 40;

/// Iterates over the records of a chunk. A record never reaches beyond the chunk, whatever its length states.
pub(super) struct Records<'a> {
    bytes: Cow<'a, [u8]>,
    at: usize,
    reader: LinearReader,
}

impl<'a> Records<'a> {
    /// Opens a complete chunk record. Its checksum is checked first.
    ///
    /// # Errors
    /// Fails if the record is shorter than stated.
    pub(super) fn of(record: impl Into<Cow<'a, [u8]>>) -> McapResult<Self> {
        let mut record = record.into();
        let length = content_end(&record).filter(|end| *end <= record.len()).ok_or(McapError::UnexpectedEoc)?;
        match &mut record {
            Cow::Borrowed(record) => *record = &record[..length],
            Cow::Owned(record) => record.truncate(length),
        }
        Ok(Records::new(record, length, true))
    }

    /// Opens the beginning of a chunk record that was cut off. No checksum covers it.
    ///
    /// # Errors
    /// Fails if the header is incomplete or invalid.
    pub(super) fn of_cut(record: impl Into<Cow<'a, [u8]>>) -> McapResult<Self> {
        let record = record.into();
        let length = content_end(&record).filter(|end| *end >= record.len()).ok_or(McapError::UnexpectedEoc)?;
        Ok(Records::new(record, length, false))
    }

    fn new(bytes: Cow<'a, [u8]>, length: usize, check_sum_first: bool) -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(check_sum_first)
            .with_record_length_limit(RECORD_LIMIT);
        let mut reader = LinearReader::new_with_options(options);
        let head = [&[op::CHUNK][..], &(length as u64).to_le_bytes()].concat();
        reader.insert(head.len()).copy_from_slice(&head);
        reader.notify_read(head.len());
        Records { bytes, at: 0, reader }
    }

    /// Passes records to `take` until it returns a value; `None` if there are no more records.
    ///
    /// # Errors
    /// Fails if the chunk is damaged or cut off, or if `take` fails.
    pub(super) fn find<T>(&mut self, mut take: impl FnMut(u8, &[u8]) -> McapResult<Option<T>>) -> McapResult<Option<T>> {
        while let Some(event) = self.reader.next_event() {
            // The reader treats the chunk as a file.
            let event =
                event.map_err(|error| if matches!(error, McapError::UnexpectedEof) { McapError::UnexpectedEoc } else { error });
            match event? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let rest = &self.bytes[self.at..];
                    let size = wanted.min(rest.len());
                    self.reader.insert(size).copy_from_slice(&rest[..size]);
                    self.reader.notify_read(size);
                    self.at += size;
                }
                LinearReadEvent::Record { opcode, data } => {
                    if let Some(found) = take(opcode, data)? {
                        return Ok(Some(found));
                    }
                }
            }
        }
        Ok(None)
    }
}

/// Returns where the content of a chunk ends, by its header.
fn content_end(record: &[u8]) -> Option<usize> {
    let name = usize::try_from(u32::from_le_bytes(*record.get(28..)?.first_chunk()?)).ok()?;
    let size = u64::from_le_bytes(*record.get(name.checked_add(HEADER - 8)?..)?.first_chunk()?);
    let end = usize::try_from(size).ok()?.checked_add(HEADER + name)?;
    (end <= RECORD_LIMIT).then_some(end)
}

/// The messages of a chunk with a valid checksum.
#[derive(Default)]
pub(super) struct Chunk {
    /// Messages with their channel ids.
    pub messages: Vec<(u16, RecordedMessage)>,
    /// The expected content of the chunk's message indexes.
    pub index: BTreeMap<u16, Vec<MessageIndexEntry>>,
}

impl Chunk {
    /// Reads a chunk record.
    pub(super) fn read(record: &[u8], channels: &mut Channels) -> McapResult<Self> {
        let (mut chunk, mut offset) = (Chunk::default(), 0);
        Records::of(record)?.find(|opcode, data| {
            chunk.take(parse(opcode, data)?, offset, channels)?;
            offset += RECORD_HEAD + data.len() as u64;
            Ok(None::<()>)
        })?;
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
                let message = RecordedMessage {
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
