//! Files of other programs, and broken ones.

use std::collections::BTreeMap;
use std::path::Path;

use flexcrank::bus::client;
use flexcrank::recording::RecordingFile;
use flexcrank::resimulation::{Change, RecordedSession, Resumed, resume, what_if};
use flexcrank::runtime::Pace;
use flexcrank::service::{ReplayOptions, Resumption, ServiceError};
use flexcrank::simulation::PublishRate;
use flexcrank::wire::TorquePulse;
use mcap::records::MessageHeader;

use crate::common::{self, Outcome, Service, scene};
use crate::{Playing, ghost, listen, recording, wait_for};

/// A file as another program writes it: chunks that overlap, equal stamps, encodings of its own.
fn foreign(path: &Path, indexed: bool) -> Outcome {
    let options = mcap::WriteOptions::new().compression(None).use_chunks(indexed).chunk_size(None);
    let mut writer = options.create(std::fs::File::create(path)?)?;
    let image = writer.add_schema("sensor_msgs/msg/Image", "ros2msg", b"uint8[] data")?;
    let channels = [
        writer.add_channel(image, "/camera/image", "cdr", &BTreeMap::new())?,
        writer.add_channel(0, "/log", "json", &BTreeMap::new())?,
        writer.add_channel(0, "/bad//topic", "json", &BTreeMap::new())?,
    ];
    let mut sequence = 0;
    let mut put = |writer: &mut mcap::Writer<std::fs::File>, channel: usize, log_time: u64| {
        sequence += 1;
        let header = MessageHeader { channel_id: channels[channel], sequence, log_time, publish_time: 0 };
        writer.write_to_known_channel(&header, format!("{channel} {log_time} {sequence}").as_bytes())
    };
    for (channel, log_time) in [(0, 1_000), (1, 3_000), (0, 5_000)] {
        put(&mut writer, channel, log_time)?;
    }
    writer.flush()?;
    for (channel, log_time) in [(1, 2_000), (0, 3_000), (1, 3_000), (2, 4_000), (0, 6_000)] {
        put(&mut writer, channel, log_time)?;
    }
    writer.finish()?;
    Ok(())
}

#[test]
fn prop_recordings_of_others_are_replayed_as_they_are() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("robot.mcap");
    foreign(&file, true)?;
    let playing = Playing::start(ReplayOptions {
        file,
        wait_for: 1,
        remaps: vec!["/log:=robot/log".parse()?],
        ..ReplayOptions::default()
    })?;
    let heard = listen(&playing.client, "**")?;
    let all = wait_for(&heard, 7)?;
    let report = playing.finish()?;
    assert_eq!((report.messages, report.name.to_string().as_str()), (7, "replay"));
    assert!(report.left_out.len() == 1 && report.left_out[0].starts_with("/bad//topic"), "{:?}", report.left_out);
    let (image, log) = (("camera/image", "application/cdr;sensor_msgs/msg/Image"), ("robot/log", "application/json"));
    let expected = [
        (image, "0 1000 1"),
        (log, "1 2000 4"),
        (log, "1 3000 2"),
        (image, "0 3000 5"),
        (log, "1 3000 6"),
        (image, "0 5000 3"),
        (image, "0 6000 8"),
    ];
    let all: Vec<_> = all.iter().filter(|(key, ..)| !key.starts_with("flexcrank/")).collect();
    for ((key, encoding, payload), ((wanted_key, wanted_encoding), text)) in all.into_iter().zip(expected) {
        assert_eq!((key.as_str(), encoding.as_str(), payload.as_slice()), (wanted_key, wanted_encoding, text.as_bytes()));
    }
    Ok(())
}

#[test]
fn prop_a_source_is_read_from_any_time_on_with_an_index_and_without() -> Outcome {
    let (file, folder) = recording()?;
    let source = RecordingFile::open(&file)?;
    let all: Vec<u64> = source.messages_from(0)?.map(|message| Ok(message?.log_time)).collect::<Result<_, ServiceError>>()?;
    assert_eq!(all.first(), Some(&source.begin_ns()));
    assert!(all.is_sorted() && (source.duration_s() - 1.0).abs() < 1e-6, "{}", source.duration_s());
    let from_ns = source.begin_ns() + 700_000_000;
    let late = source.messages_from(from_ns)?.filter_map(Result::ok).count();
    assert_eq!(late, all.iter().filter(|time| **time >= from_ns).count());
    let whole = std::fs::read(&file)?;
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &whole[..whole.len() / 2])?;
    let source = RecordingFile::open(&cut)?;
    assert!(source.is_cut_off() && source.duration_s() > 0.1);
    assert!(source.messages_from(source.begin_ns())?.all(|message| message.is_ok()));
    let loose = folder.path().join("loose.mcap");
    foreign(&loose, false)?;
    assert_eq!(RecordingFile::open(&loose)?.messages_from(0)?.filter_map(Result::ok).count(), 8, "messages outside chunks");
    Ok(())
}

#[test]
fn prop_a_damaged_chunk_is_reported_with_its_position() -> Outcome {
    let (file, _folder) = recording()?;
    let mut bytes = std::fs::read(&file)?;
    let chunks = mcap::Summary::read(&bytes)?.ok_or("no summary")?.chunk_indexes;
    let chunk = &chunks[chunks.len() / 2];
    bytes[(chunk.chunk_start_offset + chunk.chunk_length / 2) as usize] ^= 0x10;
    std::fs::write(&file, bytes)?;
    let source = RecordingFile::open(&file)?;
    let error = source.messages_from(0)?.find_map(Result::err).ok_or("nothing was noticed")?;
    assert!(error.to_string().contains("the chunk at byte"), "{error}");
    Ok(())
}

/// With `topics` that did not name them, no commands were replayed, without a word.
#[test]
fn regress_commands_are_replayed_beside_the_topics_asked_for() -> Outcome {
    let service = Service::start(scene(&["pulse=[]"])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let pulse = TorquePulse { id: "push".into(), torque_nm: 5.0, duration_s: 0.01, ..TorquePulse::default() };
    assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let count = |chunk: &str| common::payloads(&file, chunk).map(|all| all.len() as u64);
    let (angles, sent) = (count("angles")?, count("commands")?);
    assert!(angles > 0 && sent == 2, "{angles} angles, {sent} commands");
    for (commands, messages) in [(false, angles), (true, angles + sent)] {
        let topics = vec!["angles".to_owned()];
        let plan =
            ReplayOptions { file: file.clone(), rate: 1e3, name: Some(ghost()), topics, commands, ..ReplayOptions::default() };
        assert_eq!(Playing::start(plan)?.finish()?.messages, messages, "commands: {commands}");
    }
    Ok(())
}

#[test]
fn regress_topics_that_are_never_replayed_are_named_in_the_refusal() -> Outcome {
    let (file, _folder) = recording()?;
    let topics = vec!["status".to_owned(), "checkpoint".to_owned()];
    let refused =
        Playing::start(ReplayOptions { file, topics, ..ReplayOptions::default() })?.finish().err().ok_or("it played")?;
    let why = "run.mcap: nothing to replay (checkpoint is never replayed; status is never replayed)";
    assert!(refused.to_string().ends_with(why), "{refused}");
    Ok(())
}

/// The refusal named no way on.
#[test]
fn regress_another_scene_of_a_resumed_recording_is_refused_with_the_recording_to_take() -> Outcome {
    let (file, folder) = recording()?;
    let source = RecordedSession::open(&file)?;
    let Resumed { simulation, epoch_start_s, answers, missing, .. } = resume(&source, Some(0.5), &|_| {})?;
    let resumption = Resumption { started: source.started, epoch_start_s, level: 0, answers, missing, of: "run.mcap".to_owned() };
    let (_, resumed) = Service::resume(source.scene.clone(), simulation, resumption, 1.0, PublishRate::All)?.finish()?;
    let change = Change { overrides: vec!["rod.density_kg_per_m3=7000.0".to_owned()], ..Change::default() };
    let later = RecordedSession::open(&resumed.path().join("run.mcap"))?;
    let refused = what_if(&later, &change, &folder.path().join("what-if.mcap"), &|_| {}).err().ok_or("not refused")?;
    let way = "the recording begins later; take the recording that this one resumed, or the first part";
    assert!(refused.to_string().ends_with(way), "{refused}");
    Ok(())
}
