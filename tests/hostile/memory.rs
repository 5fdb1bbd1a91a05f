//! Files that would take memory without bound: each command answers within a limit of it.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

use flexcrank::wire;
use mcap::records::MessageHeader;

use crate::common::Outcome;
use crate::{flexcrank, sample};

/// Memory that reading any of these files may take, KiB of address space.
const LIMIT_KIB: u64 = 1_200_000;

type Writer = mcap::Writer<File>;
/// Writes the contents of a file.
type Fill = fn(&mut Writer) -> Outcome;

fn header(channel_id: u16, sequence: u32, log_time: u64) -> MessageHeader {
    MessageHeader { channel_id, sequence, log_time, publish_time: log_time }
}

/// Schemas are repeated in the index unless they would make the file large.
fn writer(path: &Path, repeats: bool, sums: bool) -> Outcome<Writer> {
    let options = mcap::WriteOptions::new().compression(Some(mcap::Compression::Zstd)).repeat_schemas(repeats);
    Ok(options.chunk_size(None).calculate_chunk_crcs(sums).create(File::create(path)?)?)
}

/// Sixteen schemas of 48 MB, each in a chunk of a few kilobytes.
fn schemas(writer: &mut Writer) -> Outcome {
    let zeros = vec![0; 48_000_000];
    for number in 0..16_u32 {
        let mut zeros = zeros.clone();
        zeros[..4].copy_from_slice(&number.to_le_bytes());
        let schema = writer.add_schema(&format!("s{number}"), "protobuf", &zeros)?;
        let channel = writer.add_channel(schema, &format!("t{number}"), "protobuf", &BTreeMap::new())?;
        writer.write_to_known_channel(&header(channel, 0, u64::from(number)), b"")?;
        writer.flush()?;
    }
    Ok(())
}

/// Twenty chunks of 48 MB that all begin and end at the same times.
fn overlapping(writer: &mut Writer) -> Outcome {
    let schema = writer.add_schema("flexcrank.v1.Angles", "protobuf", wire::EVERY_DESCRIPTOR_SET)?;
    let channel = writer.add_channel(schema, "t", "protobuf", &BTreeMap::new())?;
    for number in 0..20 {
        for (sequence, data, log_time) in [(0, &vec![0; 48_000_000], 1_000), (1, &Vec::new(), 0)] {
            writer.write_to_known_channel(&header(channel, 2 * number + sequence, log_time), data)?;
        }
        writer.flush()?;
    }
    Ok(())
}

/// A thousand topics of one schema.
fn topics(writer: &mut Writer) -> Outcome {
    let schema = writer.add_schema("flexcrank.v1.Angles", "protobuf", wire::EVERY_DESCRIPTOR_SET)?;
    for number in 0..1_000 {
        let channel = writer.add_channel(schema, &format!("t{number}"), "protobuf", &BTreeMap::new())?;
        writer.write_to_known_channel(&header(channel, 0, number), b"")?;
    }
    Ok(())
}

/// Thirty messages of 48 MB in one chunk. Without a checksum, the library reads it piece by piece, whatever its size.
fn one_chunk(writer: &mut Writer) -> Outcome {
    let schema = writer.add_schema("flexcrank.v1.Angles", "protobuf", wire::EVERY_DESCRIPTOR_SET)?;
    let channel = writer.add_channel(schema, "t", "protobuf", &BTreeMap::new())?;
    for number in 0..30 {
        writer.write_to_known_channel(&header(channel, number, number.into()), &vec![0; 48_000_000])?;
    }
    Ok(())
}

/// A million messages without a byte, in one chunk.
fn empty_messages(writer: &mut Writer) -> Outcome {
    let schema = writer.add_schema("flexcrank.v1.Angles", "protobuf", wire::EVERY_DESCRIPTOR_SET)?;
    let channel = writer.add_channel(schema, "t", "protobuf", &BTreeMap::new())?;
    for number in 0..1_000_000 {
        writer.write_to_known_channel(&header(channel, number, number.into()), b"")?;
    }
    Ok(())
}

#[test]
fn regress_no_file_takes_memory_without_bound() -> Outcome {
    let folder = tempfile::tempdir()?;
    let files: [(&str, Fill, u64); 5] = [
        ("schemas.mcap", schemas, LIMIT_KIB),
        ("overlapping.mcap", overlapping, LIMIT_KIB),
        ("topics.mcap", topics, LIMIT_KIB / 3),
        ("empty.mcap", empty_messages, LIMIT_KIB),
        ("unchecked.mcap", one_chunk, LIMIT_KIB),
    ];
    for (name, fill, limit_kib) in files {
        let mut writer = writer(&folder.path().join(name), name != "schemas.mcap", name != "unchecked.mcap")?;
        fill(&mut writer)?;
        writer.finish()?;
        let all: [&[&str]; 8] = [
            &["verify", name],
            &["recover", name, "-o", "whole.mcap"],
            &["export", name, "--csv", "tables"],
            &["info", name],
            &["plot", name, "-o", "plots"],
            &["run", "--no-bus", "--resume", name],
            &["replay", name, "--listen", "tcp/127.0.0.1:0"],
            &["what-if", name, "--set", "slider.mass_kg=1", "--record", "changed.mcap"],
        ];
        for words in all {
            // A session on the bus has threads, each with address space of its own.
            let limit_kib = if words[0] == "replay" { LIMIT_KIB } else { limit_kib };
            let script = format!("ulimit -v {limit_kib}; exec timeout 120 \"$0\" \"$@\"");
            let mut command = Command::new("sh");
            command.args(["-c", &script, env!("CARGO_BIN_EXE_flexcrank")]).args(words).current_dir(folder.path());
            let output = command.stdin(Stdio::null()).output()?;
            let said = String::from_utf8_lossy(&output.stderr);
            // Out of memory, a process aborts.
            assert!(matches!(output.status.code(), Some(0..=3)), "{words:?}: {:?} {said}", output.status);
            if let ("overlapping.mcap", "export" | "plot") = (name, words[0]) {
                assert!(said.contains("so many chunks overlap in time"), "{words:?}: {said}");
            }
            let _ = std::fs::remove_file(folder.path().join("whole.mcap"));
        }
    }
    Ok(())
}

/// A sample with twenty thousand empty messages behind its last one.
fn emptied(path: &Path) -> Outcome {
    let bytes = std::fs::read(sample("sample-three-pulses.mcap"))?;
    let summary = mcap::Summary::read(&bytes)?.ok_or("no summary")?;
    let mut writer = writer(path, true, true)?;
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(&bytes, index)?)?;
    }
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(&bytes, index)?)?;
    }
    let mut angles = None;
    for message in mcap::MessageStream::new(&bytes)? {
        let message = message?;
        if message.channel.topic.ends_with("/angles") {
            angles = Some(message.clone());
        }
        writer.write(&message)?;
    }
    let mut angles = angles.ok_or("no angles")?;
    angles.data = Vec::new().into();
    for _ in 0..20_000 {
        angles.sequence += 1;
        writer.write(&angles)?;
    }
    writer.finish()?;
    Ok(())
}

#[test]
fn regress_findings_are_counted_beyond_those_that_are_kept() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("emptied.mcap");
    emptied(&file)?;
    let output = flexcrank(&["verify", "--json"]).arg(&file).output()?;
    let found: serde_json::Value = serde_json::from_slice(&output.stdout)?;
    let (kept, further) = (found["findings"].as_array().map(Vec::len), found["unlisted_findings"].as_u64());
    assert_eq!(output.status.code(), Some(1));
    assert!(
        kept.is_some_and(|kept| (10_000..10_100).contains(&kept)) && further.is_some_and(|more| more >= 9_990),
        "{kept:?}, {further:?}"
    );
    Ok(())
}
