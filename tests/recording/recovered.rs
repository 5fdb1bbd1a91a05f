//! Recovery: the reported losses are the missing messages.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use flexcrank::recording::{Messages, RecordedMessage, RecordingError, Recovered, recover};
use flexcrank::resimulation::{Finding, RecordedSession, Verification, verify};
use flexcrank::runtime::Pace;
use flexcrank::simulation::PublishRate;

use crate::common::rewritten::{Contents, as_is, rewritten};
use crate::common::{Outcome, Service, scene};

/// A recording of `seconds` in a folder, and its bytes.
pub fn recording(seconds: f64) -> Outcome<(tempfile::TempDir, Vec<u8>)> {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(seconds), PublishRate::All)?.finish()?;
    let bytes = std::fs::read(folder.path().join("run.mcap"))?;
    Ok((folder, bytes))
}

/// Every message: topic, number, times, bytes.
type Known = (String, u32, u64, u64, Vec<u8>);

fn known(message: RecordedMessage) -> Known {
    (message.channel.topic.clone(), message.sequence, message.log_time, message.publish_time, message.data.to_vec())
}

pub fn messages(file: &Path) -> Result<Vec<Known>, RecordingError> {
    Messages::open(file)?.map(|message| message.map(known)).collect()
}

pub fn repaired(folder: &Path, bytes: &[u8]) -> Outcome<(Recovered, PathBuf)> {
    let (broken, whole) = (folder.join("broken.mcap"), folder.join("whole.mcap"));
    std::fs::write(&broken, bytes)?;
    if whole.exists() {
        std::fs::remove_file(&whole)?;
    }
    Ok((recover(&broken, &whole, |_, _| {})?, whole))
}

/// Positions of the chunks.
pub fn chunks(bytes: &[u8]) -> Outcome<Vec<std::ops::Range<usize>>> {
    let summary = mcap::Summary::read(bytes)?.ok_or("no summary")?;
    let range = |chunk: &mcap::records::ChunkIndex| {
        chunk.chunk_start_offset as usize..(chunk.chunk_start_offset + chunk.chunk_length) as usize
    };
    Ok(summary.chunk_indexes.iter().map(range).collect())
}

#[test]
fn prop_recovering_a_complete_recording_changes_nothing() -> Outcome {
    let (folder, bytes) = recording(3.0)?;
    let (recovered, whole) = repaired(folder.path(), &bytes)?;
    assert!(recovered.loss.is_none(), "{recovered:?}");
    assert_eq!(messages(&whole)?, messages(&folder.path().join("run.mcap"))?);
    let again = std::fs::read(&whole)?;
    let summary = mcap::Summary::read(&again)?.ok_or("no summary")?;
    let attached = mcap::read::attachment(&again, &summary.attachment_indexes[0])?;
    assert_eq!(attached.data, scene(&[])?.text.as_bytes());
    assert!(summary.metadata_indexes.iter().any(|index| index.name == "flexcrank"));
    Ok(())
}

#[test]
fn prop_without_its_index_nothing_is_lost() -> Outcome {
    let (folder, bytes) = recording(1.0)?;
    let (recovered, whole) = repaired(folder.path(), &bytes[..bytes.len() - 100])?;
    assert!(recovered.loss.is_none(), "{recovered:?}");
    assert_eq!(messages(&whole)?, messages(&folder.path().join("run.mcap"))?);
    Ok(())
}

fn verified(file: &Path) -> Outcome<Verification> {
    Ok(verify(&RecordedSession::open(file)?, &|_, _| {})?)
}

/// A recording that a kill cut off before its first chunk was called wrong, with exit code 1.
#[test]
fn regress_a_file_that_ends_before_its_first_message_is_lost_and_a_closed_one_without_any_is_wrong() -> Outcome {
    let (folder, bytes) = recording(0.1)?;
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &bytes[..chunks(&bytes)?.remove(0).start])?;
    let found = verified(&cut)?;
    assert!(!found.is_wrong() && found.findings.contains(&Finding::Empty { is_closed: false }), "{:?}", found.findings);
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).arg("verify").arg(&cut).output()?;
    let said = String::from_utf8(output.stdout)?;
    let lost = "\n  lost: the recording holds no message\n  nothing to verify\n";
    assert!(output.status.code() == Some(3) && said.ends_with(lost) && !said.contains("wrong"), "{said}");
    let closed = rewritten(&folder.path().join("run.mcap"), "closed.mcap", &|_, _| None, &str::to_owned)?;
    let found = verified(&closed)?;
    assert!(found.is_wrong() && found.findings.contains(&Finding::Empty { is_closed: true }), "{:?}", found.findings);
    Ok(())
}

/// The metadata record that states the end is the last one before the index.
#[test]
fn regress_a_recovered_recording_is_whole_if_nothing_was_lost() -> Outcome {
    let (folder, bytes) = recording(1.0)?;
    let summary = mcap::Summary::read(&bytes)?.ok_or("no summary")?;
    let end = summary.metadata_indexes.iter().find(|index| index.name == "flexcrank-end").ok_or("no end")?;
    let [begins, ends] = [end.offset, end.offset + end.length].map(|at| at as usize);
    for cut in [bytes.len(), bytes.len() - 100, ends] {
        let (recovered, whole) = repaired(folder.path(), &bytes[..cut])?;
        assert!(recovered.loss.is_none(), "cut at {cut}: {recovered:?}");
        assert_eq!(verified(&whole)?.findings, [], "cut at {cut} of {}", bytes.len());
    }
    for cut in [begins, ends - 1] {
        let (recovered, whole) = repaired(folder.path(), &bytes[..cut])?;
        assert!(recovered.loss.cut_off, "cut at {cut}: {recovered:?}");
        assert_eq!(verified(&whole)?.findings, [Finding::Recovered { missing: None }], "cut at {cut}");
    }
    Ok(())
}

/// A message that is gone is lost if the stated end counts it, and was taken out if that does not.
#[test]
fn regress_a_recovered_recording_with_a_message_less_is_not_whole() -> Outcome {
    let (folder, bytes) = recording(1.0)?;
    let (_, whole) = repaired(folder.path(), &bytes)?;
    let forged = folder.path().join("forged.mcap");
    let mut less = Contents::read(&whole, &as_is)?;
    less.write(&forged)?;
    assert_eq!(verified(&forged)?.findings, [], "it is whole before");
    let status = less.messages.iter().position(|entry| entry.chunk() == "status").ok_or("no status")?;
    less.messages.remove(status);
    less.write(&forged)?;
    assert_eq!(verified(&forged)?.findings, [Finding::Recovered { missing: Some(1) }]);
    less.recount();
    less.write(&forged)?;
    let found = verified(&forged)?.findings;
    assert!(matches!(&found[..], [Finding::Sequence { topic, .. }] if topic.ends_with("/status")), "{found:?}");
    Ok(())
}

/// The readable messages of a damaged file, up to the damage.
fn readable(file: &Path) -> Outcome<Vec<Known>> {
    Ok(Messages::open(file)?.map_while(Result::ok).map(known).collect())
}

#[test]
fn prop_only_the_messages_cut_off_are_lost() -> Outcome {
    let (folder, bytes) = recording(3.0)?;
    let all = messages(&folder.path().join("run.mcap"))?;
    let cut_chunk = chunks(&bytes)?[2].clone();
    let parts = [0.3, 0.5, 0.9].map(|part| (bytes.len() as f64 * part) as usize);
    for cut in parts.into_iter().chain([cut_chunk.start + 20, cut_chunk.start + 100, cut_chunk.end - 1, cut_chunk.end]) {
        let (recovered, whole) = repaired(folder.path(), &bytes[..cut])?;
        assert!(recovered.loss.cut_off && recovered.loss.places == 0, "{recovered:?}");
        let kept = messages(&whole)?;
        assert_eq!(recovered.messages, kept.len() as u64);
        assert!(!kept.is_empty() && kept[..] == all[..kept.len()], "{} of {}", kept.len(), all.len());
        assert_eq!(kept.len(), readable(&folder.path().join("broken.mcap"))?.len(), "as many as replay and export read");
    }
    Ok(())
}

/// A recording written anew in one large chunk, compressed or not.
fn in_one_chunk(all: &[Known], compression: Option<mcap::Compression>) -> Outcome<Vec<u8>> {
    let options = mcap::WriteOptions::new().compression(compression).chunk_size(None).library("flexcrank test");
    let mut writer = options.create(std::io::Cursor::new(Vec::new()))?;
    let mut channels = std::collections::BTreeMap::new();
    for (topic, sequence, log_time, publish_time, data) in all {
        let id = match channels.get(topic) {
            Some(id) => *id,
            None => writer.add_channel(0, topic, "protobuf", &std::collections::BTreeMap::new())?,
        };
        channels.insert(topic, id);
        let (sequence, log_time, publish_time) = (*sequence, *log_time, *publish_time);
        writer
            .write_to_known_channel(&mcap::records::MessageHeader { channel_id: id, sequence, log_time, publish_time }, data)?;
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

#[test]
fn prop_readable_messages_of_a_cut_off_chunk_are_recovered() -> Outcome {
    let (folder, _) = recording(3.0)?;
    let all = messages(&folder.path().join("run.mcap"))?;
    for compression in [None, Some(mcap::Compression::Lz4), Some(mcap::Compression::Zstd)] {
        let bytes = in_one_chunk(&all, compression)?;
        let chunk = chunks(&bytes)?.remove(0);
        let mut before = 0;
        for part in [0.25, 0.5, 0.75, 0.99] {
            let cut = chunk.start + (chunk.len() as f64 * part) as usize;
            let (recovered, whole) = repaired(folder.path(), &bytes[..cut])?;
            let kept = messages(&whole)?;
            assert!(kept.len() > before && kept[..] == all[..kept.len()], "{compression:?}, {part}: {} messages", kept.len());
            assert_eq!((recovered.messages, recovered.unchecked), (kept.len() as u64, kept.len() as u64));
            assert!(recovered.loss.cut_off && recovered.loss.places == 0, "{recovered:?}");
            // Uncompressed, no message that is there in full is lost.
            let share = kept.len() as f64 / all.len() as f64;
            assert!(compression.is_some() || (share - part).abs() < 0.05, "{part}: {share}");
            before = kept.len();
        }
        // A file with an ending was not cut off: an unknown piece of it is missing.
        let mut holed = bytes.clone();
        holed.drain(chunk.start + 1000..chunk.end - 1000);
        std::fs::write(folder.path().join("broken.mcap"), &holed)?;
        let saved = recover(&folder.path().join("broken.mcap"), &folder.path().join("none.mcap"), |_, _| {});
        assert!(matches!(saved, Err(RecordingError::Empty { .. })), "{compression:?}: {saved:?}");
    }
    Ok(())
}

#[test]
fn prop_after_damage_the_cut_chunk_is_found() -> Outcome {
    let (folder, mut bytes) = recording(3.0)?;
    let chunks = chunks(&bytes)?;
    let all = messages(&folder.path().join("run.mcap"))?;
    // Not even the length of the chunk before is there.
    bytes[chunks[2].start..chunks[2].start + 40].fill(0);
    bytes.truncate(chunks[3].end - 1);
    let (recovered, whole) = repaired(folder.path(), &bytes)?;
    assert!(recovered.loss.cut_off && recovered.loss.places == 1 && recovered.unchecked > 0, "{recovered:?}");
    let kept = messages(&whole)?;
    assert!(kept.iter().all(|message| all.contains(message)));
    Ok(())
}

#[test]
fn prop_a_damaged_chunk_is_left_out_and_counted() -> Outcome {
    let (folder, mut bytes) = recording(3.0)?;
    let all = messages(&folder.path().join("run.mcap"))?;
    let chunks = chunks(&bytes)?;
    assert!(chunks.len() > 4);
    for n in [0, 1, chunks.len() / 2, chunks.len() - 1] {
        let middle = (chunks[n].start + chunks[n].end) / 2;
        bytes[middle] ^= 0x10;
        let (recovered, whole) = repaired(folder.path(), &bytes)?;
        bytes[middle] ^= 0x10;
        let kept = messages(&whole)?;
        let lost: u64 = recovered.loss.messages.values().sum();
        assert_eq!((recovered.loss.places, recovered.loss.cut_off, recovered.loss.counted), (1, false, true));
        assert_eq!(lost, (all.len() - kept.len()) as u64);
        // The last chunk may hold the end of the run only.
        let instants: BTreeSet<u64> = all.iter().filter(|message| !kept.contains(message)).map(|message| message.2).collect();
        assert!(lost > 0 && (recovered.loss.seconds > 0.0 || instants.len() == 1), "chunk {n}: {:?}", recovered.loss);
        assert!(kept.iter().all(|message| all.contains(message)), "chunk {n}");
    }
    Ok(())
}

/// Bytes that appear or vanish move the summary from where the footer says, and with it the definitions that the first chunk held.
#[test]
fn regress_bytes_put_into_or_taken_from_the_first_chunk_lose_that_chunk_alone() -> Outcome {
    let (folder, bytes) = recording(3.0)?;
    let all = messages(&folder.path().join("run.mcap"))?;
    let chunks = chunks(&bytes)?;
    let middle = (chunks[0].start + chunks[0].end) / 2;
    let longer = [&bytes[..middle], b"abc", &bytes[middle..]].concat();
    let shorter = [&bytes[..middle], &bytes[middle + 5..]].concat();
    for damaged in [longer, shorter] {
        let (recovered, whole) = repaired(folder.path(), &damaged)?;
        let kept = messages(&whole)?;
        let lost: u64 = recovered.loss.messages.values().sum();
        // The chunk, and what its stated length leaves of it or takes of the next record.
        assert!((1..=2).contains(&recovered.loss.places) && !recovered.loss.cut_off && recovered.loss.counted, "{recovered:?}");
        assert!(kept.len() > all.len() / 2 && lost == (all.len() - kept.len()) as u64, "{recovered:?}");
        assert!(kept.iter().all(|message| all.contains(message)));
    }
    Ok(())
}

#[test]
fn prop_after_a_lying_length_the_next_chunks_are_found() -> Outcome {
    let (folder, bytes) = recording(3.0)?;
    let all = messages(&folder.path().join("run.mcap"))?.len() as u64;
    let chunks = chunks(&bytes)?;
    for length in [0_u64, 7, 1 << 20, u64::MAX] {
        let mut lying = bytes.clone();
        lying[chunks[2].start + 1..chunks[2].start + 9].copy_from_slice(&length.to_le_bytes());
        let (recovered, _) = repaired(folder.path(), &lying)?;
        let lost: u64 = recovered.loss.messages.values().sum();
        assert_eq!(recovered.messages + lost, all, "length {length}");
        assert!(recovered.messages > all / 2 && lost > 0, "length {length}: {recovered:?}");
    }
    Ok(())
}

#[test]
fn prop_losses_inside_a_killed_file_are_counted_by_sequence_numbers() -> Outcome {
    let (folder, mut bytes) = recording(3.0)?;
    let chunks = chunks(&bytes)?;
    bytes[(chunks[1].start + chunks[1].end) / 2] ^= 1;
    bytes.truncate(chunks[3].end);
    let (recovered, whole) = repaired(folder.path(), &bytes)?;
    let lost: u64 = recovered.loss.messages.values().sum();
    assert!(recovered.loss.cut_off && recovered.loss.places == 1 && lost > 0, "{recovered:?}");
    let kept = messages(&whole)?;
    let numbers = kept.iter().filter(|message| message.0.ends_with("/angles")).map(|message| u64::from(message.1));
    let (count, last) = numbers.fold((0, 0), |(count, _), number| (count + 1, number));
    assert_eq!(recovered.loss.messages.get("flexcrank/test/angles"), Some(&(last + 1 - count)));
    Ok(())
}

fn program(arguments: &[&Path]) -> Result<(Option<i32>, String), std::io::Error> {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).arg("recover").args(arguments).output()?;
    Ok((output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned()))
}

#[test]
fn prop_exit_codes_distinguish_complete_lossy_and_empty() -> Outcome {
    let (folder, bytes) = recording(1.0)?;
    let path = |name: &str| folder.path().join(name);
    let (run, cut, junk) = (path("run.mcap"), path("cut.mcap"), path("junk.mcap"));
    std::fs::write(&cut, &bytes[..bytes.len() / 2])?;
    std::fs::write(&junk, "not a recording at all")?;
    let option = Path::new("-o");
    assert_eq!(program(&[&run, option, &path("a.mcap")])?.0, Some(0));
    let (code, says) = program(&[&cut, option, &path("b.mcap")])?;
    assert!(code == Some(3) && says.contains("lost: all after"), "{says}");
    let (code, says) = program(&[&junk, option, &path("c.mcap")])?;
    assert!(code == Some(1) && says.contains("not an MCAP file") && !path("c.mcap").exists(), "{says}");
    let (code, says) = program(&[&cut, option, &path("b.mcap")])?;
    assert!(code == Some(1) && says.contains("exists"), "{says}");
    assert_eq!(program(&[&path("absent.mcap"), option, &path("d.mcap")])?.0, Some(1));
    assert!(!path("d.mcap").exists());
    Ok(())
}

/// The messages of a chunk that was cut off were not listed, though recovery and export read them.
#[test]
fn regress_info_lists_as_much_as_recovery_saves() -> Outcome {
    let (folder, bytes) = recording(3.0)?;
    let chunks = chunks(&bytes)?;
    for (cut, holds_some) in [(chunks[0].end - 1, true), (chunks[3].end, false), (chunks[3].end - 1, true)] {
        let (recovered, _) = repaired(folder.path(), &bytes[..cut])?;
        let info = Command::new(env!("CARGO_BIN_EXE_flexcrank"))
            .args(["info", "--json"])
            .arg(folder.path().join("broken.mcap"))
            .output()?;
        let described: serde_json::Value = serde_json::from_slice(&info.stdout)?;
        assert_eq!(info.status.code(), Some(3), "cut at {cut}");
        assert_eq!(described["messages"].as_u64(), Some(recovered.messages), "cut at {cut}");
        let duration_s = described["duration_s"].as_f64().ok_or("no duration")?;
        assert!((duration_s - recovered.span_s).abs() < 1e-12, "cut at {cut}: {duration_s} s and {} s", recovered.span_s);
        let words = match recovered.unchecked {
            0 => "everything before is listed".to_owned(),
            count => format!("listed, with {count} messages of the chunk that was cut off, which no checksum covers"),
        };
        assert!(described["damage"].as_str().is_some_and(|damage| damage.ends_with(&words)), "{described}");
        assert_eq!(recovered.unchecked > 0, holds_some, "cut at {cut}");
    }
    Ok(())
}

/// Export and replay read a chunk that was cut off. Readers of whole chunks found nothing, and named no way on.
#[test]
fn regress_a_file_that_ends_in_its_first_chunk_leads_to_recover() -> Outcome {
    let (folder, bytes) = recording(1.0)?;
    let chunk = chunks(&bytes)?.remove(0);
    let [cut, short, saved] = ["cut.mcap", "short.mcap", "saved.mcap"].map(|name| folder.path().join(name));
    std::fs::write(&cut, &bytes[..chunk.end - 1])?;
    std::fs::write(&short, &bytes[..chunk.start + 20])?;
    let ask = |arguments: &[&str], file: &Path| -> Result<(Option<i32>, String), std::io::Error> {
        let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(arguments).arg(file).output()?;
        let said = [output.stdout, output.stderr].concat();
        Ok((output.status.code(), String::from_utf8_lossy(&said).into_owned()))
    };
    let way = "`flexcrank recover` saves what the chunk that was cut off holds\n";
    let resume = ["run", "--no-bus", "--no-record", "--pace", "max", "--until", "2", "--resume"];
    for (arguments, expected) in [
        (&["verify"][..], (3, format!("\n  {way}  nothing to verify\n"))),
        (&resume, (1, format!("no checkpoint to resume from; the file ends early: {way}"))),
    ] {
        let (code, said) = ask(arguments, &cut)?;
        assert!(code == Some(expected.0) && said.contains(&expected.1), "{said}");
    }
    let (code, said) = ask(&["info"], &short)?;
    let nothing = "  ends early    the file is still being recorded, or was cut off; everything before is listed\n";
    assert!(code == Some(3) && said.contains(" 0 messages\n  recorded      nothing\n") && said.ends_with(nothing), "{said}");
    std::fs::write(&short, &bytes[..100])?;
    let (code, said) = ask(&["verify"], &short)?;
    assert!(code == Some(1) && said.contains("no metadata and scene: the file is still being recorded, was cut off"), "{said}");
    let (code, said) = program(&[&cut, Path::new("-o"), &saved])?;
    assert_eq!(code, Some(3), "{said}");
    let (code, said) = ask(&resume, &saved)?;
    assert_eq!(code, Some(0), "{said}");
    Ok(())
}
