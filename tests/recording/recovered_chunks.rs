//! Recovery of chunks: of the largest ones, and beside one that was taken out.

use std::collections::BTreeMap;
use std::path::Path;

use flexcrank::recording::{Messages, RecordingError, Recovered, recover};
use mcap::records::MessageHeader;

use crate::common::Outcome;
use crate::recovered::{chunks, messages, recording, repaired};

const MIB: usize = 1024 * 1024;

/// Length of a message record beside its data, bytes.
const MESSAGE: usize = 31;

/// Writes messages with these options, recovers them, and returns the lengths of those that the new file has.
fn saved(folder: &Path, name: &str, options: mcap::WriteOptions, contents: &[Vec<u8>]) -> Outcome<(Recovered, Vec<usize>)> {
    let [file, whole] = ["broken", "whole"].map(|kind| folder.join(format!("{kind}-{name}.mcap")));
    let mut writer = options.create(std::fs::File::create(&file)?)?;
    let channel_id = writer.add_channel(0, "t", "json", &BTreeMap::new())?;
    for (sequence, data) in (0..).zip(contents) {
        writer.write_to_known_channel(&MessageHeader { channel_id, sequence, log_time: 0, publish_time: 0 }, data)?;
    }
    writer.finish()?;
    let recovered = recover(&file, &whole, |_, _| {})?;
    let lengths = Messages::open(&whole)?.map(|message| Ok(message?.data.len())).collect::<Result<_, RecordingError>>()?;
    Ok((recovered, lengths))
}

/// Numbers that no compression shortens.
fn noise(length: usize) -> Vec<u8> {
    let mut random = 17_u64;
    let next = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 56) as u8
    };
    std::iter::repeat_with(next).take(length).collect()
}

/// The new file held both messages in one chunk that was larger than readers take: nothing was lost, and nothing could be read.
#[test]
fn regress_the_new_file_holds_what_is_said_to_be_saved() -> Outcome {
    let folder = tempfile::tempdir()?;
    let [small, large] = [1000, 64 * MIB - MESSAGE];
    for (name, contents) in [
        ("zeros", vec![vec![0; small], vec![0; large], vec![0; small]]),
        ("noise", vec![noise(small), noise(large)]),
        ("many", vec![vec![0; 16 * MIB]; 6]),
    ] {
        let chunks = mcap::WriteOptions::new().chunk_size(Some(1));
        let (recovered, lengths) = saved(folder.path(), name, chunks, &contents)?;
        assert!(recovered.loss.is_none(), "{name}: {recovered:?}");
        assert_eq!(lengths, contents.iter().map(Vec::len).collect::<Vec<_>>(), "{name}");
    }
    Ok(())
}

/// One that is too long for a chunk, in one without a checksum, which is read nevertheless; the message behind it is saved.
#[test]
fn regress_a_message_too_long_for_a_chunk_is_lost_and_said() -> Outcome {
    let folder = tempfile::tempdir()?;
    let unchecked = || mcap::WriteOptions::new().chunk_size(None).calculate_chunk_crcs(false);
    let long = vec![0; 64 * MIB - MESSAGE + 1];
    let (recovered, lengths) = saved(folder.path(), "longest", unchecked(), &[long.clone(), vec![0; 1000]])?;
    assert_eq!((recovered.messages, lengths), (1, vec![1000]));
    assert!(recovered.loss.too_long == 1 && recovered.loss.messages.get("t") == Some(&1), "{recovered:?}");
    let alone = saved(folder.path(), "alone", unchecked(), &[long]).err().ok_or("saved")?.to_string();
    assert!(alone.ends_with("each message is longer than the 64 MiB of a chunk: nothing can be saved"), "{alone}");
    Ok(())
}

/// Its messages were counted, and the time without any was 0.
#[test]
fn regress_the_time_of_a_chunk_that_was_taken_out_is_lost() -> Outcome {
    let (folder, bytes) = recording(3.0)?;
    let all = messages(&folder.path().join("run.mcap"))?;
    let chunks = chunks(&bytes)?;
    for n in [1, chunks.len() / 2] {
        let (recovered, whole) = repaired(folder.path(), &[&bytes[..chunks[n].start], &bytes[chunks[n].end..]].concat())?;
        let kept = messages(&whole)?;
        let lost: u64 = recovered.loss.messages.values().sum();
        assert_eq!((recovered.loss.places, lost), (0, (all.len() - kept.len()) as u64), "{recovered:?}");
        let missing = || all.iter().filter(|message| !kept.contains(message)).map(|message| message.2);
        let (first, last) = missing().min().zip(missing().max()).ok_or("nothing is missing")?;
        let times = || kept.iter().map(|message| message.2);
        let before = times().filter(|time| *time <= first).max().ok_or("nothing before")?;
        let after = times().filter(|time| *time >= last).min().ok_or("nothing after")?;
        assert!((recovered.loss.seconds - (after - before) as f64 * 1e-9).abs() < 1e-9, "{recovered:?}: {before} to {after}");
    }
    Ok(())
}
