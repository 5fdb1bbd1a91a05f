//! Reads the records of a file, its summary or a chunk one after another. Memory is bounded by the largest record or chunk.

use std::borrow::Cow;
use std::io::{Cursor, Read, Seek, SeekFrom, Take};

use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError, McapResult};

use super::definitions::Channels;
use super::format::{CONTENT_LIMIT, ChunkHead, RECORD_HEAD, RECORD_LIMIT, RecordedMessage, message, record_head};
use super::parse::parse;

/// Largest single read from a file, bytes, so that a wrong length allocates no memory.
const PIECE: usize = 64 * 1024;

/// A record before it is parsed.
pub(super) struct RawRecord<'a> {
    /// Its position in the file or chunk, bytes.
    pub at: u64,
    pub opcode: u8,
    pub data: &'a [u8],
}

impl<'a> RawRecord<'a> {
    /// Parses the record.
    pub fn parse(&self) -> McapResult<Record<'a>> {
        parse(self.opcode, self.data)
    }

    /// Parses the record; returns a message with its channel, and remembers a schema or a channel.
    pub fn message(&self, channels: &mut Channels) -> McapResult<Option<RecordedMessage>> {
        match self.parse()? {
            Record::Schema { header, data } => channels.add_schema(header, &data)?,
            Record::Channel(channel) => channels.add_channel(channel)?,
            Record::Message { header, data } => return message(header, data, channels.get(header.channel_id)).map(Some),
            _ => {}
        }
        Ok(None)
    }
}

/// Iterates over the records of a source.
pub(super) struct Records<R> {
    source: R,
    reader: LinearReader,
    /// Start of the next record, bytes.
    position: u64,
    /// Largest single read, bytes.
    piece: usize,
    is_chunk: bool,
}

/// The records of a chunk. A record never reaches beyond the chunk, whatever its length states.
pub(super) type Chunk<'a> = Records<Take<Cursor<Cow<'a, [u8]>>>>;

impl<R: Read> Records<R> {
    /// Reads a file, or a part of one; chunks are not opened.
    pub fn of(source: R, options: LinearReaderOptions) -> Self {
        let position = if options.skip_start_magic { 0 } else { MAGIC.len() as u64 };
        let options = options.with_emit_chunks(true).with_record_length_limit(RECORD_LIMIT as usize);
        Records { source, reader: LinearReader::new_with_options(options), position, piece: PIECE, is_chunk: false }
    }

    /// Start of the next record, bytes.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Passes records to `take` until it returns a value; `None` if there are no more records.
    ///
    /// # Errors
    /// Fails if the source cannot be read, is damaged or ends inside a record, or if `take` fails.
    pub fn find<T>(&mut self, mut take: impl FnMut(RawRecord<'_>) -> McapResult<Option<T>>) -> McapResult<Option<T>> {
        while let Some(event) = self.reader.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    let read = self.source.read(self.reader.insert(wanted.min(self.piece)))?;
                    self.reader.notify_read(read);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let at = self.position;
                    self.position += (RECORD_HEAD + data.len()) as u64;
                    if let Some(found) = take(RawRecord { at, opcode, data })? {
                        return Ok(Some(found));
                    }
                }
                Err(McapError::UnexpectedEof) if self.is_chunk => return Err(McapError::UnexpectedEoc),
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }
}

impl<R: Read + Seek> Records<R> {
    /// Opens the remains of the chunk in which the file ends.
    ///
    /// # Errors
    /// Fails if the file does not end in a chunk.
    pub fn cut_chunk(&mut self) -> McapResult<Chunk<'static>> {
        let mut rest = Vec::new();
        self.source.seek(SeekFrom::Start(self.position))?;
        // A longer record would have failed before.
        self.source.by_ref().take(RECORD_HEAD as u64 + RECORD_LIMIT).read_to_end(&mut rest)?;
        match record_head(&rest) {
            Some((op::CHUNK, _)) => Chunk::open(rest.split_off(RECORD_HEAD), true).map_err(|_| McapError::UnexpectedEof),
            _ => Err(McapError::UnexpectedEof),
        }
    }
}

impl<'a> Chunk<'a> {
    /// Opens the body of a complete chunk whose messages are kept together.
    ///
    /// # Errors
    /// Fails as [`Chunk::open`], or if it states more content than [`CONTENT_LIMIT`]: the library refuses that only with a checksum. It
    /// refuses content beyond what is stated.
    pub fn bounded(body: impl Into<Cow<'a, [u8]>>) -> McapResult<Self> {
        let body = body.into();
        match ChunkHead::of(&body) {
            Some(ChunkHead { size, .. }) if size > CONTENT_LIMIT => Err(McapError::ChunkTooLarge(size)),
            _ => Chunk::open(body, false),
        }
    }

    /// Opens the body of a chunk record. The checksum of a complete chunk is checked first; none covers one that was cut off.
    ///
    /// # Errors
    /// Fails if the header is incomplete, or states another length.
    pub fn open(body: impl Into<Cow<'a, [u8]>>, is_cut: bool) -> McapResult<Self> {
        let body = body.into();
        let (end, size) = (ChunkHead::of(&body).map_or(u64::MAX, |head| head.end), body.len());
        let fits = if is_cut { (size as u64..=RECORD_LIMIT).contains(&end) } else { end <= size as u64 };
        if !fits {
            return Err(McapError::UnexpectedEoc);
        }
        // To the library, the chunk is a file.
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(!is_cut)
            .with_record_length_limit(CONTENT_LIMIT as usize);
        let mut reader = LinearReader::new_with_options(options);
        let head = [&[op::CHUNK][..], &end.to_le_bytes()].concat();
        reader.insert(head.len()).copy_from_slice(&head);
        reader.notify_read(head.len());
        Ok(Records { source: Cursor::new(body).take(end), reader, position: 0, piece: size, is_chunk: true })
    }
}
