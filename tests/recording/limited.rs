//! A recording with a size limit ends complete, and the simulation goes on.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use flexcrank::recording::{EndReason, Message, Messages, Recorder, SessionInfo, Settings, Split, WhenFull};
use flexcrank::runtime::{Ending, Pace};

use crate::common::{Outcome, Service, scene};

const LIMIT: u64 = 4_000_000;

#[test]
fn prop_a_recording_ends_complete_at_its_size_limit_and_the_simulation_goes_on() -> Outcome {
    for split in [None, Some(Split::Bytes(500_000))] {
        let said = Arc::new(Mutex::new(String::new()));
        let heard = Arc::clone(&said);
        let folder = tempfile::tempdir()?;
        let service = Service::start_as(folder, scene(&[])?, Pace::Max, Some(200.0), |live| {
            (live.max_recording_bytes, live.split) = (Some(LIMIT), split);
            live.on_status = Box::new(move |status| {
                status.message.clone_into(&mut heard.lock().unwrap_or_else(PoisonError::into_inner));
            });
        })?;
        let (report, folder) = service.finish()?;
        assert_eq!(report.ending, Ending::Finished);
        assert_eq!(report.dropped, 0, "what comes after the end is not dropped");
        let (mut bytes, mut messages) = (0, 0);
        for file in std::fs::read_dir(folder.path())? {
            let path = file?.path();
            bytes += std::fs::metadata(&path)?.len();
            messages += Messages::open(&path)?.collect::<Result<Vec<_>, _>>()?.len();
        }
        assert!((LIMIT / 2..=LIMIT).contains(&bytes), "{bytes} bytes");
        let written = report.recordings.into_iter().collect::<Result<Vec<_>, _>>()?;
        assert_eq!(written.iter().map(|part| part.messages).sum::<u64>(), messages as u64);
        let limited: Vec<bool> = written.iter().map(|part| part.limited).collect();
        assert!(limited.last() == Some(&true) && limited.iter().filter(|limited| **limited).count() == 1, "{limited:?}");
        assert!(split.is_none() || written.len() > 1);
        let said = said.lock().unwrap_or_else(PoisonError::into_inner);
        assert!(said.contains("recording stopped: it reached --max-recording-size"), "{said}");
    }
    Ok(())
}

/// Payloads of random bytes do not compress, and their indexes are as long as payloads of one byte.
#[test]
fn prop_no_recording_exceeds_its_size_limit_whatever_its_messages_are() -> Outcome {
    const LIMIT: u64 = 3_000_000;
    for (length, topics, split, flush_ms) in
        [(1, 3, None, 200), (1, 40, Some(100_000), 200), (60, 40, None, 5), (700, 3, Some(100_000), 5), (20_000, 12, None, 200)]
    {
        let folder = tempfile::tempdir()?;
        let settings = Settings {
            flush_period: Duration::from_millis(flush_ms),
            fsync: false,
            split: split.map(Split::Bytes),
            limit_bytes: Some(LIMIT),
            when_full: WhenFull::Wait,
        };
        let session = SessionInfo {
            name: "limited".to_owned(),
            scene: "x".repeat(5000),
            started: SystemTime::UNIX_EPOCH,
            command_line: String::new(),
            facts: Vec::new(),
        };
        let recorder = Recorder::start(&folder.path().join("x.mcap"), &session, settings)?;
        let mut state = 1_u64;
        let mut byte = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 56) as u8
        };
        let message = |n: u64| Message {
            topic: format!("flexcrank/limited/{}", n % topics),
            schema: "flexcrank.v1.Angles",
            payload: (0..length).map(|_| byte()).collect(),
            log_time_ns: n,
            publish_time_ns: n,
            begins_part: n.is_multiple_of(100),
        };
        (0..).map(message).find(|message| !recorder.record(message.clone())).ok_or("it has no end")?;
        let written = recorder.finish(EndReason::RunEnded).into_iter().collect::<Result<Vec<_>, _>>()?;
        assert_eq!(written.len() > 1, split.is_some());
        let sizes = std::fs::read_dir(folder.path())?
            .map(|file| Ok(file?.metadata()?.len()))
            .collect::<Result<Vec<_>, std::io::Error>>()?;
        let bytes: u64 = sizes.iter().sum();
        assert!((LIMIT * 4 / 5..=LIMIT).contains(&bytes), "{bytes} bytes of {length}-byte messages, {topics} topics, {split:?}");
    }
    Ok(())
}
