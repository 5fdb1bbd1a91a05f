//! Setpoints from client to recording, and their watchdog.

use std::path::Path;
use std::time::{Duration, Instant};

use flexcrank::bus::{Topic, client};
use flexcrank::resimulation::{AddedPulse, Change, RecordedSession, resume, verify, what_if};
use flexcrank::runtime::{Pace, ShadowSimulation};
use flexcrank::scene::SceneSource;
use flexcrank::service::SecondRun;
use flexcrank::simulation::{PublishRate, Simulation};
use flexcrank::wire::{self, AppliedCommand, Loads, Setpoint, Status, TorquePulse, control::Action};
use prost::{Message as _, Name as _};

use crate::common::{self, Outcome, Service, scene};

fn setpoint(id: &str, torque_nm: f64, hold_s: f64) -> Setpoint {
    Setpoint { id: id.to_owned(), torque_nm, hold_s }
}

fn send(service: &Service, id: &str, torque_nm: f64, hold_s: f64) -> Outcome<wire::CommandReply> {
    Ok(client::setpoint(&service.client, &service.name, &setpoint(id, torque_nm, hold_s))?)
}

fn put(service: &Service, id: &str, torque_nm: f64, hold_s: f64) -> Outcome {
    let payload = setpoint(id, torque_nm, hold_s).encode_to_vec();
    Ok(client::put(&service.client, &service.name.setpoint(), &payload, &Setpoint::full_name())?)
}

/// Waits for a status that fits.
fn status(service: &Service, fits: impl Fn(&Status) -> bool) -> Outcome<Status> {
    let begun = Instant::now();
    loop {
        let last = client::snapshot(&service.client, &service.name).and_then(|snapshot| snapshot.status);
        match last {
            Some(status) if fits(&status) => return Ok(status),
            other if begun.elapsed() > Duration::from_secs(20) => return Err(format!("{other:?}").into()),
            _ => std::thread::sleep(Duration::from_millis(10)),
        }
    }
}

fn findings(file: &Path) -> Outcome<String> {
    let found = verify(&RecordedSession::open(file)?, &|_, _| {})?.findings;
    Ok(if found.is_empty() { String::new() } else { format!("{found:?}") })
}

#[test]
fn prop_setpoints_by_query_and_put_hold_until_the_next_or_expire() -> Outcome {
    let service = Service::start(scene(&["pulse=[]"])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let first = send(&service, "first", 2.0, 60.0)?;
    assert!(first.accepted, "{}", first.reason);
    let again = send(&service, "first", 2.0, 60.0)?;
    assert!(again.accepted && again.effective_step == first.effective_step, "a retry changes nothing");
    let holding = status(&service, |status| status.setpoint_nm == Some(2.0))?;
    assert_eq!((holding.message.as_str(), holding.setpoints_expired), ("", 0));
    put(&service, "second", -1.0, 0.0123)?;
    let expired = status(&service, |status| status.setpoints_expired == 1 && status.setpoint_nm.is_none())?;
    assert!(expired.message.contains("the setpoint has expired"), "{}", expired.message);
    send(&service, "third", 0.0, 1e-3)?;
    status(&service, |status| status.message.is_empty() && status.setpoint_nm.is_none())?;
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let applied = common::decoded::<AppliedCommand>(&file, "commands")?;
    let effective = |n: usize| applied[n].reply.as_ref().map_or(0, |reply| reply.effective_step);
    assert_eq!((applied.len(), effective(0)), (4, first.effective_step), "three setpoints and the stop");
    let rows = common::decoded::<Loads>(&file, "loads")?;
    let impulse: f64 = rows.iter().map(|row| row.driving_torque_nm * 1e-3).sum();
    let expected = 2.0 * 1e-3 * (effective(1) - effective(0)) as f64 - 0.0123;
    assert!((impulse - expected).abs() < 1e-12, "{impulse} N·m·s for {expected}");
    assert_eq!(findings(&file)?, "");
    Ok(())
}

#[test]
fn prop_bad_setpoints_are_refused_with_their_reason() -> Outcome {
    let service =
        Service::start(scene(&["pulse=[]", "commands.torque_limit_nm=10.0"])?, Pace::Factor(1.0), None, PublishRate::All)?;
    for (torque_nm, hold_s, word) in [
        (f64::NAN, 0.1, "finite"),
        (1.0, 0.0, "hold_s = 0"),
        (1.0, 3600.0, "hold_s = 3600"),
        (10.1, 0.1, "commands.torque_limit_nm"),
    ] {
        let reply = send(&service, "bad", torque_nm, hold_s)?;
        assert!(!reply.accepted && reply.reason.contains(word), "{torque_nm} for {hold_s} s: {reply:?}");
    }
    let pulse = TorquePulse { id: "mine".to_owned(), torque_nm: 1.0, duration_s: 0.01, ..TorquePulse::default() };
    assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
    let other = send(&service, "mine", 1.0, 0.1)?;
    assert!(!other.accepted && other.reason.contains("torque"), "{other:?}");
    put(&service, "", f64::NAN, 0.1)?;
    let last = status(&service, |status| status.commands_rejected == 6)?;
    assert_eq!((last.commands_accepted, last.setpoint_nm, last.setpoints_expired), (1, None, 0));
    service.stop()?;
    let driven = Service::start(scene(&["pulse=[]", "drive.speed_rad_per_s=5"])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let reply = send(&driven, "", 1.0, 0.1)?;
    assert!(!reply.accepted && reply.reason.contains("[drive]"), "{reply:?}");
    driven.stop()?;
    Ok(())
}

/// Setpoints at random steps, with pulses, a pause and a reset between; some expire.
fn controlled() -> Outcome<tempfile::TempDir> {
    let scene = SceneSource::open("crank-slider", &["pulse=[]".to_owned()])?;
    let service = Service::start(scene, Pace::Factor(4.0), None, PublishRate::Hz(170.0))?;
    let say =
        |action| client::control(&service.client, &service.name, &wire::Control { id: String::new(), action: Some(action) });
    for n in 0..60_u32 {
        let torque_nm = f64::from(n % 7) - 3.0;
        assert!(send(&service, &format!("s{n}"), torque_nm, if n % 10 == 0 { 0.0123 } else { 5.0 })?.accepted);
        match n {
            20 => _ = say(Action::Pause(wire::Pause {}))?,
            22 => _ = say(Action::Resume(wire::Resume {}))?,
            40 => _ = say(Action::Reset(wire::Reset {}))?,
            _ => std::thread::sleep(Duration::from_millis(if n % 10 == 0 { 30 } else { 10 })),
        }
    }
    Ok(service.stop()?.1)
}

#[test]
fn prop_setpoints_are_computed_again_to_the_bit() -> Outcome {
    let folder = controlled()?;
    let file = folder.path().join("run.mcap");
    let source = RecordedSession::open(&file)?;
    let found = verify(&source, &|_, _| {})?;
    assert_eq!(found.findings, []);
    assert_eq!((found.recomputed.setpoints, found.recomputed.skipped), (60, 0));
    let last = common::decoded::<Status>(&file, "status")?.pop().ok_or("no status")?;
    assert!(last.setpoints_expired >= 1, "after the reset: {last:?}");
    let end = common::decoded::<wire::Checkpoint>(&file, "checkpoint")?.pop().ok_or("no checkpoint")?;
    let resumed = resume(&source, None, &|_| {})?;
    let state = wire::checkpoint(
        &resumed.simulation.checkpoint(),
        &resumed.simulation.stamp(resumed.epoch_start_s, std::time::SystemTime::now()),
    );
    assert_eq!((&state.state, state.setpoint, state.setpoints_expired), (&end.state, end.setpoint, end.setpoints_expired));
    assert_eq!(resumed.answers.len(), 64);
    Ok(())
}

#[test]
fn prop_setpoints_stay_in_a_what_if() -> Outcome {
    let folder = controlled()?;
    let source = RecordedSession::open(&folder.path().join("run.mcap"))?;
    let attempt = |change: Change, name: &str| what_if(&source, &change, &folder.path().join(name), &|_| {});
    let same = attempt(Change { overrides: vec!["rod.length_m=1.5".to_owned()], ..Change::default() }, "same.mcap")?;
    assert_eq!(same.deviation.first, None);
    let pulse = AddedPulse { start_s: 0.5, torque_nm: 1.0, duration_s: 0.1 };
    assert!(attempt(Change { pulses: vec![pulse], ..Change::default() }, "added.mcap")?.deviation.first.is_some());
    for name in ["same.mcap", "added.mcap"] {
        assert_eq!(findings(&folder.path().join(name))?, "", "{name}");
    }
    Ok(())
}

#[test]
fn prop_the_shadow_follows_setpoints() -> Outcome {
    let scene = scene(&["pulse=[]"])?;
    let shadow = ShadowSimulation::new(scene.scene.solver.model, Simulation::new(&scene.scene)?);
    let service = Service::start_with(
        tempfile::tempdir()?,
        scene,
        Some(SecondRun::OtherModel(Box::new(shadow))),
        Pace::Factor(1.0),
        None,
        PublishRate::Hz(200.0),
    )?;
    let listener = common::Listener::new(&service.client, &service.name)?;
    for n in 0..20 {
        assert!(send(&service, "", f64::from(n), 0.01)?.accepted);
    }
    listener.wait_for(Topic::Shadow, 40, Duration::from_secs(20))?;
    let (_, folder) = service.stop()?;
    let rows = common::decoded::<wire::Shadow>(&folder.path().join("run.mcap"), "shadow")?;
    assert!(rows.iter().all(|row| row.angle_rad == 0.0 && row.joint_force_n == Some(0.0)));
    let angles = common::decoded::<wire::Angles>(&folder.path().join("run.mcap"), "angles")?;
    assert!(angles.last().is_some_and(|last| last.links[0].rate_rad_per_s != 0.0));
    Ok(())
}

/// Steps of 10 ms have no boundary between a setpoint at 101 ms and a pulse at 104 ms: the setpoint waits for 110 ms, and the pulse keeps
/// its instant. So does an added pulse at 105 ms.
#[test]
fn regress_a_pulse_behind_a_setpoint_in_one_longer_step_keeps_its_instant() -> Outcome {
    let service = Service::start(scene(&["pulse=[]", "solver.step_s=1e-3"])?, Pace::Lockstep, None, PublishRate::Hz(100.0))?;
    let advance = |steps| {
        let message = wire::Advance { id: String::new(), torque_nm: None, steps };
        client::advance(&service.client, &service.name, &message, Duration::from_secs(20))
    };
    advance(101)?;
    assert!(send(&service, "held", 0.5, 0.3)?.accepted);
    advance(3)?;
    let pulse = TorquePulse { id: "pushed".to_owned(), torque_nm: 1.0, duration_s: 0.05, ..TorquePulse::default() };
    assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
    advance(296)?;
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let changed = file.with_file_name("changed.mcap");
    let change = Change {
        overrides: vec!["solver.step_s=0.01".to_owned()],
        pulses: vec![AddedPulse { start_s: 0.105, torque_nm: 0.1, duration_s: 0.05 }],
        ..Change::default()
    };
    what_if(&RecordedSession::open(&file)?, &change, &changed, &|_| {})?;
    assert_eq!(verify(&RecordedSession::open(&changed)?, &|_, _| {})?.findings, []);
    let begins = |applied: AppliedCommand| {
        let wire::CommandReply { id, effective_sim_time_s, .. } = applied.reply.unwrap_or_default();
        (["held", "pushed", "what-if-1"].contains(&id.as_str())).then_some((id, (1e3 * effective_sim_time_s).round()))
    };
    let commands: Vec<_> = common::decoded(&changed, "commands")?.into_iter().filter_map(begins).collect();
    let expected = [("pushed", 104.0), ("what-if-1", 105.0), ("held", 110.0)];
    assert_eq!(commands, expected.map(|(id, time_ms)| (id.to_owned(), time_ms)));
    Ok(())
}
