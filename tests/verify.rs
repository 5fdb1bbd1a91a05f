//! Recordings of real services, verified: whole, cut, damaged, changed.
#![allow(clippy::expect_used, reason = "a test may fail")]

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::rewritten::{as_is, rewritten, rewritten_with_rates};
use common::{Outcome, Service, scene};
use flexcrank::bus::client;
use flexcrank::recording::{Export, RecordedMessage, export, recover};
use flexcrank::resimulation::{AddedPulse, Change, Finding, LossReason, RecordedSession, Verification, resume, verify, what_if};
use flexcrank::runtime::Pace;
use flexcrank::scene::SceneSource;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{self, AppliedCommand, Energies, Status, TorquePulse, applied_command, control::Action};
use prost::Message as _;

fn pulse(torque_nm: f64, duration_s: f64, delay_s: f64) -> TorquePulse {
    TorquePulse { id: format!("{torque_nm}:{delay_s}"), torque_nm, duration_s, delay_s, ..TorquePulse::default() }
}

fn control(action: Action) -> wire::Control {
    wire::Control { id: String::new(), action: Some(action) }
}

fn verified(file: &Path) -> Result<Verification, Box<dyn std::error::Error>> {
    Ok(verify(&RecordedSession::open(file)?, &|_, _| {})?)
}

/// A recording of 25 s with commands of every kind, at the modal model's default settings.
fn eventful(folder: tempfile::TempDir, rate: PublishRate) -> Result<(tempfile::TempDir, PathBuf), Box<dyn std::error::Error>> {
    let scene = SceneSource::open("crank-slider", &["pulse=[]".to_owned()])?;
    let service = Service::start_in(folder, scene, Pace::Factor(20.0), None, rate)?;
    let say = |action| client::control(&service.client, &service.name, &control(action));
    for (torque_nm, delay_s) in [(5.0, 0.0), (-3.0, 0.3333), (2.0, 0.01), (7.0, 30.0)] {
        assert!(client::pulse(&service.client, &service.name, &pulse(torque_nm, 0.123, delay_s))?.accepted);
    }
    say(Action::Pause(wire::Pause {}))?;
    say(Action::Step(wire::Steps { count: 7 }))?;
    say(Action::Resume(wire::Resume {}))?;
    say(Action::Reset(wire::Reset {}))?;
    assert!(client::pulse(&service.client, &service.name, &pulse(4.0, 0.2, 0.1))?.accepted);
    let second = wire::StartRecording { name: "second".to_owned() };
    say(Action::StopRecording(wire::StopRecording {}))?;
    assert!(client::pulse(&service.client, &service.name, &pulse(3.0, 5.0, 0.05))?.accepted);
    assert!(say(Action::StartRecording(second))?.accepted);
    assert!(client::pulse(&service.client, &service.name, &pulse(-1.0, 0.5, 0.02))?.accepted);
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    Ok((folder, file))
}

#[test]
fn prop_a_recording_is_computed_again_to_the_bit() -> Outcome {
    for rate in [PublishRate::All, PublishRate::Hz(200.0), PublishRate::Hz(37.0)] {
        let (folder, file) = eventful(tempfile::tempdir()?, rate)?;
        for file in [file, folder.path().join("second.mcap")] {
            let found = verified(&file)?;
            assert_eq!(found.findings, [], "{rate:?}, {}", file.display());
            assert!(found.recomputed.pulses > 0 && found.recomputed.checkpoints > 0 && found.recomputed.skipped == 0);
            assert!(found.physics.joint_gap_m < 1e-15);
        }
    }
    Ok(())
}

/// Steps so long that some must be taken in halves.
const HALVED: &[&str] = &[
    "solver.model=modal",
    "solver.integrator=generalized-alpha",
    "solver.step_s=0.05",
    "solver.max_iterations=5",
    "pulse=[{start_s=0.0, torque_nm=20.0, duration_s=0.1}]",
];

#[test]
fn prop_every_model_is_computed_again_to_the_bit() -> Outcome {
    let cases: [(&str, &[&str], f64); 10] = [
        ("crank-slider", &["solver.model=rigid", "solver.integrator=runge-kutta"], 25.0),
        ("crank-slider", &["solver.integrator=two-point", "solver.weight=0.5"], 12.0),
        ("ref-r2s", &[], 2.0),
        ("thesis-crank-slider", &[], 22.8),
        ("thesis-beam-tip", &[], 2.0),
        ("thesis-two-masses", &[], 10.0),
        ("thesis-compressor", &[], 1.0),
        ("crank-slider", HALVED, 3.0),
        ("crank-slider", &["solver.corrections=3", "solver.tolerance=1e-5"], 3.0),
        // Every step leaves more than the tolerance, and is counted.
        ("ref-r2s", &["solver.step_s=1e-3", "solver.corrections=1", "solver.tolerance=1e-12"], 1.0),
    ];
    for (name, overrides, until_s) in cases {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        let scene = SceneSource::open(name, &overrides)?;
        let (_, folder) = Service::start(scene, Pace::Max, Some(until_s), PublishRate::Hz(100.0))?.finish()?;
        let found = verified(&folder.path().join("run.mcap"))?;
        assert_eq!(found.findings, [], "{name} {overrides:?}");
        assert!(found.recomputed.messages > 50, "{name}");
        let status = common::decoded::<Status>(&folder.path().join("run.mcap"), "status")?;
        assert_eq!(status.last().is_some_and(|status| status.retried_steps > 0), overrides == HALVED, "{name}");
        let few = overrides.iter().any(|key| key == "solver.corrections=1");
        assert_eq!(status.last().is_some_and(|status| status.unconverged_steps > 0), few, "{name} {overrides:?}");
    }
    Ok(())
}

#[test]
fn regress_a_small_balance_error_is_reported() -> Outcome {
    let scene = SceneSource::open(
        "thesis-crank-slider",
        &["solver.model=rigid", "solver.integrator=runge-kutta", "solver.step_s=0.001"].map(str::to_owned),
    )?;
    let (_, folder) = Service::start(scene, Pace::Max, Some(1.0), PublishRate::Hz(10.0))?.finish()?;
    let file = folder.path().join("run.mcap");
    let statuses = common::decoded::<Status>(&file, "status")?;
    let last = statuses.last().ok_or("no status")?;
    let energies = common::decoded::<Energies>(&file, "energies")?;
    let errors = statuses.iter().map(|status| status.balance_error_j).chain(energies.iter().map(|row| row.balance_error_j));
    let published_j = errors.flatten().fold(0.0_f64, |most, error_j| most.max(error_j.abs()));
    let error_j = last.worst_balance_j.ok_or("no balance")?;
    let found = verified(&file)?;
    assert_eq!(last.state(), wire::status::State::Finished);
    assert_eq!((found.recomputed.balance_error_j, found.recomputed.energy_j), (error_j, last.work_in_j.ok_or("no work")?));
    assert!(published_j > 0.0 && published_j <= error_j && error_j < 1e-9, "{published_j} J of {error_j} J");
    Ok(())
}

#[test]
fn prop_messages_dropped_by_full_queues_are_lost_not_wrong() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1e5), Some(30.0), PublishRate::All)?;
    let (report, folder) = service.finish()?;
    assert!(report.dropped > 0, "100,000 times real time is more than any queue takes");
    let found = verified(&folder.path().join("run.mcap"))?;
    assert!(!found.findings.is_empty() && !found.is_wrong(), "{:?}", found.findings);
    assert!(found.findings.iter().any(|finding| matches!(finding, Finding::Missing { why: LossReason::Queue, .. })));
    Ok(())
}

#[test]
fn regress_a_file_that_cannot_be_read_hides_no_other() -> Outcome {
    for command in ["verify", "info"] {
        let files = ["nosuch.mcap", "recordings/sample-truncated.mcap", "README.md", "recordings/sample-three-pulses.mcap"];
        let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).arg(command).args(files).output()?;
        let [printed, said] = [ended.stdout, ended.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        assert_eq!(ended.status.code(), Some(1), "{command}: {said}");
        assert!(printed.starts_with(files[1]) && printed.contains(&format!("\n{}: ", files[3])), "{command}: {printed}");
        let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error: ")).collect();
        assert!(errors.len() == 2 && errors[0].contains(files[0]) && errors[1].contains(files[2]), "{command}: {said}");
    }
    Ok(())
}

/// A short recording of the rigid model with two pulses of its own.
fn short() -> Result<(tempfile::TempDir, PathBuf), Box<dyn std::error::Error>> {
    let service = Service::start(scene(&["pulse=[]"])?, Pace::Factor(4.0), None, PublishRate::All)?;
    for delay_s in [0.05, 0.1] {
        assert!(client::pulse(&service.client, &service.name, &pulse(5.0, 0.1, delay_s))?.accepted);
    }
    let listener = common::Listener::new(&service.client, &service.name)?;
    listener.wait_for(flexcrank::bus::Topic::Angles, 800, std::time::Duration::from_secs(30))?;
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    Ok((folder, file))
}

#[test]
fn prop_a_flipped_byte_is_found_wherever_it_is() -> Outcome {
    let (folder, file) = short()?;
    assert_eq!(verified(&file)?.findings, []);
    let whole = std::fs::read(&file)?;
    let flipped = folder.path().join("flipped.mcap");
    for n in 0..40 {
        let at = (whole.len() - 1) * n / 39;
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (n % 8);
        std::fs::write(&flipped, &bytes)?;
        // Damage to metadata and scene may leave nothing to verify by.
        let Ok(source) = RecordedSession::open(&flipped) else { continue };
        let found = verify(&source, &|_, _| {})?;
        assert!(found.is_wrong(), "byte {at} of {}", whole.len());
        assert!(found.findings.iter().any(|finding| matches!(finding, Finding::Damaged(_))), "byte {at}: {:?}", found.findings);
    }
    Ok(())
}

#[test]
fn prop_a_cut_recording_is_sound_as_far_as_it_goes() -> Outcome {
    let (folder, file) = short()?;
    let whole = std::fs::read(&file)?;
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &whole[..whole.len() * 2 / 3])?;
    let found = verified(&cut)?;
    assert!(matches!(found.findings[..], [Finding::CutOff { .. }]), "{:?}", found.findings);
    assert!(!found.is_wrong() && found.recomputed.messages > 100);
    Ok(())
}

#[test]
fn prop_a_removed_stretch_is_named() -> Outcome {
    let (_folder, file) = short()?;
    let less =
        rewritten(&file, "less.mcap", &|n, message| as_is(n, message).filter(|_| !(1000..1130).contains(&n)), &str::to_owned)?;
    let found = verified(&less)?;
    let missing = found.findings.iter().find_map(|finding| match finding {
        Finding::Missing { after, before, why: LossReason::Damage, .. } => Some((*after, *before)),
        _ => None,
    });
    let (after, before) = missing.ok_or("nothing is said to be missing")?;
    assert!(before - after > 30 && before - after < 40, "{after}..{before}");
    Ok(())
}

#[test]
fn prop_a_removed_chunk_is_named_with_its_steps() -> Outcome {
    let service = Service::start_as(tempfile::tempdir()?, scene(&["pulse=[]"])?, Pace::Factor(4.0), Some(0.8), |live| {
        live.stepping.publish = PublishRate::All.into();
        live.flush_period = std::time::Duration::from_millis(10);
    })?;
    let (_, folder) = service.finish()?;
    let file = folder.path().join("run.mcap");
    assert_eq!(verified(&file)?.findings, []);
    let mut bytes = std::fs::read(&file)?;
    let chunks = mcap::Summary::read(&bytes)?.ok_or("no summary")?.chunk_indexes;
    let chunk = &chunks[chunks.len() / 2];
    let of_chunk = |stamp: &wire::Stamp| -> bool {
        let log_time = |step: u64| chunks[0].message_start_time + step * 1_000_000;
        (chunk.message_start_time..=chunk.message_end_time).contains(&log_time(stamp.step))
    };
    let angles = common::decoded::<wire::Angles>(&file, "angles")?;
    let steps: Vec<u64> = angles
        .iter()
        .filter_map(|angles| angles.stamp.as_ref())
        .filter(|stamp| of_chunk(stamp))
        .map(|stamp| stamp.step)
        .collect();
    let start = chunk.chunk_start_offset as usize;
    bytes.drain(start..start + (chunk.chunk_length + chunk.message_index_length) as usize);
    std::fs::write(&file, &bytes)?;
    let found = verified(&file)?;
    assert!(
        found.is_wrong() && found.findings.iter().any(|finding| matches!(finding, Finding::Damaged(_))),
        "{:?}",
        found.findings
    );
    let named = |found: &Verification, reason: LossReason| {
        found.findings.iter().find_map(|finding| match finding {
            Finding::Missing { topic: "angles", after, before, count, why, .. } if *why == reason => {
                Some((*after, *before, *count))
            }
            _ => None,
        })
    };
    // A chunk may end between the topics of a step.
    let (after, before, count) =
        named(&found, LossReason::Damage).ok_or_else(|| format!("no missing steps in {:?}", found.findings))?;
    let (first, last) = (*steps.first().ok_or("an empty chunk")?, *steps.last().ok_or("an empty chunk")?);
    assert!(
        after + 1 >= first && after <= first && before > last - 1 && before <= last + 1,
        "{after}, {before}: {first} to {last}"
    );
    assert_eq!(count, before - after - 1);
    // Recovery takes the damage away: the same steps were lost before it, and the rest is sound.
    let recovered = folder.path().join("recovered.mcap");
    recover(&file, &recovered, |_, _| {})?;
    let found = verified(&recovered)?;
    let is_said = |finding: &Finding| matches!(finding, Finding::Recovered { missing: Some(_) });
    assert!(!found.is_wrong() && found.findings.iter().any(is_said), "{:?}", found.findings);
    assert_eq!(named(&found, LossReason::Recovered), Some((after, before, count)));
    Ok(())
}

#[test]
fn prop_a_changed_command_is_named() -> Outcome {
    let (_folder, file) = short()?;
    let stronger = |n: u64, message: &RecordedMessage| {
        let mut command = match AppliedCommand::decode(message.data.as_ref()) {
            Ok(command) if message.channel.topic.ends_with("/commands") => command,
            _ => return as_is(n, message),
        };
        if let Some(applied_command::Command::Torque(pulse)) = &mut command.command
            && pulse.delay_s == 0.1
        {
            pulse.torque_nm = 5.0000001;
        }
        Some(command.encode_to_vec())
    };
    let found = verified(&rewritten(&file, "stronger.mcap", &stronger, &str::to_owned)?)?;
    let [Finding::Differs { first, messages }] = &found.findings[..] else { return Err(format!("{:?}", found.findings).into()) };
    assert!(*messages > 100);
    assert!(first.after.as_ref().is_some_and(|after| after.contains("5:0.1") && after.contains("5.0000001 N·m")), "{first}");
    assert!(first.field.as_ref().and_then(|field| field.size()).is_some_and(|size| size != 0.0), "{first}");
    Ok(())
}

#[test]
fn prop_a_changed_energy_is_named() -> Outcome {
    let (_folder, file) = short()?;
    type Field = fn(&mut Energies) -> &mut Option<f64>;
    let fields: [(&str, Field); 5] = [
        ("kinetic_j", |row| &mut row.kinetic_j),
        ("work_in_j", |row| &mut row.work_in_j),
        ("dissipated_j", |row| &mut row.dissipated_j),
        ("balance_error_j", |row| &mut row.balance_error_j),
        ("energy_in_play_j", |row| &mut row.energy_in_play_j),
    ];
    for (name, field) in fields {
        let other = |n: u64, message: &RecordedMessage| {
            let mut energies = match Energies::decode(message.data.as_ref()) {
                Ok(energies) if message.channel.topic.ends_with("/energies") => energies,
                _ => return as_is(n, message),
            };
            if energies.stamp.is_some_and(|stamp| stamp.step == 300) {
                let value = field(&mut energies);
                *value = value.map(f64::next_up);
            }
            Some(energies.encode_to_vec())
        };
        let found = verified(&rewritten(&file, &format!("{name}.mcap"), &other, &str::to_owned)?)?;
        let [Finding::Differs { first, messages: 1 }] = &found.findings[..] else {
            return Err(format!("{name}: {:?}", found.findings).into());
        };
        assert_eq!((first.topic.as_str(), first.instant), ("energies", (0, 300)), "{first}");
        assert_eq!(first.field.as_ref().map(|field| field.name.as_str()), Some(name), "{first}");
    }
    Ok(())
}

#[test]
fn prop_energies_that_are_missing_or_not_finite_are_named() -> Outcome {
    let (_folder, file) = short()?;
    let of = |message: &RecordedMessage, topic: &str| message.channel.topic.ends_with(topic);
    let without = |n: u64, message: &RecordedMessage| as_is(n, message).filter(|_| !of(message, "/energies"));
    let found = verified(&rewritten(&file, "without.mcap", &without, &str::to_owned)?)?;
    assert!(found.is_wrong(), "{:?}", found.findings);
    let of_energies = |finding: &Finding| matches!(finding, Finding::Missing { topic: "energies", .. });
    let (missing, rest): (Vec<_>, Vec<_>) = found.findings.iter().partition(|finding| of_energies(finding));
    assert!(!missing.is_empty() && matches!(rest[..], [Finding::NotRecomputed { .. }]), "{found:?}");
    let broken = |n: u64, message: &RecordedMessage| match Energies::decode(message.data.as_ref()) {
        Ok(energies) if of(message, "/energies") => Some(Energies { strain_j: Some(f64::INFINITY), ..energies }.encode_to_vec()),
        _ => as_is(n, message),
    };
    let found = verified(&rewritten(&file, "broken.mcap", &broken, &str::to_owned)?)?;
    assert!(found.findings.iter().any(|finding| matches!(finding, Finding::Physics { topic: "energies", .. })), "{found:?}");
    Ok(())
}

/// A recording of an earlier version: energies in `status` only, without a rate.
#[test]
fn regress_recordings_without_energies_are_computed_again_as_they_are() -> Outcome {
    for rates in ["all", "displacements=all,angles=all,loads=1000"] {
        let (folder, file) = short()?;
        let less =
            |n: u64, message: &RecordedMessage| as_is(n, message).filter(|_| !message.channel.topic.ends_with("/energies"));
        let old = rewritten_with_rates(&file, "old.mcap", &less, &str::to_owned, Some(rates))?;
        assert_eq!(verified(&old)?.findings, [], "{rates}");
        let source = RecordedSession::open(&old)?;
        let end = resume(&source, None, &|_| {})?.simulation;
        let last = common::decoded::<Status>(&old, "status")?.pop().and_then(|status| status.stamp).ok_or("no status")?;
        assert_eq!((end.step_count(), Some(end.time_s())), (last.step, Some(last.sim_time_s)));
        let pulse = AddedPulse { start_s: 0.1, torque_nm: 1.0, duration_s: 0.1 };
        let other = folder.path().join("other.mcap");
        let outcome = what_if(&source, &Change { pulses: vec![pulse], ..Change::default() }, &other, &|_| {})?;
        assert!(outcome.deviation.first.is_some());
        assert_eq!(verified(&other)?.findings, [], "{rates}");
        let tables = folder.path().join("tables");
        let exported = export(&old, &Export { csv: Some(tables.clone()), ..Export::default() }, &|_| {})?;
        assert!(!exported.tables.is_empty() && !tables.join("flexcrank.test.energies.csv").exists());
    }
    Ok(())
}

#[test]
fn prop_a_changed_scene_is_named() -> Outcome {
    let (_folder, file) = short()?;
    let longer = |scene: &str| scene.replace("length_m = 1.5", "length_m = 1.5000001");
    let found = verified(&rewritten(&file, "longer.mcap", &as_is, &longer)?)?;
    assert!(found.findings.contains(&Finding::SceneChanged), "{:?}", found.findings);
    assert!(found.findings.iter().any(|finding| matches!(finding, Finding::Differs { .. })), "{:?}", found.findings);
    let same = verified(&rewritten(&file, "same.mcap", &as_is, &str::to_owned)?)?;
    assert_eq!(same.findings, []);
    Ok(())
}
