//! Resumed sessions, and what-if.
#![allow(clippy::expect_used, reason = "a test may fail")]

mod common;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use common::{Outcome, Service};
use flexcrank::bus::{Topic, client};
use flexcrank::recording::{Messages, Split};
use flexcrank::resimulation::{AddedPulse, Change, RecordedSession, ResimulationError, Resumed, resume, verify, what_if};
use flexcrank::runtime::Pace;
use flexcrank::scene::{SceneSource, builtin};
use flexcrank::service::Resumption;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{self, Angles, Displacements, Energies, Loads, TorquePulse, control::Action};

type Telemetry = BTreeMap<(String, u64, u64), (u64, Vec<u8>)>;

/// Log time and payload, but for the wall clock, by topic, epoch and step.
fn telemetry(file: &Path) -> Result<Telemetry, Box<dyn std::error::Error>> {
    fn timeless<M: prost::Message + Default>(
        data: &[u8],
        stamp: fn(&mut M) -> &mut Option<flexcrank::wire::Stamp>,
    ) -> (u64, u64, Vec<u8>) {
        let mut message = M::decode(data).expect("a message");
        let (epoch, step) = stamp(&mut message)
            .as_mut()
            .map(|stamp| {
                stamp.wall_time = None;
                (stamp.epoch, stamp.step)
            })
            .expect("a stamp");
        (epoch, step, message.encode_to_vec())
    }
    let mut found = BTreeMap::new();
    for message in Messages::open(file)? {
        // A recording that was cut ends with an error.
        let Ok(message) = message else { break };
        let topic = message.channel.topic.rsplit('/').next().unwrap_or_default().to_owned();
        let (epoch, step, payload) = match topic.as_str() {
            "displacements" => timeless::<Displacements>(&message.data, |m| &mut m.stamp),
            "angles" => timeless::<Angles>(&message.data, |m| &mut m.stamp),
            "loads" => timeless::<Loads>(&message.data, |m| &mut m.stamp),
            "energies" => timeless::<Energies>(&message.data, |m| &mut m.stamp),
            _ => continue,
        };
        found.insert((topic, epoch, step), (message.log_time, payload));
    }
    Ok(found)
}

/// A run of the default scene to t = 3.1 s, with pulses commanded for later; its recording is in `run.mcap`. In lock-step, so that the
/// pulses come at the same steps on every machine.
fn commanded() -> Result<tempfile::TempDir, Box<dyn std::error::Error>> {
    let scene = SceneSource::open("crank-slider", &["solver.step_s=0.001".to_owned()])?;
    let service = Service::start_as(tempfile::tempdir()?, scene, Pace::Lockstep, None, |live| {
        live.stepping.publish = PublishRate::Hz(170.0).into();
        // Many chunks, which a file is cut between.
        live.flush_period = Duration::from_millis(1);
    })?;
    for (torque_nm, delay_s, steps) in [(5.0, 0.0, 13), (-3.0, 1.3333, 50), (2.0, 2.2, 37), (1.0, 100.0, 3000)] {
        let pulse = TorquePulse { id: format!("{delay_s}"), torque_nm, duration_s: 0.3, delay_s, ..TorquePulse::default() };
        assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
        let advance = wire::Advance { steps, ..wire::Advance::default() };
        let answer = client::advance(&service.client, &service.name, &advance, Duration::from_secs(60))?;
        assert!(answer.reply.is_some_and(|reply| reply.accepted));
    }
    Ok(service.stop()?.1)
}

#[test]
fn prop_a_resumed_session_equals_an_uninterrupted_one_to_the_bit() -> Outcome {
    let folder = commanded()?;
    let straight = telemetry(&folder.path().join("run.mcap"))?;
    let whole = std::fs::read(folder.path().join("run.mcap"))?;
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &whole[..whole.len() / 2])?;
    let source = RecordedSession::open(&cut)?;
    for at_s in [None, Some(0.7771)] {
        let Resumed { simulation, epoch_start_s, answers, missing, .. } = resume(&source, at_s, &|_| {})?;
        // To four pulses and four advances.
        assert!(simulation.step_count() > 300 && answers.len() == 8);
        assert!(at_s.is_none_or(|at_s| (simulation.time_s() - at_s).abs() < 0.001));
        let (from, pending) = (simulation.step_count(), simulation.pulses_pending());
        let resumption =
            Resumption { started: source.started, epoch_start_s, level: 0, answers, missing, of: "cut.mcap".to_owned() };
        let until_s = straight.keys().map(|(_, _, step)| *step).max().unwrap_or(0) as f64 * 0.001;
        let service = Service::resume(source.scene.clone(), simulation, resumption, until_s, PublishRate::Hz(170.0))?;
        let (report, folder) = service.finish()?;
        assert_eq!(report.dropped, 0);
        let resumed = telemetry(&folder.path().join("run.mcap"))?;
        assert!(pending > 0 && resumed.len() > 300);
        // The last sample of either run may be off the rate, and its mean torque of a shorter time.
        let last = straight.keys().map(|(_, _, step)| *step).max();
        for (key, value) in resumed.iter().filter(|((_, _, step), _)| Some(*step) != last) {
            assert!(key.2 >= from, "{key:?}");
            assert_eq!(straight.get(key), Some(value), "{key:?}");
        }
        let found = verify(&RecordedSession::open(&folder.path().join("run.mcap"))?, &|_, _| {})?;
        assert_eq!(found.findings, []);
    }
    let outside = resume(&source, Some(1e6), &|_| {});
    assert!(matches!(outside, Err(ResimulationError::Outside { .. })));
    Ok(())
}

/// A crash cuts a recording off between chunks, which end anywhere between the topics of an instant: its sample was in neither file.
#[test]
fn regress_every_sample_of_a_session_is_in_its_cut_recording_or_in_the_resumed_one() -> Outcome {
    let folder = commanded()?;
    let file = folder.path().join("run.mcap");
    let (straight, whole) = (telemetry(&file)?, std::fs::read(&file)?);
    let last = straight.keys().map(|(_, _, step)| *step).max();
    let cut = folder.path().join("cut.mcap");
    let mut partial = 0;
    for part in 2..10 {
        std::fs::write(&cut, &whole[..whole.len() * part / 10])?;
        let source = RecordedSession::open(&cut)?;
        let Resumed { simulation, epoch_start_s, answers, missing, .. } = resume(&source, None, &|_| {})?;
        partial += u32::from(missing != false.into());
        let resumption =
            Resumption { started: source.started, epoch_start_s, level: 0, answers, missing, of: "cut.mcap".to_owned() };
        let service = Service::resume(source.scene.clone(), simulation, resumption, 3.1, PublishRate::Hz(170.0))?;
        let (_, resumed) = service.finish()?;
        let resumed = resumed.path().join("run.mcap");
        assert_eq!(verify(&RecordedSession::open(&resumed)?, &|_, _| {})?.findings, []);
        let (before, after) = (telemetry(&cut)?, telemetry(&resumed)?);
        for (key, value) in straight.iter().filter(|((_, _, step), _)| Some(*step) != last) {
            let found = [before.get(key), after.get(key)];
            assert!(found == [Some(value), None] || found == [None, Some(value)], "{part}: {key:?}, {found:?}");
        }
    }
    assert!(partial > 0, "no cut lay between the topics of an instant");
    Ok(())
}

#[test]
fn prop_what_if_equals_a_session_recorded_with_the_change() -> Outcome {
    let run = |overrides: &[&str]| {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        let scene = SceneSource::open("crank-slider", &overrides)?;
        Service::start(scene, Pace::Max, Some(13.0), PublishRate::Hz(50.0))?.finish()
    };
    let (_, was) = run(&["pulse=[{start_s=0.0, torque_nm=20.0, duration_s=0.1}]"])?;
    let (_, with) =
        run(&["pulse=[{start_s=0.0, torque_nm=20.0, duration_s=0.1}, {start_s=12.0, torque_nm=5.0, duration_s=0.1}]"])?;
    let source = RecordedSession::open(&was.path().join("run.mcap"))?;
    let attempt = |change: Change, name: &str| what_if(&source, &change, &was.path().join(name), &|_| {});
    let pulse = AddedPulse { start_s: 12.0, torque_nm: 5.0, duration_s: 0.1 };
    let added = attempt(Change { pulses: vec![pulse], ..Change::default() }, "added.mcap")?;
    assert!(added.diverged.is_none() && added.from_s >= 10.0 && added.from_s < 12.0, "{added:?}");
    assert_eq!(added.deviation.first.as_ref().map(|first| first.instant), Some((0, 6_010)));
    assert!(added.deviation.largest["crank angle, rad"].value > 1e-3 && added.deviation.largest["total energy, J"].value > 0.1);
    let (expected, computed) = (telemetry(&with.path().join("run.mcap"))?, telemetry(&was.path().join("added.mcap"))?);
    assert!(computed.len() > 400);
    for (key, (_, payload)) in &computed {
        assert_eq!(expected.get(key).map(|(_, payload)| payload), Some(payload), "{key:?}");
    }
    let thicker =
        attempt(Change { overrides: vec!["rod.density_kg_per_m3=7701.0".to_owned()], ..Change::default() }, "thicker.mcap")?;
    assert_eq!(thicker.deviation.first.map(|first| first.instant), Some((0, 10)));
    let same = attempt(Change { overrides: vec!["rod.length_m=1.5".to_owned()], ..Change::default() }, "same.mcap")?;
    assert_eq!(same.deviation.first, None);
    for name in ["added.mcap", "thicker.mcap", "same.mcap"] {
        assert_eq!(verify(&RecordedSession::open(&was.path().join(name))?, &|_, _| {})?.findings, [], "{name}");
    }
    let late = Change { pulses: vec![AddedPulse { start_s: 14.0, ..pulse }], ..Change::default() };
    assert!(matches!(attempt(late, "late.mcap"), Err(ResimulationError::Outside { .. })));
    Ok(())
}

/// The second part of a split recording begins seconds after its session.
#[test]
fn regress_an_instant_before_a_recording_is_refused_with_its_beginning() -> Outcome {
    let service = Service::start_as(tempfile::tempdir()?, common::scene(&[])?, Pace::Max, Some(25.0), |live| {
        live.split = Some(Split::Time(Duration::from_secs(2)));
    })?;
    let (_, folder) = service.finish()?;
    let file = folder.path().join("run-002.mcap");
    let source = RecordedSession::open(&file)?;
    let pulses = vec![AddedPulse { start_s: 0.5, torque_nm: 1.0, duration_s: 0.1 }];
    let what_if = what_if(&source, &Change { pulses, ..Change::default() }, &folder.path().join("what-if.mcap"), &|_| {});
    for refused in [resume(&source, Some(0.5), &|_| {}).err(), what_if.err()] {
        let refused = refused.ok_or("not refused")?;
        let said = refused.to_string();
        let ResimulationError::Before { first_s, .. } = refused else { return Err(said.into()) };
        assert!(first_s >= 2.0 && said.contains(": t = 0.5 s is not in the recording, which begins at "), "{said}");
        let begun = resume(&source, Some(first_s), &|_| {})?;
        assert!((begun.simulation.time_s() - first_s).abs() < 1e-6, "{first_s} s");
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["run", "--no-bus", "--no-record", "--until", "25", "--at", "0.5", "--resume"]).arg(&file);
    let ended = command.stdin(Stdio::null()).output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert!(ended.status.code() == Some(2) && said.contains("which begins at "), "{said}");
    Ok(())
}

/// The step of the first level was stated.
#[test]
fn regress_a_coarse_level_is_named_in_the_heading_of_a_resumed_session_and_in_figures() -> Outcome {
    let text = builtin::find("crank-slider")?.text;
    let levels = "\n[[level]]\nname = \"fine\"\n\n[[level]]\nname = \"coarse\"\nchanges = [\"solver.step_s=0.004\"]\n";
    let leveled = SceneSource::parse("leveled.toml", &format!("{text}{levels}"), &[])?;
    let service = Service::start(leveled, Pace::Factor(20.0), None, PublishRate::Hz(200.0))?;
    let listener = common::Listener::new(&service.client, &service.name)?;
    let level = wire::Control { id: String::new(), action: Some(Action::Level(wire::Level { name: "coarse".to_owned() })) };
    assert!(client::control(&service.client, &service.name, &level)?.accepted);
    listener.wait_for(Topic::Angles, 100, Duration::from_secs(60))?;
    let (_, folder) = service.stop()?;
    let ends_s = resume(&RecordedSession::open(&folder.path().join("run.mcap"))?, None, &|_| {})?.simulation.time_s();
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["run", "--no-bus", "--no-record", "--pace", "max", "--resume", "run.mcap", "--until"]);
    let ended = command.arg((ends_s + 0.1).to_string()).current_dir(folder.path()).stdin(Stdio::null()).output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert!(said.contains(": level coarse, modal model, esdirk, step 0.004 s; not on the bus; not recorded\n"), "{said}");
    let drawn = Command::new(env!("CARGO_BIN_EXE_flexcrank"))
        .args(["plot", "run.mcap", "--y", "crank.rate_rad_per_s", "-o", "rate.svg"])
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .output()?;
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    assert!(std::fs::read_to_string(folder.path().join("rate.svg"))?.contains("level coarse"));
    Ok(())
}

/// The session goes on when its recording has stopped, and a crash throws it back to there.
#[test]
fn regress_a_recording_that_may_stop_under_a_supervisor_is_told() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["run", "--supervise", "--no-bus", "--pace", "max", "--until", "0.1", "--record", "run.mcap"]);
    let ended = command.args(["--max-recording-size", "100MB"]).current_dir(folder.path()).stdin(Stdio::null()).output()?;
    let said = String::from_utf8(ended.stderr)?;
    let warning = "once --max-recording-size has stopped the recording, --supervise brings the session back to there";
    assert!(ended.status.code() == Some(0) && said.matches(warning).count() == 1, "{said}");
    Ok(())
}

/// In lock-step, a session ends where it began if nobody asks for a step.
#[test]
fn regress_a_what_if_of_a_single_instant_does_not_blame_the_steps() -> Outcome {
    let service = Service::start(common::scene(&[])?, Pace::Lockstep, None, PublishRate::Hz(200.0))?;
    let (_, folder) = service.stop()?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["what-if", "run.mcap", "--set", "solver.balance_tolerance=0.05", "--record", "changed.mcap"]);
    let ended = command.current_dir(folder.path()).stdin(Stdio::null()).output()?;
    let printed = String::from_utf8(ended.stdout)?;
    let last = Some("only the beginning was compared: the recording has no later sample");
    assert_eq!((ended.status.code(), printed.lines().last()), (Some(0), last), "{printed}");
    Ok(())
}

/// An oscillator has displacements, and no angles. Longer steps reach every second sample.
#[test]
fn regress_a_what_if_counts_the_samples_of_an_oscillator() -> Outcome {
    let oscillator = SceneSource::open("thesis-two-masses", &[])?;
    let step_s = oscillator.scene.solver.step_s;
    let (_, folder) = Service::start(oscillator, Pace::Max, Some(20.0 * step_s), PublishRate::All)?.finish()?;
    let change = Change { overrides: vec![format!("solver.step_s={}", 2.0 * step_s)], ..Change::default() };
    let source = RecordedSession::open(&folder.path().join("run.mcap"))?;
    let samples = what_if(&source, &change, &folder.path().join("changed.mcap"), &|_| {})?.samples;
    assert_eq!((samples.all, samples.left_out), (21, 10));
    Ok(())
}
