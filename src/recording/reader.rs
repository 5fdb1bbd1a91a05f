//! Recordings read back, message by message, in file order; memory is bounded by the largest chunk.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use mcap::read::ChannelAccumulator;
use mcap::records::{MessageHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};

use super::RecordingError;
use super::parse::parse;

/// Largest record and largest chunk that are read, bytes; a file that claims a larger one is refused.
pub(super) const RECORD_LIMIT: usize = 64 * 1024 * 1024;

/// A topic of a recording, with its encoding and schema.
pub type Channel = mcap::Channel<'static>;

/// One message of a recording.
pub type Recorded = mcap::Message<'static>;

/// The messages of a recording, in file order. Ends at the first damage, with the error.
pub struct Messages {
    path: PathBuf,
    file: BufReader<File>,
    records: LinearReader,
    channels: ChannelAccumulator<'static>,
    over: bool,
}

impl Messages {
    /// Opens a recording, whole or cut off.
    ///
    /// # Errors
    /// [`RecordingError::File`] when it cannot be opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = BufReader::new(File::open(path).map_err(RecordingError::file(path))?);
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_LIMIT);
        let records = LinearReader::new_with_options(options);
        Ok(Messages { path: path.to_owned(), file, records, channels: ChannelAccumulator::default(), over: false })
    }

    /// The next message; `None` at the end of the data. Records of no use here are not looked into: a damaged attachment must
    /// not keep anybody from the messages.
    fn read(&mut self) -> McapResult<Option<Recorded>> {
        while let Some(event) = self.records.next_event() {
            match event? {
                LinearReadEvent::ReadRequest(size) => {
                    let read = self.file.read(self.records.insert(size))?;
                    self.records.notify_read(read);
                }
                LinearReadEvent::Record { opcode: op::DATA_END, .. } => return Ok(None),
                LinearReadEvent::Record { opcode: opcode @ (op::SCHEMA | op::CHANNEL | op::MESSAGE), data } => {
                    match parse(opcode, data)? {
                        Record::Schema { header, data } => self.channels.add_schema_from_slice(header, &data)?,
                        Record::Channel(channel) => self.channels.add_channel(channel)?,
                        Record::Message { header, data } => {
                            let data = data.into_owned();
                            return self.message(header, data).map(Some);
                        }
                        _ => {}
                    }
                }
                LinearReadEvent::Record { .. } => {}
            }
        }
        Ok(None)
    }

    fn message(&self, header: MessageHeader, data: Vec<u8>) -> McapResult<Recorded> {
        let MessageHeader { channel_id, sequence, log_time, publish_time } = header;
        let channel = self.channels.get(channel_id).ok_or(McapError::UnknownChannel(sequence, channel_id))?;
        Ok(mcap::Message { channel, sequence, log_time, publish_time, data: data.into() })
    }
}

impl Iterator for Messages {
    type Item = Result<Recorded, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.over {
            return None;
        }
        let next = self.read().map_err(RecordingError::mcap(&self.path)).transpose();
        self.over = !matches!(next, Some(Ok(_)));
        next
    }
}

/// Whether an error only says that the file ends early, as a recording does whose program was killed.
pub fn is_cut_off(error: &RecordingError) -> bool {
    matches!(error, RecordingError::Mcap { cause: mcap::McapError::UnexpectedEof | mcap::McapError::UnexpectedEoc, .. })
}
