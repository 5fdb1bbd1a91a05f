//! Bits of the index, the statistics and the heads of chunks altered, all checksums right: `verify` finds each.

use std::ops::Range;

use flexcrank::recording::{WalkFlow, walk};
use mcap::MAGIC;
use mcap::records::op;

use crate::common::Outcome;
use crate::eventful;

/// Bytes before the body of a record: its kind and its length.
const HEAD: usize = 9;
/// Where the checksum stands in the head of a chunk.
const CHUNK_SUM: Range<usize> = 24..28;
/// Where it stands in a footer.
const FOOTER_SUM: Range<usize> = 16..20;

/// Records that state where others are, or what they hold.
const INDEXES: [u8; 8] = [
    op::MESSAGE_INDEX,
    op::CHUNK_INDEX,
    op::ATTACHMENT_INDEX,
    op::METADATA_INDEX,
    op::STATISTICS,
    op::SUMMARY_OFFSET,
    op::FOOTER,
    op::CHANNEL,
];

/// Kind and body of each record.
fn records(bytes: &[u8]) -> Outcome<Vec<(u8, Range<usize>)>> {
    let (mut found, mut at) = (Vec::new(), MAGIC.len());
    while at < bytes.len() - MAGIC.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + HEAD].try_into()?) as usize;
        found.push((bytes[at], at + HEAD..at + HEAD + length));
        at += HEAD + length;
    }
    Ok(found)
}

/// Makes the checksums of the data and of the summary right.
fn sum_up(bytes: &mut [u8], records: &[(u8, Range<usize>)]) -> Outcome {
    let body = |kind: u8| records.iter().find(|record| record.0 == kind).map(|record| record.1.clone()).ok_or("not there");
    let (end, footer) = (body(op::DATA_END)?, body(op::FOOTER)?);
    let of_data = crc32fast::hash(&bytes[..end.start - HEAD]).to_le_bytes();
    bytes[end.clone()].copy_from_slice(&of_data);
    let at = footer.start + FOOTER_SUM.start;
    let of_summary = crc32fast::hash(&bytes[end.end..at]).to_le_bytes();
    bytes[at..footer.end].copy_from_slice(&of_summary);
    Ok(())
}

/// The bytes that are altered, of the first and the last record of a kind. The content of a chunk has a checksum of its own.
fn altered(bytes: &[u8], records: &[(u8, Range<usize>)]) -> Vec<usize> {
    let data_end = records.iter().position(|record| record.0 == op::DATA_END).unwrap_or_default();
    let of_kind = |kind: u8| {
        // Topics are repeated behind the data.
        let behind = if kind == op::CHANNEL { data_end } else { 0 };
        let all: Vec<&Range<usize>> =
            records[behind..].iter().filter(|record| record.0 == kind).map(|record| &record.1).collect();
        let ends = [all.first(), all.last()];
        ends.into_iter().flatten().flat_map(|body| (*body).clone()).collect::<Vec<usize>>()
    };
    let heads = records.iter().filter(|record| record.0 == op::CHUNK).map(|record| record.1.start);
    let of_chunks = heads.take(2).flat_map(|start| (start..start + CHUNK_SUM.start).chain(start + CHUNK_SUM.end..start + 32));
    let footer_sum = bytes.len() - MAGIC.len() - FOOTER_SUM.len();
    INDEXES.into_iter().flat_map(of_kind).chain(of_chunks).filter(|byte| *byte < footer_sum).collect()
}

#[test]
fn prop_a_changed_bit_of_the_index_is_found_though_all_sums_are_right() -> Outcome {
    let (folder, file) = eventful()?;
    let path = folder.path().join("forged.mcap");
    let whole = std::fs::read(&file)?;
    let records = records(&whole)?;
    let mut again = whole.clone();
    sum_up(&mut again, &records)?;
    assert!(again == whole, "the sums are those of the file");
    let (mut count, mut missed) = (0, Vec::new());
    for (byte, bit) in altered(&whole, &records).into_iter().flat_map(|byte| (0..8).map(move |bit| (byte, bit))) {
        let mut forged = whole.clone();
        forged[byte] ^= 1 << bit;
        sum_up(&mut forged, &records)?;
        std::fs::write(&path, &forged)?;
        let found = walk(&path, |_, _| WalkFlow::Continue(()))?;
        count += 1;
        if found.damage.is_empty() && found.cut_off.is_none() {
            let (kind, body) = records.iter().find(|record| record.1.contains(&byte)).ok_or("in no record")?;
            missed.push(format!("record of kind {kind}: byte {} of {}, bit {bit}", byte - body.start, body.len()));
        }
    }
    assert!(missed.is_empty(), "{} of {count}: {missed:#?}", missed.len());
    assert!(count > 8000, "{count}");
    Ok(())
}
