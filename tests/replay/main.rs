//! Recordings put back on a real bus: whole, in order, steered from outside.

#[path = "../common/mod.rs"]
mod common;
mod files;
mod rate;
mod viewer;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use common::{Outcome, Service, scene};
use flexcrank::bus::{self, BusError, BusOptions, Name, Session, Topic, client};
use flexcrank::runtime::Pace;
use flexcrank::service::{ReplayAction, ReplayCommand, ReplayOptions, ReplayReport, ServiceError, replay};
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{
    self, AppliedCommand, CommandReply, ReplayControl, Status, applied_command, replay_control, status::State,
};
use prost::Message as _;
use tempfile::TempDir;
use zenoh::Wait as _;

const PATIENCE: Duration = Duration::from_secs(20);

/// One second of the default scene, every step.
fn recording() -> Result<(PathBuf, TempDir), Box<dyn std::error::Error>> {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(1.0), PublishRate::All)?.finish()?;
    Ok((folder.path().join("run.mcap"), folder))
}

/// A replay in a thread of its own, and a session beside it.
struct Playing {
    client: Session,
    player: Session,
    commands: Sender<ReplayCommand>,
    thread: JoinHandle<Result<ReplayReport, ServiceError>>,
    statuses: Arc<Mutex<Vec<Status>>>,
}

impl Playing {
    fn start(plan: ReplayOptions) -> Result<Self, Box<dyn std::error::Error>> {
        let (player, client) = common::linked_sessions()?;
        let (commands, queue) = channel();
        let (session, own) = (player.clone(), commands.clone());
        let statuses: Arc<Mutex<Vec<Status>>> = Arc::default();
        let keep = Arc::clone(&statuses);
        let on_status = Box::new(move |status: &Status| keep.lock().map(|mut all| all.push(status.clone())).unwrap_or(()));
        let thread = std::thread::spawn(move || replay(&session, &plan, (own, queue), |_| on_status));
        Ok(Playing { client, player, commands, thread, statuses })
    }

    fn wait_until(&self, what: impl Fn(&Status) -> bool) -> Outcome {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if self.statuses.lock().map_err(|_| "poisoned")?.last().is_some_and(&what) {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Err(format!("never so: {:?}", self.statuses.lock().map_err(|_| "poisoned")?.last()).into())
    }

    fn finish(self) -> Result<ReplayReport, Box<dyn std::error::Error>> {
        let report = self.thread.join().map_err(|_| "the replayer panicked")?;
        bus::close(&self.client)?;
        bus::close(&self.player)?;
        Ok(report?)
    }
}

/// Key, encoding, payload.
type Sample = (String, String, Vec<u8>);

/// Everything received on some keys, in order.
type Heard = Arc<Mutex<Vec<Sample>>>;

fn listen(session: &Session, key: &str) -> Result<Heard, Box<dyn std::error::Error>> {
    let heard: Heard = Arc::default();
    let keep = Arc::clone(&heard);
    let hear = move |sample: zenoh::sample::Sample| {
        let payload = sample.payload().to_bytes().into_owned();
        let heard = (sample.key_expr().to_string(), sample.encoding().to_string(), payload);
        keep.lock().map(|mut all| all.push(heard)).unwrap_or(());
    };
    session.declare_subscriber(key.to_owned()).callback(hear).background().wait().map_err(|error| error.to_string())?;
    Ok(heard)
}

fn wait_for(heard: &Heard, count: usize) -> Result<Vec<Sample>, Box<dyn std::error::Error>> {
    let begun = Instant::now();
    loop {
        let all = heard.lock().map_err(|_| "poisoned")?.clone();
        if all.len() >= count {
            return Ok(all);
        }
        if begun.elapsed() > PATIENCE {
            return Err(format!("{} of {count} messages", all.len()).into());
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn ghost() -> Name {
    "ghost".parse().unwrap_or_else(|_| unreachable!())
}

fn replay_control(playing: &Playing, action: replay_control::Action) -> Result<CommandReply, Box<dyn std::error::Error>> {
    let message = ReplayControl { id: String::new(), action: Some(action) };
    Ok(client::replay_control(&playing.client, &ghost(), &message)?)
}

#[test]
fn prop_replay_puts_back_the_same_bytes_in_order() -> Outcome {
    let (file, _folder) = recording()?;
    let plan = ReplayOptions { file: file.clone(), rate: 4.0, name: Some(ghost()), wait_for: 1, ..ReplayOptions::default() };
    let playing = Playing::start(plan)?;
    let heard = common::Listener::new(&playing.client, &ghost())?;
    for topic in [Topic::Displacements, Topic::Angles, Topic::Loads, Topic::Energies] {
        let wanted = common::payloads(&file, topic.chunk())?;
        heard.wait_for(topic, wanted.len(), PATIENCE)?;
        assert_eq!(heard.payloads(topic), wanted, "{topic:?}");
    }
    let states: Vec<State> = heard
        .payloads(Topic::Status)
        .iter()
        .filter_map(|bytes| Status::decode(bytes.as_slice()).ok())
        .map(|s| s.state())
        .collect();
    assert!(states.contains(&State::Replaying));
    let report = playing.finish()?;
    assert_eq!((report.messages, report.cut_off, report.slips), (4 * 1001, false, 0));
    Ok(())
}

/// Messages of a replay had no number, though clients find gaps by it; its snapshot had numbers that no message bore.
#[test]
fn regress_messages_of_a_replay_are_numbered_as_those_of_a_service() -> Outcome {
    let (file, _folder) = recording()?;
    let plan = ReplayOptions { file, rate: 4.0, name: Some(ghost()), wait_for: 1, ..ReplayOptions::default() };
    let playing = Playing::start(plan)?;
    let numbers: Arc<Mutex<Vec<Option<u64>>>> = Arc::default();
    let keep = Arc::clone(&numbers);
    let hear = move |sample: zenoh::sample::Sample| {
        let bytes = sample.attachment().and_then(|bytes| <[u8; 8]>::try_from(&*bytes.to_bytes()).ok());
        keep.lock().map(|mut all| all.push(bytes.map(u64::from_le_bytes))).unwrap_or(());
    };
    let key = format!("{}/angles", ghost().presence());
    playing.client.declare_subscriber(key).callback(hear).background().wait().map_err(|error| error.to_string())?;
    let expected: Vec<Option<u64>> = (1..=1001).map(Some).collect();
    let begun = Instant::now();
    let heard = loop {
        let heard = numbers.lock().map_err(|_| "poisoned")?.clone();
        if heard.len() >= expected.len() || begun.elapsed() > PATIENCE {
            break heard;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    // Closes the subscriber's session: a message on its way would be lost.
    playing.finish()?;
    assert!(heard == expected, "{} messages, {:?} to {:?}", heard.len(), heard.first(), heard.last());
    Ok(())
}

#[test]
fn prop_the_first_message_reaches_the_awaited_subscribers() -> Outcome {
    let (file, _folder) = recording()?;
    let first = common::payloads(&file, "angles")?.swap_remove(0);
    for n in 0..5 {
        let plan = ReplayOptions {
            file: file.clone(),
            rate: 1e3,
            name: Some(ghost()),
            topics: vec!["angles".into()],
            ..ReplayOptions::default()
        };
        let playing = Playing::start(ReplayOptions { wait_for: 1, ..plan })?;
        std::thread::sleep(Duration::from_millis(7 * n));
        let heard = listen(&playing.client, "flexcrank/ghost/angles")?;
        let all = wait_for(&heard, 1001)?;
        assert_eq!(all[0].2, first, "start {n}");
        playing.finish()?;
    }
    Ok(())
}

#[test]
fn prop_a_delay_is_waited_out_and_can_be_cut_short() -> Outcome {
    let (file, _folder) = recording()?;
    let delay = Duration::from_millis(300);
    let plan =
        ReplayOptions { file, rate: 1e3, name: Some(ghost()), topics: vec!["angles".into()], delay, ..ReplayOptions::default() };
    let begun = Instant::now();
    let playing = Playing::start(ReplayOptions { wait_for: 1, ..plan.clone() })?;
    let heard = listen(&playing.client, "flexcrank/ghost/angles")?;
    wait_for(&heard, 1)?;
    assert!(begun.elapsed() >= delay);
    assert_eq!(playing.finish()?.messages, 1001);
    let playing = Playing::start(ReplayOptions { delay: Duration::from_secs(3600), ..plan })?;
    playing.wait_until(|status| status.state() == State::Replaying)?;
    playing.commands.send(ReplayCommand::quiet(ReplayAction::Stop))?;
    assert_eq!(playing.finish()?.messages, 0);
    Ok(())
}

/// The recorded commands in order: the id and, for a pulse, its torque.
fn commands(file: &Path) -> Outcome<Vec<(String, Option<f64>)>> {
    let told = |applied: AppliedCommand| match applied.command {
        Some(applied_command::Command::Torque(pulse)) => (pulse.id, Some(pulse.torque_nm)),
        Some(applied_command::Command::Setpoint(setpoint)) => (setpoint.id, Some(setpoint.torque_nm)),
        Some(applied_command::Command::Advance(advance)) => (advance.id, advance.torque_nm),
        Some(applied_command::Command::Control(control)) => (control.id, None),
        None => (String::new(), None),
    };
    Ok(common::decoded(file, "commands")?.into_iter().map(told).collect())
}

#[test]
fn prop_recorded_commands_drive_another_service_when_asked_for() -> Outcome {
    let service = Service::start(scene(&["pulse=[]"])?, Pace::Factor(1.0), None, PublishRate::All)?;
    for (id, torque_nm) in [("push", 5.0), ("pull", -3.0)] {
        let pulse = wire::TorquePulse { id: id.into(), torque_nm, duration_s: 0.01, ..wire::TorquePulse::default() };
        assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
    }
    let hold = wire::Setpoint { id: "hold".into(), torque_nm: 1.5, hold_s: 0.01 };
    assert!(client::setpoint(&service.client, &service.name, &hold)?.accepted);
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let wanted = commands(&file)?;
    let torques = [("push", 5.0), ("pull", -3.0), ("hold", 1.5)].map(|(id, torque_nm)| (id.to_owned(), Some(torque_nm)));
    assert_eq!(wanted[..3], torques);
    // The recorded stop ends it before.
    let driven = Service::start(scene(&["pulse=[]"])?, Pace::Factor(1.0), Some(20.0), PublishRate::All)?;
    client::wait_for_service(&driven.client, &driven.name)?;
    let plan = ReplayOptions { file, topics: vec!["commands".into()], force: true, ..ReplayOptions::default() };
    let silent = replay(&driven.client, &plan, channel(), |_| Box::new(|_| {}));
    assert!(silent.is_err_and(|error| error.to_string().contains("--commands")), "commands are not telemetry");
    let report = replay(&driven.client, &ReplayOptions { commands: true, ..plan }, channel(), |_| Box::new(|_| {}))?;
    assert_eq!(report.messages, 4);
    // The last of them was to stop, and was meant for the service, not for the replayer.
    let (_, folder) = driven.finish()?;
    assert_eq!(commands(&folder.path().join("run.mcap"))?, wanted);
    Ok(())
}

#[test]
fn prop_too_few_subscribers_are_an_error() -> Outcome {
    let (file, _folder) = recording()?;
    let patience = Duration::from_millis(300);
    let playing = Playing::start(ReplayOptions {
        file,
        name: Some(ghost()),
        wait_for: 2,
        wait_timeout: patience,
        ..ReplayOptions::default()
    })?;
    let _heard = listen(&playing.client, "flexcrank/ghost/*")?;
    let refused = playing.finish().err().ok_or("it did not wait")?;
    assert!(refused.to_string().contains("1 of 2 subscribers"), "{refused}");
    Ok(())
}

#[test]
fn prop_a_replay_is_steered_over_the_bus() -> Outcome {
    let (file, _folder) = recording()?;
    let wanted = common::payloads(&file, "angles")?;
    let plan = ReplayOptions {
        file,
        start_paused: true,
        name: Some(ghost()),
        topics: vec!["angles".into()],
        ..ReplayOptions::default()
    };
    let playing = Playing::start(plan)?;
    client::wait_for_service(&playing.client, &ghost())?;
    let heard = listen(&playing.client, "flexcrank/ghost/angles")?;
    playing.wait_until(|status| status.replay.as_ref().is_some_and(|replay| replay.paused))?;
    let say = |action| replay_control(&playing, action);
    assert!(say(replay_control::Action::Next(wire::Next { count: 2 }))?.accepted);
    assert_eq!(wait_for(&heard, 2)?.iter().map(|heard| &heard.2).collect::<Vec<_>>(), [&wanted[0], &wanted[1]]);
    let sought = say(replay_control::Action::Seek(wire::Seek { time_s: 0.5 }))?;
    assert_eq!((sought.accepted, sought.effective_sim_time_s), (true, 0.5));
    assert!(!say(replay_control::Action::Seek(wire::Seek { time_s: 1.5 }))?.accepted, "past the end");
    assert!(!say(replay_control::Action::Rate(wire::Rate { factor: 0.0 }))?.accepted);
    // So slow that the replay is not over before the next command comes.
    assert!(say(replay_control::Action::Rate(wire::Rate { factor: 0.01 }))?.accepted);
    // `control` does what makes sense: a step is a message.
    let step = wire::Control { id: "once".into(), action: Some(wire::control::Action::Step(wire::Steps { count: 1 })) };
    assert!(client::control(&playing.client, &ghost(), &step)?.accepted);
    assert!(client::control(&playing.client, &ghost(), &step)?.reason.contains("repetition"));
    assert_eq!(wait_for(&heard, 3)?[2].2, wanted[500]);
    let record = wire::Control { id: String::new(), action: Some(wire::control::Action::StopRecording(wire::StopRecording {})) };
    assert!(!client::control(&playing.client, &ghost(), &record)?.accepted);
    let pulse = client::pulse(&playing.client, &ghost(), &wire::TorquePulse::default());
    assert!(matches!(pulse, Err(BusError::Replay(name)) if name == ghost()));
    assert!(say(replay_control::Action::Resume(wire::Resume {}))?.accepted);
    assert!(!say(replay_control::Action::Next(wire::Next { count: 1 }))?.accepted, "only when paused");
    assert!(say(replay_control::Action::Rate(wire::Rate { factor: 50.0 }))?.accepted);
    let all: Vec<Vec<u8>> = wait_for(&heard, 503)?.into_iter().map(|heard| heard.2).collect();
    let report = playing.finish()?;
    assert_eq!(report.messages, 2 + 501);
    assert!(all[2..] == wanted[500..], "from the middle to the end");
    Ok(())
}

#[test]
fn prop_a_looped_part_comes_again_and_again() -> Outcome {
    let (file, _folder) = recording()?;
    let wanted = common::payloads(&file, "loads")?;
    let plan =
        ReplayOptions { rate: 50.0, looped: true, start_offset_s: 0.25, duration_s: Some(0.5), ..ReplayOptions::default() };
    let plan = ReplayOptions { file, name: Some(ghost()), ..plan };
    let playing = Playing::start(ReplayOptions { topics: vec!["ghost/loads".into()], ..plan.clone() });
    assert!(
        playing?.finish().is_err_and(|error| error.to_string().contains("flexcrank/test/loads")),
        "topics are recorded names"
    );
    let playing = Playing::start(ReplayOptions { topics: vec!["test/loads".into()], wait_for: 1, ..plan })?;
    let heard = listen(&playing.client, "flexcrank/ghost/loads")?;
    let all: Vec<Vec<u8>> = wait_for(&heard, 1200)?.into_iter().map(|heard| heard.2).collect();
    playing.commands.send(ReplayCommand::quiet(ReplayAction::Stop))?;
    playing.finish()?;
    let part = &wanted[250..=750];
    assert!(all[..501] == *part && all[501..1002] == *part, "the part from 0.25 s to 0.75 s, twice");
    Ok(())
}

#[test]
fn prop_no_replay_under_the_name_of_a_live_service() -> Outcome {
    let (file, _folder) = recording()?;
    let (live, player) = common::linked_sessions()?;
    let service = bus::ServiceEndpoint::declare(&live, &"test".parse()?, ("", &bus::About::default()), Vec::new())?;
    client::wait_for_service(&player, &"test".parse()?)?;
    let plan = ReplayOptions { file, rate: 1e3, ..ReplayOptions::default() };
    let refused = replay(&player, &plan, channel(), |_| Box::new(|_| {}));
    assert!(refused.is_err_and(|error| error.to_string().contains("--force")));
    let remapped = ReplayOptions { remaps: vec!["flexcrank/test:=flexcrank/ghost".parse()?], ..plan.clone() };
    assert_eq!(replay(&player, &remapped, channel(), |_| Box::new(|_| {}))?.name, ghost());
    // Under any other key, too, statuses and checkpoints are left out.
    let elsewhere = ReplayOptions { remaps: vec!["flexcrank/test:=robot".parse()?], ..plan.clone() };
    let played = replay(&player, &elsewhere, channel(), |_| Box::new(|_| {}))?;
    assert_eq!((played.messages, played.name.to_string().as_str()), (4 * 1001, "replay"));
    let forced = ReplayOptions { force: true, ..plan };
    assert_eq!(replay(&player, &forced, channel(), |_| Box::new(|_| {}))?.messages, 4 * 1001);
    service.close()?;
    Ok(())
}

/// Replays in a process of its own, to read its log.
#[test]
fn regress_refusals_of_replay_commands_are_rate_limited() -> Outcome {
    let (file, _folder) = recording()?;
    let endpoint = format!("tcp/{}", std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?);
    let replay = Command::new(env!("CARGO_BIN_EXE_flexcrank"))
        .args(["replay", "--name", "ghost", "--start-paused", "--listen", &endpoint])
        .arg(&file)
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    let begun = Instant::now();
    let client = loop {
        match (BusOptions { connect: vec![endpoint.clone()], ..BusOptions::default() }).open_client() {
            Ok(client) => break client,
            Err(error) if begun.elapsed() > PATIENCE => return Err(error.into()),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    client::wait_for_service(&client, &ghost())?;
    for _ in 0..100 {
        client::put(&client, &ghost().replay(), b"no command", "flexcrank.v1.ReplayControl")?;
    }
    let stop = ReplayControl { id: String::new(), action: Some(replay_control::Action::Stop(wire::Stop {})) };
    let long = ReplayControl { id: "x".repeat(129), ..stop.clone() };
    assert!(!client::replay_control(&client, &ghost(), &long)?.accepted, "the reply cache would keep the id");
    assert!(client::replay_control(&client, &ghost(), &stop)?.accepted);
    bus::close(&client)?;
    let log = String::from_utf8(replay.wait_with_output()?.stderr)?;
    let lines = log.lines().filter(|line| line.contains("a command was refused")).count() as u64;
    assert!((1..=1 + begun.elapsed().as_secs()).contains(&lines), "{lines} lines:\n{log}");
    Ok(())
}
