//! Limits and types of the MCAP format that all readers share.

use std::borrow::Cow;
use std::io::{Read, Result, Seek, SeekFrom};
use std::sync::Arc;

use mcap::records::MessageHeader;
use mcap::{MAGIC, McapError, McapResult};

/// Size limit of the content of a chunk, bytes. A file that states a larger one is refused.
pub(super) const CONTENT_LIMIT: u64 = 64 * 1024 * 1024;

/// Size limit of a record, bytes: a chunk whose content does not compress is a little longer than that.
pub(super) const RECORD_LIMIT: u64 = CONTENT_LIMIT + CONTENT_LIMIT / 128;

/// Size of the opcode and length before every record, bytes.
pub(super) const RECORD_HEAD: usize = 9;

/// A topic of a recording, with its encoding and schema.
pub type Channel = mcap::Channel<'static>;

/// A message of a recording.
pub type RecordedMessage = mcap::Message<'static>;

/// Links a message to its channel, and copies its bytes.
///
/// # Errors
/// Fails if the channel is unknown.
pub(super) fn message(header: MessageHeader, data: Cow<'_, [u8]>, channel: Option<Arc<Channel>>) -> McapResult<RecordedMessage> {
    let MessageHeader { channel_id, sequence, log_time, publish_time } = header;
    let channel = channel.ok_or(McapError::UnknownChannel(sequence, channel_id))?;
    Ok(RecordedMessage { channel, sequence, log_time, publish_time, data: data.into_owned().into() })
}

/// Opcode and length of the record that begins with these bytes.
pub(super) fn record_head(bytes: &[u8]) -> Option<(u8, u64)> {
    Some((*bytes.first()?, number(bytes, 1)?))
}

/// Header of a chunk.
pub(super) struct ChunkHead<'a> {
    /// Log times of its first and last message, ns.
    pub span_ns: [u64; 2],
    /// Size of its content, as stated, bytes.
    pub size: u64,
    /// Name of its compression.
    pub compression: &'a [u8],
    /// Where its content ends in the body of the record.
    pub end: u64,
}

impl<'a> ChunkHead<'a> {
    /// Reads the header from the beginning of a chunk record's body; `None` if it is incomplete.
    pub fn of(body: &'a [u8]) -> Option<Self> {
        let name_end = 32 + u32::from_le_bytes(*body.get(28..)?.first_chunk()?) as usize;
        let end = number(body, name_end)?.checked_add(name_end as u64 + 8)?;
        let [start_ns, end_ns, size] = [number(body, 0)?, number(body, 8)?, number(body, 16)?];
        Some(ChunkHead { span_ns: [start_ns, end_ns], size, compression: body.get(32..name_end)?, end })
    }
}

fn number(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// Whether a file ends like one that was closed. Leaves the file at its beginning.
pub(super) fn is_closed(file: &mut (impl Read + Seek)) -> Result<bool> {
    let mut end = Vec::new();
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(length.saturating_sub(MAGIC.len() as u64)))?;
    file.read_to_end(&mut end)?;
    file.rewind()?;
    Ok(length > MAGIC.len() as u64 && end == MAGIC)
}
