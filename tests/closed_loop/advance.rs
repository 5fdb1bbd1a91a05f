//! Lock-step: `advance`, its answers, refusals and recordings.

use std::path::Path;
use std::time::{Duration, Instant};

use flexcrank::bus::{Session, client};
use flexcrank::recording::Messages;
use flexcrank::resimulation::{Change, RecordedSession, resume, verify, what_if};
use flexcrank::runtime::Pace;
use flexcrank::scene::SceneSource;
use flexcrank::service::Resumption;
use flexcrank::simulation::{PublishRate, Simulation};
use flexcrank::wire::{
    self, Advance, AdvanceReply, Angles, AppliedCommand, Displacements, Energies, Loads, Stamp, control::Action,
};
use sha2::{Digest as _, Sha256};

use crate::common::{self, Outcome, Service, scene};

const PATIENCE: Duration = Duration::from_secs(20);

fn message(id: &str, torque_nm: impl Into<Option<f64>>, steps: u64) -> Advance {
    Advance { id: id.to_owned(), torque_nm: torque_nm.into(), steps }
}

fn advance(service: &Service, id: &str, torque_nm: impl Into<Option<f64>>, steps: u64) -> Outcome<AdvanceReply> {
    Ok(client::advance(&service.client, &service.name, &message(id, torque_nm, steps), PATIENCE)?)
}

fn control(service: &Service, action: Action) -> Outcome<wire::CommandReply> {
    let control = wire::Control { id: String::new(), action: Some(action) };
    Ok(client::control(&service.client, &service.name, &control)?)
}

fn reply(answer: &AdvanceReply) -> wire::CommandReply {
    answer.reply.clone().unwrap_or_default()
}

fn step_of(answer: &AdvanceReply) -> Option<u64> {
    answer.energies.as_ref()?.stamp.map(|stamp| stamp.step)
}

fn lockstep(overrides: &[&str]) -> Outcome<Service> {
    let service = Service::start(scene(overrides)?, Pace::Lockstep, None, PublishRate::All)?;
    Ok(service)
}

fn assert_verified(file: &Path) -> Outcome {
    let found = verify(&RecordedSession::open(file)?, &|_, _| {})?;
    assert_eq!(found.findings, [], "{}", file.display());
    assert_eq!(found.recomputed.skipped, 0);
    Ok(())
}

#[test]
fn regress_verify_counts_the_advances() -> Outcome {
    let service = lockstep(&["pulse=[]"])?;
    for steps in 1..=5 {
        assert!(reply(&advance(&service, "", 0.1, steps)?).accepted);
    }
    let (_, folder) = service.stop()?;
    let found = verify(&RecordedSession::open(&folder.path().join("run.mcap"))?, &|_, _| {})?;
    assert_eq!((found.recomputed.advances, found.recomputed.pulses, found.findings), (5, 0, vec![]));
    Ok(())
}

/// The state after the steps is that of a simulation stepped by hand, to the bit.
#[test]
fn val_an_advance_answers_with_the_state_after_its_steps() -> Outcome {
    for (name, model) in [("crank-slider", "rigid"), ("crank-slider", "modal"), ("ref-r2s", "finite-element")] {
        let mut overrides = vec![format!("solver.model={model}")];
        overrides.extend((model == "rigid").then(|| "solver.integrator=runge-kutta".to_owned()));
        let scene = SceneSource::open(name, &overrides)?;
        let mut by_hand = Simulation::new(&scene.scene)?;
        let service = Service::start(scene.clone(), Pace::Factor(1.0), None, PublishRate::Hz(200.0))?;
        control(&service, Action::Pause(wire::Pause {}))?;
        control(&service, Action::Reset(wire::Reset {}))?;
        for (torque_nm, steps) in [(Some(1.5), 1), (Some(-0.5), 7), (None, 3), (Some(0.25), 200)] {
            let answer = advance(&service, "", torque_nm, steps)?;
            assert!(reply(&answer).accepted, "{name} {model}: {}", reply(&answer).reason);
            assert_eq!(reply(&answer).effective_step, by_hand.step_count() + 1);
            if let Some(torque_nm) = torque_nm {
                by_hand.set_torque_for(torque_nm, steps)?;
            }
            by_hand.take_mean_torque_nm();
            for _ in 0..steps {
                by_hand.step()?;
            }
            let seen = by_hand.observe()?.clone();
            let angles = answer.angles.clone().ok_or("no angles")?;
            let loads = answer.loads.clone().ok_or("no loads")?;
            assert_eq!(angles.stamp.map(|stamp| (stamp.epoch, stamp.step)), Some((1, by_hand.step_count())));
            for (link, observed) in angles.links.iter().zip(&seen.links) {
                assert_eq!((link.chord_rad, link.rate_rad_per_s), (observed.chord_rad, observed.rate_rad_per_s));
            }
            let crank_pin = loads.joints.iter().find(|joint| joint.joint == "crank-pin").map(|joint| [joint.fx_n, joint.fy_n]);
            assert_eq!(crank_pin, seen.crank_pin_n);
            assert_eq!(answer.energies.as_ref().and_then(|energies| energies.work_in_j), Some(by_hand.ledger().work_in_j));
            let mean_nm = by_hand.take_mean_torque_nm();
            assert!((loads.driving_torque_nm - mean_nm).abs() <= 1e-15 * mean_nm.abs(), "{loads:?} {mean_nm}");
        }
        let (_, folder) = service.stop()?;
        assert_verified(&folder.path().join("run.mcap"))?;
    }
    Ok(())
}

#[test]
fn prop_an_oscillator_answers_with_displacements() -> Outcome {
    let scene = SceneSource::open("thesis-two-masses", &[])?;
    let service = Service::start(scene, Pace::Lockstep, None, PublishRate::All)?;
    let answer = advance(&service, "", None, 10)?;
    assert_eq!((answer.angles, answer.loads, answer.displacements.as_ref().map(|all| all.nodes.len())), (None, None, Some(2)));
    let pushed = advance(&service, "", 1.0, 1)?;
    assert!(reply(&pushed).reason.contains("[oscillator]"), "{pushed:?}");
    let (_, folder) = service.stop()?;
    assert_verified(&folder.path().join("run.mcap"))
}

#[test]
fn prop_an_advance_is_refused_with_its_reason() -> Outcome {
    let service = Service::start(scene(&["pulse=[]"])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let running = advance(&service, "", 1.0, 1)?;
    assert!(!reply(&running).accepted && reply(&running).reason.contains("pause first"), "{running:?}");
    control(&service, Action::Pause(wire::Pause {}))?;
    for (torque_nm, steps, word) in [
        (None, 0, "steps = 0"),
        (None, 1 << 63, "steps = 9223372036854775808"),
        (None, 1_000_000_001, "steps = 1000000001"),
        (Some(f64::NAN), 1, "finite"),
        (Some(1e9), 1, "commands.torque_limit_nm"),
    ] {
        let answer = advance(&service, "bad", torque_nm, steps)?;
        assert!(!reply(&answer).accepted && reply(&answer).reason.contains(word), "{torque_nm:?} {steps}: {answer:?}");
        assert_eq!(AdvanceReply { reply: None, ..answer }, AdvanceReply::default(), "a refusal has no state");
    }
    let after = control(&service, Action::Pause(wire::Pause {}))?;
    assert_eq!(after.reason, "was paused already", "no step is pending");
    let stepping = lockstep(&["drive.speed_rad_per_s=5", "pulse=[]"])?;
    let driven = advance(&stepping, "", 1.0, 1)?;
    assert!(!reply(&driven).accepted && reply(&driven).reason.contains("[drive]"), "{driven:?}");
    assert!(reply(&advance(&stepping, "", None, 5)?).accepted);
    let resumed = control(&stepping, Action::Resume(wire::Resume {}))?;
    assert!(!resumed.accepted && resumed.reason.contains("lockstep"), "{resumed:?}");
    for service in [service, stepping] {
        let (_, folder) = service.stop()?;
        assert_verified(&folder.path().join("run.mcap"))?;
    }
    Ok(())
}

#[test]
fn prop_a_retry_gets_the_stored_answer_and_changes_nothing() -> Outcome {
    let service = lockstep(&["pulse=[]"])?;
    let first = advance(&service, "once", 1.0, 10)?;
    let next = advance(&service, "next", 2.0, 10)?;
    let again = advance(&service, "once", 1.0, 10)?;
    assert!(reply(&again).reason.contains("repetition"), "{again:?}");
    assert_eq!(AdvanceReply { reply: None, ..again }, AdvanceReply { reply: None, ..first });
    let last = advance(&service, "", None, 1)?;
    assert_eq!((step_of(&next), step_of(&last)), (Some(20), Some(21)));
    // A retry that comes while the first is under way gets its answer, too.
    let slow = |session: &Session| client::advance(session, &service.name, &message("slow", 0.1, 200_000), PATIENCE);
    let [one, other] = std::thread::scope(|scope| {
        let one = scope.spawn(|| slow(&service.client));
        std::thread::sleep(Duration::from_millis(30));
        let other = scope.spawn(|| slow(&service.client));
        [one.join(), other.join()]
    });
    let (one, other) = (one.map_err(|_| "panicked")??, other.map_err(|_| "panicked")??);
    assert_eq!((step_of(&one), one.angles), (Some(200_021), other.angles));
    let (_, folder) = service.stop()?;
    assert_eq!(common::decoded::<AppliedCommand>(&folder.path().join("run.mcap"), "commands")?.len(), 5);
    Ok(())
}

#[test]
fn prop_two_clients_take_turns() -> Outcome {
    let service = lockstep(&["pulse=[]"])?;
    let steps: Vec<Option<u64>> = std::thread::scope(|scope| {
        let client = |count: u64| {
            let service = &service;
            scope.spawn(move || {
                (0..100).map(|_| advance(service, "", 0.1, count).ok().as_ref().and_then(step_of)).collect::<Vec<_>>()
            })
        };
        let clients = [client(3), client(7)];
        clients.into_iter().flat_map(|client| client.join().unwrap_or_default()).collect()
    });
    assert_eq!(steps.len(), 200);
    assert!(steps.iter().all(Option::is_some));
    assert_eq!(steps.iter().max(), Some(&Some(1000)));
    let (_, folder) = service.stop()?;
    assert_verified(&folder.path().join("run.mcap"))
}

#[test]
fn prop_commands_wait_for_the_advance_and_a_pause_cuts_it_short() -> Outcome {
    let service = lockstep(&["pulse=[]"])?;
    let (long, after) = std::thread::scope(|scope| {
        let long = scope.spawn(|| advance(&service, "long", 0.1, 1_000_000_000).map_err(|error| error.to_string()));
        std::thread::sleep(Duration::from_millis(50));
        let reset = scope.spawn(|| control(&service, Action::Reset(wire::Reset {})).map_err(|error| error.to_string()));
        std::thread::sleep(Duration::from_millis(50));
        let paused = control(&service, Action::Pause(wire::Pause {})).map_err(|error| error.to_string());
        assert!(paused.is_ok_and(|paused| paused.reason.contains("cancelled")));
        (long.join(), reset.join())
    });
    let long = long.map_err(|_| "panicked")??;
    assert!(reply(&long).reason.starts_with("cut short by a pause after "), "{long:?}");
    assert!(step_of(&long).is_some_and(|step| step > 100));
    let reset = after.map_err(|_| "panicked")??;
    assert_eq!((reset.accepted, reset.effective_step), (true, 1), "it waited for the end");
    let next = advance(&service, "", None, 2)?;
    assert_eq!(next.energies.as_ref().and_then(|energies| energies.stamp).map(|stamp| (stamp.epoch, stamp.step)), Some((1, 2)));
    let (_, folder) = service.stop()?;
    assert_verified(&folder.path().join("run.mcap"))
}

/// An answer must not wait for the next status.
#[test]
fn regress_an_answer_comes_at_once() -> Outcome {
    let service = lockstep(&["pulse=[]"])?;
    let begun = Instant::now();
    for _ in 0..500 {
        advance(&service, "", 0.0, 1)?;
    }
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed() / 500);
    service.stop()?;
    Ok(())
}

/// A payload without its wall time.
fn timeless<M: prost::Message + Default>(data: &[u8], stamp: fn(&mut M) -> &mut Option<Stamp>) -> Outcome<Vec<u8>> {
    let mut message = M::decode(data)?;
    if let Some(stamp) = stamp(&mut message) {
        stamp.wall_time = None;
    }
    Ok(message.encode_to_vec())
}

/// SHA-256 over all telemetry payloads of a recording, without their wall time.
fn digest(file: &Path) -> Outcome<(usize, String)> {
    let (mut count, mut sha) = (0, Sha256::new());
    for message in Messages::open(file)? {
        let message = message?;
        let payload = match message.channel.topic.rsplit('/').next().unwrap_or_default() {
            "displacements" => timeless::<Displacements>(&message.data, |m| &mut m.stamp)?,
            "angles" => timeless::<Angles>(&message.data, |m| &mut m.stamp)?,
            "loads" => timeless::<Loads>(&message.data, |m| &mut m.stamp)?,
            "energies" => timeless::<Energies>(&message.data, |m| &mut m.stamp)?,
            _ => continue,
        };
        count += 1;
        sha.update(payload);
    }
    Ok((count, sha.finalize().iter().map(|byte| format!("{byte:02x}")).collect()))
}

/// A control loop in lock-step with two episodes; the client waits at random, by `seed`.
fn episodes(seed: u64) -> Outcome<tempfile::TempDir> {
    let scene = SceneSource::open("crank-slider", &["pulse=[]".to_owned()])?;
    let service = Service::start(scene, Pace::Lockstep, None, PublishRate::All)?;
    let (mut random, mut rate) = (seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1, 0.0);
    for n in 0..60_u64 {
        let torque_nm = (2.0_f64 * (5.0 - rate)).clamp(-4.0, 4.0);
        let answer = advance(&service, "", torque_nm, 1 + n % 4)?;
        rate = answer.angles.and_then(|angles| angles.links.first().map(|crank| crank.rate_rad_per_s)).ok_or("no angles")?;
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        std::thread::sleep(Duration::from_micros(random % 3000));
        if n == 30 {
            control(&service, Action::Reset(wire::Reset {}))?;
        }
    }
    Ok(service.stop()?.1)
}

#[test]
fn prop_lock_step_does_not_depend_on_when_the_client_asks() -> Outcome {
    let runs: usize = std::env::var("FLEXCRANK_LOCKSTEP_RUNS").ok().and_then(|runs| runs.parse().ok()).unwrap_or(10);
    let (mut first, mut last) = (None, None);
    for seed in 0..runs as u64 {
        let folder = episodes(seed)?;
        let file = folder.path().join("run.mcap");
        assert_verified(&file)?;
        let digest = digest(&file)?;
        assert!(digest.0 > 500);
        assert_eq!(first.get_or_insert(digest.clone()), &digest, "run {seed}");
        last = Some(folder);
    }
    let folder = last.ok_or("no run")?;
    let source = RecordedSession::open(&folder.path().join("run.mcap"))?;
    let change = Change { overrides: vec!["rod.length_m=1.5".to_owned()], ..Change::default() };
    assert_eq!(what_if(&source, &change, &folder.path().join("same.mcap"), &|_| {})?.deviation.first, None);
    assert_verified(&folder.path().join("same.mcap"))
}

#[test]
fn prop_a_lock_step_session_is_resumed_to_the_bit() -> Outcome {
    let mut states = Vec::new();
    for interrupted in [false, true] {
        let mut service = lockstep(&["pulse=[]"])?;
        for n in 0..20_u32 {
            if interrupted && n == 10 {
                let (_, folder) = service.stop()?;
                let source = RecordedSession::open(&folder.path().join("run.mcap"))?;
                let resumed = resume(&source, None, &|_| {})?;
                let resumption = Resumption {
                    started: source.started,
                    level: 0,
                    epoch_start_s: resumed.epoch_start_s,
                    answers: resumed.answers,
                    missing: resumed.missing,
                    of: "run.mcap".to_owned(),
                };
                service = Service::resume_in_lockstep(source.scene.clone(), resumed.simulation, resumption)?;
            }
            let answer = advance(&service, "", (n % 3 != 0).then_some(0.1 * f64::from(n)), 5)?;
            assert_eq!(step_of(&answer), Some(5 * (u64::from(n) + 1)));
            if n == 19 {
                states.push((answer.angles.map(|angles| angles.links), answer.loads.map(|loads| loads.joints)));
            }
        }
        let (_, folder) = service.stop()?;
        assert_verified(&folder.path().join("run.mcap"))?;
    }
    assert!(states[0].0.is_some());
    assert_eq!(states[0], states[1]);
    Ok(())
}
