//! A session in several files, each of which can be used without the others.

use std::path::{Path, PathBuf};
use std::time::Duration;

use flexcrank::recording::{Messages, Split};
use flexcrank::resimulation::{RecordedSession, verify};
use flexcrank::runtime::Pace;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::Loads;

use crate::common::{self, Outcome, Service, scene};

fn parts(folder: &Path) -> Result<Vec<PathBuf>, std::io::Error> {
    let mut parts: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_, std::io::Error>>()?;
    parts.sort();
    Ok(parts)
}

#[test]
fn prop_every_part_begins_with_a_checkpoint_and_nothing_is_lost_between() -> Outcome {
    let folder = tempfile::tempdir()?;
    let split = Some(Split::Time(Duration::from_secs(2)));
    let service = Service::start_as(folder, scene(&[])?, Pace::Max, Some(30.0), |live| {
        live.stepping.publish = PublishRate::All.into();
        live.split = split;
    })?;
    let (report, folder) = service.finish()?;
    let parts = parts(folder.path())?;
    assert!(parts.len() >= 3, "30 s in parts of 2 s, and what is on its way: {parts:?}");
    assert_eq!(report.recordings.len(), parts.len());
    let mut steps = Vec::new();
    for (n, part) in (1..).zip(&parts) {
        assert!(part.ends_with(format!("run-{n:03}.mcap")), "{part:?}");
        let first = Messages::open(part)?.next().ok_or("an empty part")??;
        assert!(first.channel.topic.ends_with("/checkpoint"), "{} begins with {}", part.display(), first.channel.topic);
        let bytes = std::fs::read(part)?;
        let summary = mcap::Summary::read(&bytes)?.ok_or("no summary")?;
        assert!(summary.stats.is_some_and(|stats| stats.message_count > 0));
        assert_eq!((summary.metadata_indexes.len(), summary.attachment_indexes.len()), (2, 1));
        let end = mcap::read::metadata(&bytes, &summary.metadata_indexes[1])?.metadata;
        let reason = if n < parts.len() { "continued in the next part" } else { "the run ended" };
        assert_eq!(end.get("reason").map(String::as_str), Some(reason));
        let found = verify(&RecordedSession::open(part)?, &|_, _| {})?;
        assert_eq!(found.findings, [], "{}", part.display());
        let facts = mcap::read::metadata(&bytes, &summary.metadata_indexes[0])?.metadata;
        assert_eq!(facts.get("part"), Some(&n.to_string()));
        for fact in ["name", "version", "commit", "profile", "rustc", "target", "started", "clock_source", "command_line"] {
            assert!(facts.get(fact).is_some_and(|value| !value.is_empty()), "{fact}: {facts:?}");
        }
        let attached = mcap::read::attachment(&bytes, &summary.attachment_indexes[0])?;
        assert_eq!(attached.data, scene(&[])?.text.as_bytes());
        steps.extend(common::decoded::<Loads>(part, "loads")?.into_iter().filter_map(|row| row.stamp).map(|stamp| stamp.step));
    }
    assert_eq!(steps, (0..=30_000).collect::<Vec<u64>>());
    Ok(())
}

#[test]
fn prop_parts_of_a_size_are_full_and_nothing_is_lost_between() -> Outcome {
    const SIZE: u64 = 8_000_000;
    let service = Service::start_as(tempfile::tempdir()?, scene(&[])?, Pace::Max, Some(90.0), |live| {
        live.stepping.publish = PublishRate::All.into();
        live.split = Some(Split::Bytes(SIZE));
        // Size counts, not when it reaches the disk.
        live.flush_period = Duration::from_secs(3600);
    })?;
    let (_, folder) = service.finish()?;
    let parts = parts(folder.path())?;
    let (last, full) = parts.split_last().ok_or("no parts")?;
    assert!(full.len() >= 2, "{parts:?}");
    let mut steps = Vec::new();
    for part in full.iter().chain([last]) {
        // A part is left when the next checkpoint comes: what is on its way until then, at most 8,192 messages and 2,048 samples of
        // four messages, in all about 7 MB, is still in it.
        let size = std::fs::metadata(part)?.len();
        assert!(part == last || (SIZE..2 * SIZE).contains(&size), "{}: {size} bytes", part.display());
        let first = Messages::open(part)?.next().ok_or("an empty part")??;
        assert!(first.channel.topic.ends_with("/checkpoint"), "{} begins with {}", part.display(), first.channel.topic);
        steps.extend(common::decoded::<Loads>(part, "loads")?.into_iter().filter_map(|row| row.stamp).map(|stamp| stamp.step));
    }
    assert_eq!(steps, (0..=90_000).collect::<Vec<u64>>());
    Ok(())
}

#[test]
fn prop_a_part_that_is_there_is_never_overwritten() -> Outcome {
    let folder = tempfile::tempdir()?;
    let old = folder.path().join("run-002.mcap");
    std::fs::write(&old, "precious")?;
    let service = Service::start_as(folder, scene(&[])?, Pace::Max, Some(15.0), |live| {
        live.split = Some(Split::Time(Duration::from_secs(2)));
    })?;
    let (report, folder) = service.finish()?;
    assert_eq!(std::fs::read_to_string(&old)?, "precious");
    let written: Vec<PathBuf> = report.recordings.into_iter().map(|written| Ok(written?.path)).collect::<Outcome<_>>()?;
    assert_eq!(written[..2], [folder.path().join("run-001.mcap"), folder.path().join("run-003.mcap")]);
    Ok(())
}
