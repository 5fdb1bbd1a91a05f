//! The summary at the end of a file: topics, statistics and chunk index.

use std::io::{Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::records::{Record, op};
use mcap::sans_io::LinearReaderOptions;

use super::format::RECORD_HEAD;
use super::parse::parse;
use super::records::Records;

/// Size of a read for the checksum, bytes.
const BLOCK: usize = 16 * 1024;
/// Size of a footer record and the magic after it, bytes.
const ENDING: usize = RECORD_HEAD + 20 + 8;

/// The part of the footer that the checksum of the summary covers: all before the checksum itself, bytes.
const CHECKED_ENDING: u64 = RECORD_HEAD as u64 + 16;

/// The checksum of a part of a file.
fn checksum(file: &mut (impl Read + Seek), from: u64, size: u64) -> std::io::Result<u32> {
    file.seek(SeekFrom::Start(from))?;
    let (mut hasher, mut block, mut rest) = (crc32fast::Hasher::new(), [0; BLOCK], size as usize);
    while rest > 0 {
        let read = rest.min(BLOCK);
        file.read_exact(&mut block[..read])?;
        hasher.update(&block[..read]);
        rest -= read;
    }
    Ok(hasher.finalize())
}

/// Reads schemas, channels, statistics and chunk indexes from the summary of a file; `None` if it has none, or a damaged one.
pub(super) fn summary(file: &mut (impl Read + Seek)) -> Option<Vec<Record<'static>>> {
    let mut ending = [0; ENDING];
    let at = file.seek(SeekFrom::End(-(ENDING as i64))).ok()?;
    file.read_exact(&mut ending).ok()?;
    let Ok(Record::Footer(footer)) = parse(op::FOOTER, &ending[RECORD_HEAD..]) else { return None };
    if ending[0] != op::FOOTER || !ending.ends_with(MAGIC) || footer.summary_start == 0 {
        return None;
    }
    let size = at.checked_sub(footer.summary_start)?;
    if footer.summary_crc != 0 && checksum(file, footer.summary_start, size + CHECKED_ENDING).ok()? != footer.summary_crc {
        return None;
    }
    file.seek(SeekFrom::Start(footer.summary_start)).ok()?;
    let options = LinearReaderOptions::default().with_skip_start_magic(true).with_skip_end_magic(true);
    let mut summary = Vec::new();
    let read = Records::of(file.take(size), options).find(|record| {
        match record.opcode {
            op::SCHEMA | op::CHANNEL | op::CHUNK_INDEX => summary.push(record.parse()?.into_owned()),
            // Statistics only help.
            op::STATISTICS => summary.extend(record.parse().ok().map(Record::into_owned)),
            _ => {}
        }
        Ok(None::<()>)
    });
    read.is_ok().then_some(summary)
}
