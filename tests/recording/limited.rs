//! A recording with a size limit ends complete, and the simulation goes on.

use std::sync::{Arc, Mutex, PoisonError};

use flexcrank::recording::{Messages, Split};
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
