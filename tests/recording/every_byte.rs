//! Small recordings cut off after every byte, and with a bit of every byte changed: all readers agree on what is left.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use flexcrank::recording::{Messages, Overview, RecordedMessage, RecordingError, RecordingFile, Structure, WalkFlow, WalkItem};
use flexcrank::recording::{is_cut_off, recover, walk};

use crate::common::Outcome;

/// Name of the record that states the end.
const END: &str = "flexcrank-end";

/// A recording of twelve messages in three chunks, with all checksums, and its end.
fn small(compression: Option<mcap::Compression>) -> Outcome<Vec<u8>> {
    written(mcap::WriteOptions::new().compression(compression))
}

fn written(options: mcap::WriteOptions) -> Outcome<Vec<u8>> {
    let options = options.chunk_size(None).library("flexcrank test");
    let mut writer = options.create(std::io::Cursor::new(Vec::new()))?;
    let metadata = BTreeMap::from([("name".to_owned(), "crank".to_owned())]);
    writer.write_metadata(&mcap::records::Metadata { name: "flexcrank".to_owned(), metadata })?;
    let schema = writer.add_schema("Angles", "protobuf", b"a schema")?;
    let channel_id = writer.add_channel(schema, "angles", "protobuf", &BTreeMap::new())?;
    for n in 0..12_u32 {
        let (log_time, publish_time) = (u64::from(n) * 1000, 7);
        let header = mcap::records::MessageHeader { channel_id, sequence: n, log_time, publish_time };
        writer.write_to_known_channel(&header, format!("message {n}{}", "-".repeat(n as usize)).as_bytes())?;
        if n % 4 == 3 {
            writer.flush()?;
        }
    }
    writer.write_metadata(&mcap::records::Metadata { name: END.to_owned(), metadata: BTreeMap::new() })?;
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

fn plain_and_compressed() -> Outcome<Vec<Vec<u8>>> {
    [None, Some(mcap::Compression::Lz4)].into_iter().map(small).collect()
}

/// The messages that every reader reads, by log time and content: topics come from the index, whose checksum replay does not check.
struct Readings {
    messages: Vec<(u64, Vec<u8>)>,
    /// Whether these end with an error other than that of a file that is cut off.
    is_damaged: bool,
    replayed: Vec<(u64, Vec<u8>)>,
    walked: Vec<(u64, Vec<u8>)>,
    structure: Structure,
    recovered: Vec<(u64, Vec<u8>)>,
    /// Number of messages that the overview lists.
    listed: u64,
}

fn content(message: &RecordedMessage) -> (u64, Vec<u8>) {
    (message.log_time, message.data.to_vec())
}

fn intact(messages: impl IntoIterator<Item = Result<RecordedMessage, RecordingError>>) -> Vec<(u64, Vec<u8>)> {
    messages.into_iter().map_while(Result::ok).map(|message| content(&message)).collect()
}

fn read(bytes: &[u8], folder: &Path) -> Outcome<Readings> {
    let [file, whole]: [PathBuf; 2] = ["broken.mcap", "whole.mcap"].map(|name| folder.join(name));
    std::fs::write(&file, bytes)?;
    let mut walked = Vec::new();
    let structure = walk(&file, |item, _| {
        if let WalkItem::Message(message) = item {
            walked.push(content(message));
        }
        WalkFlow::Continue(())
    })?;
    let replayed = RecordingFile::open(&file).and_then(|recording| recording.messages_from(0)).map_or(Vec::new(), intact);
    let recovered = match recover(&file, &whole, |_, _| {}) {
        Err(RecordingError::Empty { .. } | RecordingError::NotMcap(_)) => Vec::new(),
        recovered => {
            recovered?;
            let messages = Messages::open(&whole)?.collect::<Result<Vec<_>, _>>()?;
            std::fs::remove_file(&whole)?;
            messages.iter().map(content).collect()
        }
    };
    let listed = Overview::read(&file).map_or(0, |overview| overview.messages());
    let is_damaged = Messages::open(&file)?.any(|message| message.is_err_and(|error| !is_cut_off(&error)));
    Ok(Readings { messages: intact(Messages::open(&file)?), is_damaged, replayed, walked, structure, recovered, listed })
}

#[test]
fn prop_after_a_cut_at_any_byte_all_readers_read_the_messages_before_it() -> Outcome {
    let folder = tempfile::tempdir()?;
    for whole in plain_and_compressed()? {
        let all = read(&whole, folder.path())?.messages;
        assert_eq!(all.len(), 12);
        let mut before = 0;
        for cut in 0..whole.len() {
            let read = read(&whole[..cut], folder.path())?;
            assert!(read.messages[..] == all[..read.messages.len()] && !read.is_damaged, "cut at {cut}");
            assert!(read.messages.len() >= before, "cut at {cut}: {} messages, {before} before", read.messages.len());
            assert!(read.replayed == read.messages && read.recovered == read.messages, "cut at {cut}");
            assert_eq!(read.listed, read.messages.len() as u64, "cut at {cut}");
            // A chunk is walked through only if its checksum is there.
            assert!(all.starts_with(&read.walked) && read.messages.len() - read.walked.len() <= 4, "cut at {cut}");
            assert!(read.structure.cut_off.is_some() && read.structure.damage.is_empty(), "{cut}: {:?}", read.structure);
            before = read.messages.len();
        }
        assert_eq!(before, 12);
    }
    Ok(())
}

/// The record before the one in which the file ended was taken for damage.
#[test]
fn regress_a_file_that_is_cut_off_behind_its_stated_end_lost_nothing() -> Outcome {
    let folder = tempfile::tempdir()?;
    let [file, recovered] = ["broken.mcap", "whole.mcap"].map(|name| folder.path().join(name));
    for whole in plain_and_compressed()? {
        let end = whole.windows(END.len()).position(|bytes| bytes == END.as_bytes()).ok_or("no end")? + END.len() + 4;
        for cut in end - END.len()..whole.len() {
            std::fs::write(&file, &whole[..cut])?;
            let lost = recover(&file, &recovered, |_, _| {})?.loss;
            std::fs::remove_file(&recovered)?;
            let is_early = Messages::open(&file)?.any(|message| message.is_err());
            assert_eq!((lost.cut_off, is_early), (cut < end, cut < end), "{cut} of {}, stated at {end}", whole.len());
            assert_eq!(lost.places, 0, "{cut}");
        }
    }
    Ok(())
}

/// As other programs may write them: each message is a record of its own.
#[test]
fn regress_the_last_whole_message_of_a_file_without_chunks_is_recovered() -> Outcome {
    let folder = tempfile::tempdir()?;
    let whole = written(mcap::WriteOptions::new().use_chunks(false))?;
    for cut in 0..whole.len() {
        let read = read(&whole[..cut], folder.path())?;
        assert!(read.recovered == read.messages, "cut at {cut}: {} of {}", read.recovered.len(), read.messages.len());
    }
    Ok(())
}

/// Where the first chunk ends, which holds the definitions of all messages.
fn end_of_definitions(bytes: &[u8]) -> Outcome<usize> {
    let mut at = mcap::MAGIC.len();
    loop {
        let length = u64::from_le_bytes(bytes.get(at + 1..at + 9).ok_or("no chunk")?.try_into()?);
        let is_chunk = bytes[at] == mcap::records::op::CHUNK;
        at += 9 + usize::try_from(length)?;
        if is_chunk {
            return Ok(at);
        }
    }
}

/// It was called damaged, too: its channel was defined in the damaged one, and again in the summary.
#[test]
fn regress_a_chunk_behind_the_damaged_one_that_defined_its_channel_is_read() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut writer = mcap::WriteOptions::new().compression(None).chunk_size(None).create(std::io::Cursor::new(Vec::new()))?;
    let mut channel_ids = Vec::new();
    for chunk in 0..3_u32 {
        if chunk < 2 {
            let schema = writer.add_schema(&format!("Kind{chunk}"), "protobuf", b"a schema")?;
            channel_ids.push(writer.add_channel(schema, &format!("topic-{chunk}"), "protobuf", &BTreeMap::new())?);
        }
        for &channel_id in &channel_ids {
            let header =
                mcap::records::MessageHeader { channel_id, sequence: chunk, log_time: u64::from(chunk), publish_time: 7 };
            writer.write_to_known_channel(&header, format!("of chunk {chunk}").as_bytes())?;
        }
        writer.flush()?;
    }
    writer.finish()?;
    let mut bytes = writer.into_inner().into_inner();
    assert_eq!(read(&bytes, folder.path())?.walked.len(), 5);
    let damaged = bytes.windows(10).position(|window| window == b"of chunk 1").ok_or("no such message")?;
    bytes[damaged] ^= 1;
    let read = read(&bytes, folder.path())?;
    assert_eq!((read.walked.len(), read.structure.damage.len()), (3, 1), "{:?}", read.structure);
    assert_eq!(read.walked, read.recovered);
    Ok(())
}

/// Of files that were closed, and that end before their index does: only the index has the definitions a second time.
#[test]
fn prop_a_changed_bit_in_any_byte_is_found_and_no_wrong_message_is_read() -> Outcome {
    let folder = tempfile::tempdir()?;
    let whole = plain_and_compressed()?;
    let cut = whole.iter().map(|bytes| bytes[..bytes.len() - 5].to_vec());
    for (mut bytes, is_cut) in whole.iter().map(|bytes| (bytes.clone(), false)).chain(cut.map(|bytes| (bytes, true))) {
        let definitions = if is_cut { end_of_definitions(&bytes)? } else { 0 };
        let all = read(&bytes, folder.path())?.messages;
        for at in 0..bytes.len() {
            for mask in BTreeSet::from([1 << (at % 8), 0x80]) {
                bytes[at] ^= mask;
                let read = read(&bytes, folder.path())?;
                bytes[at] ^= mask;
                let case = format!("byte {at} of {} ^ {mask:#x}: {:?}", bytes.len(), read.structure);
                assert!(read.structure.cut_off.is_some() || !read.structure.damage.is_empty(), "{case}");
                for messages in [&read.messages, &read.walked, &read.recovered] {
                    assert!(messages.iter().all(|message| all.contains(message)) && messages.is_sorted(), "{case}");
                }
                // The order of replay comes from the index.
                assert!(read.replayed.iter().all(|message| all.contains(message)), "{case}");
                assert!(read.recovered.len() >= 8 || at < definitions, "more than one chunk is lost: {case}");
            }
        }
    }
    Ok(())
}
