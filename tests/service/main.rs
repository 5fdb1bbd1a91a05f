//! A whole service on a real bus: sessions on loopback, port 0, scouting off; real files.

#[path = "../common/mod.rs"]
mod common;
mod energies;
mod recordings;
mod refused;
mod until;

use std::time::{Duration, Instant};

use common::{Outcome, Service, scene};
use flexcrank::bus::{Topic, client};
use flexcrank::recording::{Export, Messages, export};
use flexcrank::resimulation::{RecordedSession, verify};
use flexcrank::runtime::{Ending, Pace};
use flexcrank::scene::SceneSource;
use flexcrank::service::SecondRun;
use flexcrank::simulation::{PublishRate, Simulation};
use flexcrank::wire::{self, Angles, AppliedCommand, Loads, Status, TorquePulse, control::Action};
use prost::Message;

fn pulse(id: &str, torque_nm: f64, duration_s: f64) -> TorquePulse {
    TorquePulse { id: id.to_owned(), torque_nm, duration_s, ..TorquePulse::default() }
}

fn control(action: Action) -> wire::Control {
    wire::Control { id: String::new(), action: Some(action) }
}

#[test]
fn prop_a_pulse_travels_from_client_to_recording() -> Outcome {
    let service = Service::start(scene(&["pulse=[]"])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let mut loads = client::join(&service.client, &service.name, Topic::Loads)?;
    let reply = client::pulse(&service.client, &service.name, &pulse("p1", 5.0, 0.37e-3))?;
    assert!(reply.accepted, "{}", reply.reason);
    let mut seen = 0;
    while seen <= reply.effective_step {
        let (payload, _) = loads.next(Duration::from_secs(10)).ok_or("nothing comes")?;
        seen = Loads::decode(payload.as_slice())?.stamp.ok_or("no stamp")?.step;
    }
    let again = client::pulse(&service.client, &service.name, &pulse("p1", 5.0, 0.37e-3))?;
    assert!(again.accepted && again.effective_step == reply.effective_step, "a retry is acknowledged with the same step");
    let refused = client::pulse(&service.client, &service.name, &pulse("p2", f64::NAN, 0.1))?;
    assert!(!refused.accepted && refused.id == "p2" && !refused.reason.is_empty());
    client::control(&service.client, &service.name, &control(Action::Pause(wire::Pause {})))?;
    client::control(&service.client, &service.name, &control(Action::Step(wire::Steps { count: 3 })))?;
    let (report, folder) = service.stop()?;
    assert_eq!(report.ending, Ending::Stopped);
    assert_eq!(report.dropped, 0);
    let rows = common::decoded::<Loads>(&folder.path().join("run.mcap"), "loads")?;
    let impulse: f64 = rows
        .windows(2)
        .map(|pair| pair[1].driving_torque_nm * (common::time_s(&pair[1].stamp) - common::time_s(&pair[0].stamp)))
        .sum();
    let exact = 5.0 * 0.37e-3;
    assert!((impulse - exact).abs() < 1e-12 * exact, "impulse {impulse}");
    let first = rows.iter().find(|row| row.driving_torque_nm != 0.0).and_then(|row| row.stamp.as_ref());
    assert_eq!(first.map(|stamp| stamp.step), Some(reply.effective_step));
    let applied = common::decoded::<AppliedCommand>(&folder.path().join("run.mcap"), "commands")?;
    assert_eq!(applied.len(), 4, "pulse, pause, step, stop: each once");
    let status = common::decoded::<Status>(&folder.path().join("run.mcap"), "status")?;
    let last = status.last().ok_or("no status")?;
    assert_eq!((last.commands_accepted, last.commands_rejected), (4, 1));
    assert!((last.kinetic_j.unwrap_or(0.0) - last.work_in_j.unwrap_or(1.0)).abs() < 1e-12);
    Ok(())
}

#[test]
fn prop_impulse_survives_a_low_publishing_rate() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Max, Some(2.0), PublishRate::Hz(37.0))?;
    let (report, folder) = service.finish()?;
    assert_eq!(report.ending, Ending::Finished);
    let rows = common::decoded::<Loads>(&folder.path().join("run.mcap"), "loads")?;
    let impulse: f64 = rows
        .windows(2)
        .map(|pair| pair[1].driving_torque_nm * (common::time_s(&pair[1].stamp) - common::time_s(&pair[0].stamp)))
        .sum();
    assert!((impulse - 2.0).abs() < 1e-12 * 2.0, "20 N·m for 0.1 s, seen 37 times a second: {impulse}");
    Ok(())
}

#[test]
fn prop_pause_steps_and_reset_count_exactly() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let say = |action| client::control(&service.client, &service.name, &control(action));
    assert!(!say(Action::Step(wire::Steps { count: 1 }))?.accepted, "steps are counted only when paused");
    let paused = say(Action::Pause(wire::Pause {}))?;
    let stepped = say(Action::Step(wire::Steps { count: 250 }))?;
    assert_eq!(stepped.effective_step, paused.effective_step);
    let after = say(Action::Pause(wire::Pause {}))?;
    assert!(after.effective_step <= paused.effective_step + 250);
    let reset = say(Action::Reset(wire::Reset {}))?;
    assert_eq!((reset.effective_step, reset.effective_sim_time_s), (1, 0.0));
    say(Action::Resume(wire::Resume {}))?;
    let (_, folder) = service.stop()?;
    let rows = common::decoded::<Angles>(&folder.path().join("run.mcap"), "angles")?;
    let epochs: Vec<u64> = rows.iter().filter_map(|row| row.stamp.as_ref()).map(|stamp| stamp.epoch).collect();
    assert!(epochs.windows(2).all(|pair| pair[1] == pair[0] || pair[1] == pair[0] + 1) && epochs.last() == Some(&1));
    let in_epoch_0 = rows.iter().filter(|row| row.stamp.as_ref().is_some_and(|stamp| stamp.epoch == 0));
    let last = in_epoch_0.filter_map(|row| row.stamp.as_ref()).map(|stamp| stamp.step).max();
    assert!(last <= Some(paused.effective_step - 1 + 250));
    let times = common::log_times(&folder.path().join("run.mcap"))?;
    assert!(times.windows(2).all(|pair| pair[0] <= pair[1]), "log time goes on through a reset");
    Ok(())
}

/// Little energy is in play in the first steps, so that their balance says little: a reset is followed by a status before them.
#[test]
fn regress_a_reset_raises_no_alarm() -> Outcome {
    let service = Service::start(SceneSource::open("crank-slider", &[])?, Pace::Factor(1.0), None, PublishRate::All)?;
    for _ in 0..5 {
        client::control(&service.client, &service.name, &control(Action::Reset(wire::Reset {})))?;
    }
    let (_, folder) = service.stop()?;
    let statuses = common::decoded::<wire::Status>(&folder.path().join("run.mcap"), "status")?;
    let first = |epoch| statuses.iter().find(|status| status.stamp.as_ref().is_some_and(|stamp| stamp.epoch == epoch));
    for epoch in 0..=5 {
        let first = first(epoch).ok_or("an epoch without a status")?;
        assert_eq!((first.stamp.as_ref().map(|stamp| stamp.step), first.message.as_str()), (Some(0), ""), "epoch {epoch}");
    }
    Ok(())
}

#[test]
fn prop_a_paused_run_takes_exactly_the_requested_steps() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let say = |action| client::control(&service.client, &service.name, &control(action));
    let listener = common::Listener::new(&service.client, &service.name)?;
    let last = || {
        let payloads = listener.payloads(Topic::Angles);
        let angles = payloads.last().and_then(|bytes| Angles::decode(bytes.as_slice()).ok());
        angles.and_then(|angles| angles.stamp).map_or(0, |stamp| stamp.step)
    };
    // The reply to a pause names the step after those that were taken.
    let mut at = say(Action::Pause(wire::Pause {}))?.effective_step;
    for count in [1, 7, 250, 3000] {
        say(Action::Step(wire::Steps { count }))?;
        let begun = Instant::now();
        while last() < at + count - 1 && begun.elapsed() < Duration::from_secs(20) {
            std::thread::yield_now();
        }
        at += count;
        for _ in 0..20 {
            assert_eq!(say(Action::Pause(wire::Pause {}))?.effective_step, at, "after {count} steps");
        }
    }
    service.stop()?;
    Ok(())
}

#[test]
fn regress_a_pause_cancels_the_steps_that_remain() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let say = |action| client::control(&service.client, &service.name, &control(action));
    say(Action::Pause(wire::Pause {}))?;
    assert!(say(Action::Step(wire::Steps { count: 1_000_000_000 }))?.accepted);
    let cancelled = say(Action::Pause(wire::Pause {}))?;
    assert!(cancelled.accepted && cancelled.reason.contains("the remaining steps are cancelled"), "{}", cancelled.reason);
    let again = say(Action::Pause(wire::Pause {}))?;
    assert_eq!((again.effective_step, again.reason.as_str()), (cancelled.effective_step, "was paused already"));
    service.stop()?;
    Ok(())
}

#[test]
fn regress_an_id_of_another_command_is_refused() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::All)?;
    assert!(client::pulse(&service.client, &service.name, &pulse("mine", 1.0, 0.1))?.accepted);
    let pause = wire::Control { id: "mine".to_owned(), action: Some(Action::Pause(wire::Pause {})) };
    let refused = client::control(&service.client, &service.name, &pause)?;
    assert!(!refused.accepted && refused.id == "mine" && refused.reason.contains("torque"), "{}", refused.reason);
    assert!(client::pulse(&service.client, &service.name, &pulse("mine", 1.0, 0.1))?.accepted, "a retry");
    let (_, folder) = service.stop()?;
    let status = common::decoded::<Status>(&folder.path().join("run.mcap"), "status")?;
    assert_eq!(status.last().map(|status| status.commands_rejected), Some(1));
    Ok(())
}

#[test]
fn prop_recordings_start_and_stop_by_name() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::Hz(200.0))?;
    let say = |action| client::control(&service.client, &service.name, &control(action));
    let start = |name: &str| Action::StartRecording(wire::StartRecording { name: name.to_owned() });
    assert!(!say(start("take-2"))?.accepted, "one is running already");
    assert!(say(Action::StopRecording(wire::StopRecording {}))?.accepted);
    assert!(!say(Action::StopRecording(wire::StopRecording {}))?.accepted);
    assert!(!say(start("../escape"))?.accepted);
    assert!(say(start("take-2"))?.accepted);
    let (report, folder) = service.stop()?;
    assert_eq!(report.recordings.len(), 2);
    for recording in report.recordings {
        assert!(recording?.messages > 0);
    }
    assert!(Messages::open(&folder.path().join("take-2.mcap"))?.next().is_some());
    Ok(())
}

/// The second recording begins in the middle of the run, the third at the start of an epoch.
#[test]
fn regress_the_status_names_the_recording_when_the_reply_has_come() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::Hz(200.0))?;
    let say = |action| client::control(&service.client, &service.name, &control(action));
    let recording = || -> Outcome<Option<String>> {
        let snapshot = client::snapshot(&service.client, &service.name).ok_or("no snapshot")?;
        Ok(snapshot.status.ok_or("no status")?.recording)
    };
    for name in ["second", "third"] {
        assert!(say(Action::StopRecording(wire::StopRecording {}))?.accepted);
        assert_eq!(recording()?, None);
        if name == "third" {
            assert!(say(Action::Pause(wire::Pause {}))?.accepted && say(Action::Reset(wire::Reset {}))?.accepted);
        }
        assert!(say(Action::StartRecording(wire::StartRecording { name: name.to_owned() }))?.accepted);
        assert_eq!(recording()?.map(|path| path.ends_with(&format!("{name}.mcap"))), Some(true), "{name}");
    }
    let (_, folder) = service.stop()?;
    for name in ["run.mcap", "second.mcap", "third.mcap"] {
        assert_eq!(verify(&RecordedSession::open(&folder.path().join(name))?, &|_, _| {})?.findings, [], "{name}");
    }
    Ok(())
}

#[test]
fn regress_a_refused_recording_command_is_not_counted_or_repeated_as_accepted() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::Hz(200.0))?;
    let start = Action::StartRecording(wire::StartRecording { name: "second".to_owned() });
    let command = wire::Control { id: "while recording".to_owned(), action: Some(start) };
    for attempt in ["first", "retry"] {
        let reply = client::control(&service.client, &service.name, &command)?;
        assert!(!reply.accepted && reply.reason.contains("already"), "{attempt}: {reply:?}");
    }
    let stop = wire::Control { id: "once".to_owned(), action: Some(Action::StopRecording(wire::StopRecording {})) };
    assert!(client::control(&service.client, &service.name, &stop)?.accepted);
    let retry = client::control(&service.client, &service.name, &stop)?;
    assert!(retry.accepted && retry.reason.contains("repetition"), "{retry:?}");
    let snapshot = || client::snapshot(&service.client, &service.name).and_then(|snapshot| snapshot.status);
    let status = std::iter::from_fn(|| Some(snapshot())).flatten().find(|status| status.recording.is_none());
    let counted = status.map(|status| (status.commands_accepted, status.commands_rejected));
    assert_eq!(counted, Some((1, 2)), "a repetition is neither");
    service.stop()?;
    Ok(())
}

#[test]
fn prop_a_cut_off_recording_is_read_up_to_the_cut() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Max, Some(5.0), PublishRate::All)?;
    let (_, folder) = service.finish()?;
    let whole = std::fs::read(folder.path().join("run.mcap"))?;
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &whole[..whole.len() * 2 / 3])?;
    let kept = Messages::open(&cut)?.filter(Result::is_ok).count();
    assert!(kept > 5_000, "{kept} messages before the cut");
    let tables = folder.path().join("tables");
    let exported =
        export(&cut, &Export { csv: Some(tables.clone()), parquet: Some(tables.clone()), ..Export::default() }, &|_| {})?;
    assert!(exported.cut_off && exported.tables.len() % 2 == 0);
    let parquet = std::fs::read(tables.join("flexcrank.test.loads.parquet"))?;
    assert!(parquet.starts_with(b"PAR1") && parquet.ends_with(b"PAR1") && parquet.len() > 100_000, "{} bytes", parquet.len());
    let energies = std::fs::read_to_string(tables.join("flexcrank.test.energies.csv"))?;
    let columns = "kinetic_j,work_in_j,dissipated_j,balance_error_j,energy_in_play_j";
    assert!(energies.lines().next().is_some_and(|line| line.ends_with(columns)) && energies.lines().count() > 1000);
    let header = std::fs::read_to_string(tables.join("flexcrank.test.loads.csv"))?;
    assert!(header.starts_with("log_time,publish_time,stamp.step,"));
    assert!(header.lines().next().is_some_and(|line| line.contains("joints.crank-pin.fx_n")));
    Ok(())
}

#[test]
fn prop_a_recording_is_never_overwritten() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Max, Some(0.01), PublishRate::All)?;
    let (_, folder) = service.finish()?;
    let again = Service::start_in(folder, scene(&[])?, Pace::Max, Some(0.01), PublishRate::All)?.finish();
    assert!(again.is_err_and(|error| error.to_string().contains("exists")));
    Ok(())
}

#[test]
fn prop_a_shadow_of_the_same_model_never_differs() -> Outcome {
    let scene = scene(&[])?;
    let shadow = flexcrank::runtime::ShadowSimulation::new(scene.scene.solver.model, Simulation::new(&scene.scene)?);
    let folder = tempfile::tempdir()?;
    let service = Service::start_with(
        folder,
        scene,
        Some(SecondRun::OtherModel(Box::new(shadow))),
        Pace::Factor(1.0),
        None,
        PublishRate::Hz(200.0),
    )?;
    client::pulse(&service.client, &service.name, &pulse("p", 5.0, 0.1))?;
    client::control(&service.client, &service.name, &control(Action::Reset(wire::Reset {})))?;
    client::pulse(&service.client, &service.name, &pulse("q", 5.0, 0.1))?;
    let (_, folder) = service.stop()?;
    let rows = common::decoded::<wire::Shadow>(&folder.path().join("run.mcap"), "shadow")?;
    assert!(rows.len() > 2);
    for row in rows {
        assert_eq!((row.angle_rad, row.end_x_m, row.joint_force_n), (0.0, 0.0, Some(0.0)));
        assert!(row.main_step_s >= 0.0 && row.shadow_step_s >= 0.0);
    }
    Ok(())
}

/// The difference is that of the same two simulations, run by themselves.
#[test]
fn val_a_shadow_differs_as_the_two_models_do() -> Outcome {
    let open = |model: &str, integrator: &str| {
        let keys = [format!("solver.model={model}"), format!("solver.integrator={integrator}"), "solver.step_s=0.001".to_owned()];
        SceneSource::open("crank-slider", &keys)
    };
    let (main, second) = (open("rigid", "runge-kutta")?, open("modal", "esdirk")?);
    let (mut rigid, mut modal) = (Simulation::new(&main.scene)?, Simulation::new(&second.scene)?);
    let shadow = flexcrank::runtime::ShadowSimulation::new(second.scene.solver.model, Simulation::new(&second.scene)?);
    let service = Service::start_with(
        tempfile::tempdir()?,
        main,
        Some(SecondRun::OtherModel(Box::new(shadow))),
        Pace::Max,
        Some(1.0),
        PublishRate::Hz(100.0),
    )?;
    let (_, folder) = service.finish()?;
    let rows = common::decoded::<wire::Shadow>(&folder.path().join("run.mcap"), "shadow")?;
    assert_eq!((rows.len(), rows[0].model.as_str()), (101, "modal"));
    for row in &rows {
        while rigid.step_count() < row.stamp.ok_or("no stamp")?.step {
            rigid.step()?;
            modal.step()?;
        }
        let [one, other] = [rigid.observe()?, modal.observe()?];
        let angle_rad = other.links[0].chord_rad - one.links[0].chord_rad;
        let end_x_m =
            |seen: &flexcrank::mechanics::Observation| seen.links[1].nodes.last().map_or(0.0, |node| node.position_m[0]);
        assert_eq!((row.angle_rad, row.end_x_m), (angle_rad, end_x_m(other) - end_x_m(one)), "{:?}", row.stamp);
    }
    let last = rows.last().ok_or("no rows")?;
    assert!(last.angle_rad.abs() > 1e-4 && last.joint_force_n > Some(1.0), "{last:?}");
    Ok(())
}

#[test]
fn prop_a_model_out_of_its_range_warns() -> Outcome {
    let scene = flexcrank::scene::SceneSource::open("ref-r4m", &["solver.model=modal".to_owned()])?;
    let (_, folder) = Service::start(scene, Pace::Max, Some(1.0), PublishRate::Hz(200.0))?.finish()?;
    let status = common::decoded::<Status>(&folder.path().join("run.mcap"), "status")?;
    assert!(
        status.last().is_some_and(|last| last.message.contains("out of the model's range: a link was bent by")),
        "{status:?}"
    );
    Ok(())
}
