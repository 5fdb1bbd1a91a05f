//! Reading recordings message by message, in file order. Memory is bounded by the largest chunk.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use mcap::records::{Record, op};
use mcap::sans_io::LinearReaderOptions;
use mcap::{McapError, McapResult};

use super::RecordingError;
use super::definitions::Channels;
use super::end::END;
use super::format::RecordedMessage;
use super::open::open;
use super::records::{Chunk, RawRecord, Records};

/// The messages of a recording, in file order. Ends at the first damage, with the error; a chunk with a wrong checksum yields no
/// message. If the file ends inside a chunk, the complete messages of that chunk are read.
pub struct Messages {
    path: PathBuf,
    records: Records<BufReader<File>>,
    chunk: Option<Chunk<'static>>,
    /// Whether the file ends inside that chunk.
    cut: bool,
    channels: Channels,
    /// Whether the recording states its end behind the last chunk: no message follows.
    has_end: bool,
    over: bool,
}

impl Messages {
    /// Opens a recording, complete or cut off.
    ///
    /// # Errors
    /// [`RecordingError::File`] if the file cannot be opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = BufReader::new(open(path)?);
        let records = Records::of(file, LinearReaderOptions::default().with_skip_end_magic(true));
        let channels = Channels::default();
        Ok(Messages { path: path.to_owned(), records, chunk: None, cut: false, channels, has_end: false, over: false })
    }

    /// Reads the next message; `None` at the end of the data.
    fn read(&mut self) -> McapResult<Option<RecordedMessage>> {
        loop {
            if let Some(chunk) = &mut self.chunk {
                match chunk.find(|record| message(&record, &mut self.channels)) {
                    Ok(None) | Err(_) if self.cut => return Err(McapError::UnexpectedEof),
                    Ok(None) => self.chunk = None,
                    found => return found,
                }
            }
            match self.read_outside() {
                Err(McapError::UnexpectedEof) => match self.records.cut_chunk() {
                    Ok(chunk) => (self.chunk, self.cut) = (Some(chunk), true),
                    Err(McapError::UnexpectedEof) if self.has_end => return Ok(None),
                    Err(error) => return Err(error),
                },
                Ok(Some(None)) if self.chunk.is_some() => {}
                // The file ends between two records, before the end of the data.
                Ok(None) if !self.has_end => return Err(McapError::UnexpectedEof),
                found => return found.map(Option::flatten),
            }
        }
    }

    /// Reads the next message outside of chunks, or up to the next chunk, which it opens, or to the end of the data.
    fn read_outside(&mut self) -> McapResult<Option<Option<RecordedMessage>>> {
        self.records.find(|record| match record.opcode {
            op::DATA_END => Ok(Some(None)),
            op::CHUNK => {
                self.has_end = false;
                self.chunk = Some(Chunk::bounded(record.data.to_vec())?);
                Ok(Some(None))
            }
            op::MESSAGE => {
                self.has_end = false;
                Ok(message(&record, &mut self.channels)?.map(Some))
            }
            op::METADATA => {
                self.has_end |= matches!(record.parse(), Ok(Record::Metadata(metadata)) if metadata.name == END);
                Ok(None)
            }
            _ => Ok(message(&record, &mut self.channels)?.map(Some)),
        })
    }
}

/// Decodes a message record; `None` for other records. Most of these are not parsed, so that a damaged attachment does not block
/// the messages.
fn message(record: &RawRecord<'_>, channels: &mut Channels) -> McapResult<Option<RecordedMessage>> {
    if matches!(record.opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) { record.message(channels) } else { Ok(None) }
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
