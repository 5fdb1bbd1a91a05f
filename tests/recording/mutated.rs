//! Damaged recordings: every entry point reports the damage or reads the rest; none panics or allocates without bound.
//!
//! `FLEXCRANK_MUTATIONS=100000 FLEXCRANK_SEED=7 cargo test --release --test recording mutated` damages any number of files, and
//! leaves failing ones in the folder that it names. The mutations know the format, and are the same for the same seed. `tests/fuzz` has
//! a coverage-guided target; the files it has found are read here too.

use std::path::Path;
use std::sync::mpsc::channel;
use std::time::Duration;

use flexcrank::bus::{self, BusOptions, Session};
use flexcrank::recording::{self, Export, Messages, export, is_cut_off, read_columns, recover};
use flexcrank::resimulation::{RecordedSession, resume, verify};
use flexcrank::runtime::Pace;
use flexcrank::service::{ReplayOptions, ServiceError, replay};
use flexcrank::simulation::PublishRate;

use crate::common::{Outcome, Service, scene};

/// Most memory that reading a small broken file may take at any time: three times the largest chunk that is read.
const MEMORY_LIMIT: u64 = 3 * 64 * 1024 * 1024;

/// Random numbers by which a file is broken, the same for the same seed: SplitMix64 (Steele, Lea & Flood 2014).
struct Dice(u64);

impl Dice {
    fn throw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.throw() % limit.max(1) as u64) as usize
    }

    fn range(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.below(length);
        start..(start + 1 + self.below(4096)).min(length)
    }
}

/// Starts of the records of a complete file, chunks not opened.
fn records(bytes: &[u8]) -> Vec<usize> {
    let mut starts = Vec::new();
    let mut at = 8;
    while let Some(length) = bytes.get(at + 1..at + 9).and_then(|bytes| bytes.try_into().ok()) {
        starts.push(at);
        at += 9 + u64::from_le_bytes(length) as usize;
    }
    starts
}

fn mutate(whole: &[u8], records: &[usize], dice: &mut Dice) -> (&'static str, Vec<u8>) {
    let mut bytes = whole.to_vec();
    match dice.below(7) {
        0 => {
            bytes.truncate(dice.below(whole.len()));
            ("cut off", bytes)
        }
        1 => {
            for _ in 0..=dice.below(16) {
                let at = dice.below(whole.len());
                bytes[at] ^= 1 << dice.below(8);
            }
            ("bits flipped", bytes)
        }
        2 => {
            let (from, to) = (dice.range(whole.len()), dice.range(whole.len()));
            bytes.splice(to, whole[from].iter().copied());
            ("spliced", bytes)
        }
        3 => {
            bytes.drain(dice.range(whole.len()));
            ("a piece missing", bytes)
        }
        4 => {
            let at = records[dice.below(records.len())];
            let length = [0, 1, dice.throw() % 100_000, dice.throw(), u64::MAX, i64::MAX as u64][dice.below(6)];
            bytes[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
            ("a lying length", bytes)
        }
        5 => {
            // Bytes right behind a record's header: times, sizes, checksums, names and their lengths.
            let at = records[dice.below(records.len())] + dice.below(64);
            let huge = [0xFF, 0x7F, 0x00, 0x80][dice.below(4)];
            bytes.iter_mut().skip(at).take(1 + dice.below(8)).for_each(|byte| *byte = huge);
            ("a lying header", bytes)
        }
        _ => ("the wrong schema", wrong_schema(whole, dice).unwrap_or(bytes)),
    }
}

/// The same messages with wrong schemas.
fn wrong_schema(whole: &[u8], dice: &mut Dice) -> Result<Vec<u8>, mcap::McapError> {
    let mut out = mcap::Writer::new(std::io::Cursor::new(Vec::new()))?;
    let names = ["flexcrank.v1.Angles", "flexcrank.v1.Checkpoint", "google.protobuf.Timestamp", "no.such.Type", ""];
    let mut channels = std::collections::BTreeMap::new();
    for message in mcap::MessageStream::new(whole)? {
        let message = message?;
        if !channels.contains_key(&message.channel.topic) {
            let mut data = message.channel.schema.as_ref().map(|schema| schema.data.to_vec()).unwrap_or_default();
            match dice.below(3) {
                0 => data.truncate(dice.below(data.len())),
                1 => data.iter_mut().step_by(1 + dice.below(997)).for_each(|byte| *byte = byte.wrapping_add(1)),
                _ => {}
            }
            let schema = out.add_schema(names[dice.below(names.len())], ["protobuf", "jsonschema"][dice.below(8) / 7], &data)?;
            let channel = out.add_channel(schema, &message.channel.topic, "protobuf", &message.channel.metadata)?;
            channels.insert(message.channel.topic.clone(), channel);
        }
        let channel_id = channels[&message.channel.topic];
        let (sequence, log_time, publish_time) = (message.sequence, message.log_time, message.publish_time);
        let mut data = message.data.to_vec();
        if dice.below(50) == 0 && !data.is_empty() {
            let at = dice.below(data.len());
            data[at] = data[at].wrapping_add(1);
        }
        out.write_to_known_channel(&mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time }, &data)?;
    }
    out.finish()?;
    Ok(out.into_inner().into_inner())
}

/// Reads a file in every way there is. Errors are fine if they have a message.
fn read_all_ways(broken: &Path, folder: &Path, session: &Session) {
    let said = |error: String| assert!(error.len() > broken.display().to_string().len(), "an error that says nothing: {error}");
    if let Ok(messages) = Messages::open(broken) {
        messages.filter_map(Result::err).take(2).for_each(|error| said(error.to_string()));
    }
    match recording::RecordingFile::open(broken).and_then(|source| source.messages_from(0)) {
        Err(error) => said(error.to_string()),
        Ok(messages) => messages.filter_map(Result::err).take(2).for_each(|error| said(error.to_string())),
    }
    // A message that claims to come years later ends the replay.
    let plan =
        ReplayOptions { file: broken.to_owned(), rate: 1e6, duration_s: Some(100.0), force: true, ..ReplayOptions::default() };
    let played = replay(session, &plan, channel(), |_| Box::new(|_| {}));
    assert!(!matches!(played, Err(ServiceError::Died(_))), "the reading thread panicked");
    played.err().into_iter().for_each(|error| said(error.to_string()));
    read_columns(broken, &|_| {}).err().into_iter().for_each(|error| said(error.to_string()));
    let tables = Export { csv: Some(folder.join("tables")), parquet: Some(folder.join("tables")), ..Export::default() };
    export(broken, &tables, &|_| {}).err().into_iter().for_each(|error| said(error.to_string()));
    match RecordedSession::open(broken) {
        Err(error) => said(error.to_string()),
        Ok(source) => {
            verify(&source, &|_, _| {}).err().into_iter().for_each(|error| said(error.to_string()));
            resume(&source, None, &|_| {}).err().into_iter().for_each(|error| said(error.to_string()));
        }
    }
    let whole = folder.join("whole.mcap");
    match recover(broken, &whole, |_, _| {}) {
        Err(error) => said(error.to_string()),
        Ok(recovered) => {
            let read: Result<Vec<_>, _> = Messages::open(&whole).into_iter().flatten().collect();
            assert_eq!(read.ok().map(|messages| messages.len() as u64), Some(recovered.messages), "what is recovered is whole");
            let _ = std::fs::remove_file(&whole);
        }
    }
}

fn asked(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Reads a file by every way there is: `None` when one panicked, else the most memory that it took, bytes.
fn memory_of_reading(broken: &Path, folder: &Path, session: &Session) -> Option<u64> {
    let mut panicked = false;
    let memory = allocation_counter::measure(|| {
        let reading = std::panic::AssertUnwindSafe(|| read_all_ways(broken, folder, session));
        panicked = std::panic::catch_unwind(reading).is_err();
    });
    (!panicked).then_some(memory.bytes_max)
}

fn quiet_session() -> Outcome<Session> {
    Ok(BusOptions { listen: vec!["tcp/127.0.0.1:0".to_owned()], ..BusOptions::default() }.open_service()?)
}

#[test]
fn regress_files_found_by_the_fuzzer_are_read() -> Outcome {
    let (folder, session) = (tempfile::tempdir()?, quiet_session()?);
    for broken in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz"))? {
        let broken = broken?.path();
        let memory =
            memory_of_reading(&broken, folder.path(), &session).ok_or_else(|| format!("{}: panicked", broken.display()))?;
        assert!(memory <= MEMORY_LIMIT, "{}: {memory} bytes", broken.display());
    }
    bus::close(&session)?;
    Ok(())
}

#[test]
fn regress_a_record_that_reaches_beyond_its_chunk_is_damage() -> Outcome {
    let broken = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz/record-beyond-its-chunk.mcap");
    let (read, errors): (Vec<_>, Vec<_>) = Messages::open(&broken)?.partition(Result::is_ok);
    assert!(!read.is_empty());
    let [Err(error)] = &errors[..] else { return Err(format!("{} errors", errors.len()).into()) };
    assert!(!is_cut_off(error) && error.to_string().contains("Chunk ended in the middle of a record"), "{error}");
    Ok(())
}

#[test]
fn prop_damaged_files_are_reported_without_panic_or_waste_of_memory() -> Outcome {
    // Many small chunks.
    let service = Service::start_as(tempfile::tempdir()?, scene(&[])?, Pace::Max, Some(0.1), |live| {
        live.stepping.publish = PublishRate::All.into();
        live.flush_period = Duration::from_micros(100);
    })?;
    let (_, folder) = service.finish()?;
    let whole = std::fs::read(folder.path().join("run.mcap"))?;
    let records = records(&whole);
    let session = quiet_session()?;
    let seed = asked("FLEXCRANK_SEED", 1);
    let mut dice = Dice(seed);
    for n in 0..asked("FLEXCRANK_MUTATIONS", 200) {
        let (how, bytes) = mutate(&whole, &records, &mut dice);
        let broken = folder.path().join("broken.mcap");
        std::fs::write(&broken, &bytes)?;
        let memory = memory_of_reading(&broken, folder.path(), &session);
        if memory.is_none_or(|bytes| bytes > MEMORY_LIMIT) {
            let kept = std::env::temp_dir().join(format!("flexcrank-broken-{seed}-{n}.mcap"));
            std::fs::write(&kept, &bytes)?;
            return Err(format!("{how}: {memory:?} bytes, none when it panicked; see {}", kept.display()).into());
        }
    }
    bus::close(&session)?;
    Ok(())
}
