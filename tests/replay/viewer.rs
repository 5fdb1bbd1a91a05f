//! A replay beside a viewer in the same process.

use flexcrank::bus::{LogTime, OwnSubscription};
use flexcrank::recording::Messages;
use flexcrank::service::{ReplayViewer, replay_beside};

use super::*;

/// Log time and payload.
type Timed = (u64, Vec<u8>);

/// The angles of a recording.
fn angles(file: &Path) -> Result<Vec<Timed>, Box<dyn std::error::Error>> {
    let mut all = Vec::new();
    for message in Messages::open(file)? {
        let message = message?;
        if message.channel.topic.ends_with("/angles") {
            all.push((message.log_time, message.data.to_vec()));
        }
    }
    Ok(all)
}

/// Log time of the first message of all, ns.
fn first_log_time(file: &Path) -> Result<u64, Box<dyn std::error::Error>> {
    Ok(flexcrank::recording::RecordingFile::open(file)?.begin_ns())
}

#[test]
fn prop_beside_a_viewer_a_replay_stays_at_its_end_and_states_log_times() -> Outcome {
    let (file, _folder) = recording()?;
    let wanted = angles(&file)?;
    let from = first_log_time(&file)? + 500_000_000;
    let session = BusOptions { isolated: true, ..BusOptions::default() }.open_service()?;
    let (commands, queue) = channel();
    let received: Arc<Mutex<Vec<Timed>>> = Arc::default();
    let statuses: Arc<Mutex<Vec<Status>>> = Arc::default();
    let (log_time, keep) = (LogTime::default(), Arc::clone(&received));
    let now = log_time.clone();
    let subscription = OwnSubscription::declare(&session, &ghost().topic(Topic::Angles), move |payload| {
        keep.lock().map(|mut all| all.push((now.get(), payload.to_vec()))).unwrap_or(());
    })?;
    let keep = Arc::clone(&statuses);
    let on_status = Box::new(move |status: &Status| keep.lock().map(|mut all| all.push(status.clone())).unwrap_or(()));
    let (player, own) = (session.clone(), commands.clone());
    let thread = std::thread::spawn(move || {
        let plan = ReplayOptions { file, rate: 100.0, name: Some(ghost()), ..ReplayOptions::default() };
        replay_beside(&player, &plan, (own, queue), |start| {
            assert!(start.span_ns.0 <= start.span_ns.1 && !start.channels.is_empty());
            Ok(ReplayViewer { on_status, log_time: Some(log_time), stays_at_end: true })
        })
    });
    let at_end = |count: usize| -> Outcome {
        let begun = Instant::now();
        loop {
            let last = statuses.lock().map_err(|_| "poisoned")?.last().cloned();
            let paused = last.and_then(|status| status.replay).is_some_and(|replay| replay.paused);
            if paused && received.lock().map_err(|_| "poisoned")?.len() >= count {
                return Ok(());
            }
            assert!(begun.elapsed() < PATIENCE && !thread.is_finished(), "the replay does not stay at its end");
            std::thread::sleep(Duration::from_millis(2));
        }
    };
    at_end(wanted.len())?;
    commands.send(ReplayCommand::quiet(ReplayAction::Seek(0.5)))?;
    commands.send(ReplayCommand::quiet(ReplayAction::Resume))?;
    let again: Vec<Timed> = wanted.iter().filter(|(at, _)| *at >= from).cloned().collect();
    at_end(wanted.len() + again.len())?;
    // Playing on from the end begins at the start.
    commands.send(ReplayCommand::quiet(ReplayAction::Resume))?;
    at_end(wanted.len() * 2 + again.len())?;
    commands.send(ReplayCommand::quiet(ReplayAction::Stop))?;
    let report = thread.join().map_err(|_| "the replayer panicked")??;
    assert!(report.messages > 0);
    let expected: Vec<Timed> = [wanted.clone(), again, wanted].concat();
    let received = received.lock().map_err(|_| "poisoned")?.clone();
    assert_eq!(received.len(), expected.len());
    assert!(received == expected, "payloads and log times as recorded, in order");
    subscription.close()?;
    bus::close(&session)?;
    Ok(())
}
