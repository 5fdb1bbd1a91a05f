//! Reading recordings message by message, in file order. Memory is bounded by the largest chunk.

use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError, McapResult};

use super::RecordingError;
use super::chunk::Records;
use super::format::{Channels, PIECE, RECORD_HEAD, RECORD_LIMIT, RecordedMessage};
use super::parse::parse;

/// The messages of a recording, in file order. Ends at the first damage, with the error; a chunk with a wrong checksum yields no
/// message. If the file ends inside a chunk, the complete messages of that chunk are read.
pub struct Messages {
    path: PathBuf,
    file: BufReader<File>,
    records: LinearReader,
    /// Start of the next record, bytes.
    position: u64,
    chunk: Option<Records<'static>>,
    /// Whether the file ends inside that record.
    cut: bool,
    channels: Channels,
    over: bool,
}

impl Messages {
    /// Opens a recording, complete or cut off.
    ///
    /// # Errors
    /// [`RecordingError::File`] if the file cannot be opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = BufReader::new(File::open(path).map_err(RecordingError::file(path))?);
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_emit_chunks(true)
            .with_record_length_limit(RECORD_LIMIT);
        Ok(Messages {
            path: path.to_owned(),
            file,
            records: LinearReader::new_with_options(options),
            position: MAGIC.len() as u64,
            chunk: None,
            cut: false,
            channels: Channels::default(),
            over: false,
        })
    }

    /// Reads the next message; `None` at the end of the data.
    fn read(&mut self) -> McapResult<Option<RecordedMessage>> {
        loop {
            if let Some(chunk) = &mut self.chunk {
                match chunk.find(|opcode, data| take(opcode, data, &mut self.channels)) {
                    Ok(Some(message)) => return Ok(Some(message)),
                    Ok(None) => self.chunk = None,
                    Err(_) if self.cut => return Err(McapError::UnexpectedEof),
                    Err(error) => return Err(error),
                }
            }
            if self.cut {
                return Err(McapError::UnexpectedEof);
            }
            match self.read_outside()? {
                Outside::Message(message) => return Ok(Some(message)),
                Outside::Chunk => {}
                Outside::End => return Ok(None),
            }
        }
    }

    /// Reads the next record outside of chunks; a chunk record opens the chunk.
    fn read_outside(&mut self) -> McapResult<Outside> {
        while let Some(event) = self.records.next_event() {
            match event {
                Err(McapError::UnexpectedEof) => {
                    self.cut = true;
                    self.chunk = Some(self.cut_chunk()?);
                    return Ok(Outside::Chunk);
                }
                Ok(LinearReadEvent::ReadRequest(size)) => {
                    let read = self.file.read(self.records.insert(size.min(PIECE)))?;
                    self.records.notify_read(read);
                }
                Ok(LinearReadEvent::Record { opcode: op::DATA_END, .. }) => return Ok(Outside::End),
                Ok(LinearReadEvent::Record { opcode: op::CHUNK, data }) => {
                    self.position += RECORD_HEAD + data.len() as u64;
                    self.chunk = Some(Records::of(data.to_vec())?);
                    return Ok(Outside::Chunk);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    self.position += RECORD_HEAD + data.len() as u64;
                    if let Some(message) = take(opcode, data, &mut self.channels)? {
                        return Ok(Outside::Message(message));
                    }
                }
                Err(error) => return Err(error),
            }
        }
        Ok(Outside::End)
    }

    /// Reads the remains of the chunk in which the file ends.
    fn cut_chunk(&mut self) -> McapResult<Records<'static>> {
        let mut rest = Vec::new();
        self.file.seek(SeekFrom::Start(self.position))?;
        // A longer record would have failed before.
        self.file.by_ref().take(RECORD_HEAD + RECORD_LIMIT as u64).read_to_end(&mut rest)?;
        if rest.first() != Some(&op::CHUNK) || rest.len() < RECORD_HEAD as usize {
            return Err(McapError::UnexpectedEof);
        }
        rest.drain(..RECORD_HEAD as usize);
        Records::of_cut(rest).map_err(|_| McapError::UnexpectedEof)
    }
}

enum Outside {
    Message(RecordedMessage),
    Chunk,
    End,
}

/// Decodes a message record; `None` for other records. These are not parsed, so that a damaged attachment does not block the
/// messages.
pub(super) fn take(opcode: u8, data: &[u8], channels: &mut Channels) -> McapResult<Option<RecordedMessage>> {
    if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
        return Ok(None);
    }
    match parse(opcode, data)? {
        Record::Schema { header, data } => channels.add_schema_from_slice(header, &data)?,
        Record::Channel(channel) => channels.add_channel(channel)?,
        Record::Message { header: MessageHeader { channel_id, sequence, log_time, publish_time }, data } => {
            let channel = channels.get(channel_id).ok_or(McapError::UnknownChannel(sequence, channel_id))?;
            return Ok(Some(mcap::Message { channel, sequence, log_time, publish_time, data: data.into_owned().into() }));
        }
        _ => {}
    }
    Ok(None)
}

impl Iterator for Messages {
    type Item = Result<RecordedMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.over {
            return None;
        }
        let next = self.read().map_err(RecordingError::mcap(&self.path)).transpose();
        self.over = !matches!(next, Some(Ok(_)));
        next
    }
}

/// Whether an error only states that the file ends early, as after a killed program.
pub fn is_cut_off(error: &RecordingError) -> bool {
    matches!(error, RecordingError::Mcap { cause: McapError::UnexpectedEof, .. })
}
