//! The summary at the end of a file: topics, statistics and index.

use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;

use mcap::records::{self, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{Channel, MAGIC, McapResult, Schema, Summary};

use super::format::{RECORD_HEAD, RECORD_LIMIT};
use super::parse::parse;

/// Size of a footer record and the magic after it, bytes.
const ENDING: u64 = RECORD_HEAD + 20 + 8;

/// Reads the summary of a file of this size; `None` if it has none. Unlike the library's reader, this one checks the lengths that
/// a damaged record states.
///
/// # Errors
/// Fails if the summary cannot be read.
pub(super) fn summary(file: &mut (impl Read + Seek), bytes: u64) -> McapResult<Option<Summary>> {
    let Some(at) = bytes.checked_sub(ENDING) else { return Ok(None) };
    let mut ending = [0; ENDING as usize];
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut ending)?;
    if ending[0] != op::FOOTER || ending[29..] != *MAGIC {
        return Ok(None);
    }
    let Record::Footer(footer) = parse(op::FOOTER, &ending[9..29])? else { return Ok(None) };
    if footer.summary_start == 0 || footer.summary_start > at {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(footer.summary_start))?;
    read(&mut file.take(at - footer.summary_start)).map(Some)
}

fn read(bytes: &mut impl Read) -> McapResult<Summary> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_emit_chunks(true)
        .with_record_length_limit(RECORD_LIMIT);
    let mut reader = LinearReader::new_with_options(options);
    let mut summary = Summary::default();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(size) => {
                let read = bytes.read(reader.insert(size))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => take(&mut summary, parse(opcode, data)?),
        }
    }
    Ok(summary)
}

fn take(summary: &mut Summary, record: Record<'_>) {
    match record {
        Record::Schema { header: records::SchemaHeader { id, name, encoding }, data } => {
            let data = data.into_owned().into();
            summary.schemas.insert(id, Arc::new(Schema { id, name, encoding, data }));
        }
        Record::Channel(records::Channel { id, schema_id, topic, message_encoding, metadata }) => {
            let schema = summary.schemas.get(&schema_id).cloned();
            summary.channels.insert(id, Arc::new(Channel { id, topic, schema, message_encoding, metadata }));
        }
        Record::Statistics(statistics) => summary.stats = Some(statistics),
        Record::ChunkIndex(index) => summary.chunk_indexes.push(index),
        Record::AttachmentIndex(index) => summary.attachment_indexes.push(index),
        Record::MetadataIndex(index) => summary.metadata_indexes.push(index),
        _ => {}
    }
}
