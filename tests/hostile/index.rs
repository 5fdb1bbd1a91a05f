//! A damaged index leads nobody astray.

use std::collections::BTreeMap;

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
