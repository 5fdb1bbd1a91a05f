//! A damaged index leads nobody astray.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use flexcrank::recording::{RecordingError, RecordingFile};
use mcap::records::MessageHeader;

use crate::common::Outcome;

#[test]
fn regress_a_changed_byte_of_the_index_changes_no_message() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("take.mcap");
    let mut writer = mcap::WriteOptions::new().chunk_size(None).create(std::fs::File::create(&file)?)?;
    let channel_id = writer.add_channel(0, "t", "json", &BTreeMap::new())?;
    for sequence in 0..6 {
        let log_time = 1_000 * u64::from(sequence);
        writer.write_to_known_channel(&MessageHeader { channel_id, sequence, log_time, publish_time: 0 }, &[b'0'; 5])?;
        writer.flush()?;
    }
    writer.finish()?;
    let times = || -> Result<Vec<u64>, RecordingError> {
        RecordingFile::open(&file)?.messages_from(0)?.map(|message| Ok(message?.log_time)).collect()
    };
    let (whole, expected) = (std::fs::read(&file)?, times()?);
    let summary = mcap::read::footer(&whole)?.summary_start as usize;
    for byte in summary..whole.len() {
        let mut changed = whole.clone();
        changed[byte] ^= 1;
        std::fs::write(&file, &changed)?;
        match times() {
            Ok(times) => assert_eq!(times, expected, "byte {byte}"),
            Err(error) => assert!(byte + 40 > whole.len(), "byte {byte}: {error}"),
        }
    }
    Ok(())
}

/// A recording of six chunks, the third of which states other log times, and so does its index; all sums are right.
fn with_wrong_times(folder: &Path, name: &str, of_chunk: usize, times: [u64; 2]) -> Outcome<PathBuf> {
    let mut writer = mcap::WriteOptions::new().chunk_size(None).compression(None).calculate_chunk_crcs(true);
    writer = writer.calculate_data_section_crc(false).calculate_summary_section_crc(false);
    let file = folder.join(name);
    let mut writer = writer.create(std::fs::File::create(&file)?)?;
    let channel_id = writer.add_channel(0, "t", "json", &BTreeMap::new())?;
    for sequence in 0..6 {
        let log_time = 1_000 * u64::from(sequence + 1);
        writer.write_to_known_channel(&MessageHeader { channel_id, sequence, log_time, publish_time: 0 }, &[b'0'; 5])?;
        writer.flush()?;
    }
    writer.finish()?;
    let mut bytes = std::fs::read(&file)?;
    let own = (1_000 * (of_chunk as u64 + 1)).to_le_bytes();
    let own = [own, own].concat();
    // In the chunk's head, and in its index.
    let places: Vec<usize> = (0..bytes.len() - 16).filter(|at| bytes[*at..at + 16] == own).collect();
    assert_eq!(places.len(), 2);
    for at in places {
        bytes[at..at + 16].copy_from_slice(&times.map(u64::to_le_bytes).concat());
    }
    std::fs::write(&file, &bytes)?;
    Ok(file)
}

/// By wrong times of a chunk, messages were left out of what was asked for, without a word.
#[test]
fn regress_wrong_times_of_a_chunk_leave_out_no_message_without_a_word() -> Outcome {
    let folder = tempfile::tempdir()?;
    let read = |file: &Path, from_ns: u64| -> Result<Vec<u64>, RecordingError> {
        RecordingFile::open(file)?.messages_from(from_ns)?.map(|message| Ok(message?.log_time)).collect()
    };
    let all: Vec<u64> = (1..=6).map(|n| 1_000 * n).collect();
    // Beyond the whole: the index contradicts the statistics, and is not used.
    for (name, of_chunk, times) in [("early.mcap", 0, [1, 1]), ("late.mcap", 5, [6_000, u64::MAX])] {
        let file = with_wrong_times(folder.path(), name, of_chunk, times)?;
        assert_eq!(read(&file, 0)?, all, "{name}");
    }
    let file = with_wrong_times(folder.path(), "within.mcap", 2, [3_000, 5_000])?;
    let said = read(&file, 3_000).err().ok_or("nothing is said")?.to_string();
    assert!(said.contains("states other times of the chunk at byte") && said.contains("`flexcrank recover`"), "{said}");
    Ok(())
}
