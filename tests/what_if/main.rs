//! What-if: with steps of other sizes, and where its recording cannot be written.

mod commands;
#[path = "../common/mod.rs"]
mod common;

use std::cell::Cell;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use common::rewritten::{as_is, rewritten};
use common::{Listener, Outcome, Service, scene};
use flexcrank::bus::{Topic, client};
use flexcrank::recording::RecordedMessage;
use flexcrank::resimulation::{
    AddedPulse, Change, Finding, LargestDifference, LossReason, RecordedSession, UnlikeMeshes, Verification, WhatIfOutcome,
    verify, what_if,
};
use flexcrank::runtime::Pace;
use flexcrank::scene::{SceneSource, builtin};
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{self, control::Action};

/// Re-simulates a recording with another scene, and verifies the result.
fn changed(file: &Path, name: &str, change: &str) -> Outcome<(WhatIfOutcome, Verification)> {
    let path = file.with_file_name(name);
    let change = Change { overrides: vec![change.to_owned()], ..Change::default() };
    let outcome = what_if(&RecordedSession::open(file)?, &change, &path, &|_| {})?;
    let verified = verify(&RecordedSession::open(&path)?, &|_, _| {})?;
    Ok((outcome, verified))
}

/// The samples are at times that no rate describes: those of the original, every 3 or 4 ms, that the steps reach.
#[test]
fn regress_a_what_if_with_other_steps_is_verified_and_compared_by_time() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Max, Some(2.0), PublishRate::Hz(300.0))?;
    let (_, folder) = service.finish()?;
    let file = folder.path().join("run.mcap");
    for step_s in ["5e-4", "2e-3", "3e-3", "7e-4"] {
        let (outcome, verified) = changed(&file, &format!("{step_s}.mcap"), &format!("solver.step_s={step_s}"))?;
        assert_eq!(verified.findings, [], "{step_s}");
        assert!(verified.recomputed.messages > 100, "{step_s}: {}", verified.recomputed.messages);
        let first = outcome.deviation.first.ok_or("no deviation")?;
        let name = first.field.as_ref().map(|field| field.name.as_str()).unwrap_or_default();
        assert!(!name.is_empty() && !name.starts_with("stamp."), "{step_s}: {first}");
    }
    let (outcome, verified) = changed(&file, "same.mcap", "solver.step_s=1e-3")?;
    assert_eq!((outcome.deviation.first, verified.findings), (None, vec![]));
    Ok(())
}

/// The level keeps its name, and loses its step.
#[test]
fn regress_a_what_if_without_the_step_of_a_level_is_verified() -> Outcome {
    let text = builtin::find("crank-slider")?.text;
    let levels = "\n[[level]]\nname = \"fine\"\n\n[[level]]\nname = \"coarse\"\nchanges = [\"solver.step_s=0.004\"]\n";
    let leveled = SceneSource::parse("leveled.toml", &format!("{text}{levels}"), &[])?;
    let service = Service::start(leveled, Pace::Factor(20.0), None, PublishRate::Hz(200.0))?;
    let listener = Listener::new(&service.client, &service.name)?;
    for (name, heard) in [("coarse", 100), ("fine", 200)] {
        let control = wire::Control { id: String::new(), action: Some(Action::Level(wire::Level { name: name.to_owned() })) };
        assert!(client::control(&service.client, &service.name, &control)?.accepted);
        listener.wait_for(Topic::Angles, heard, Duration::from_secs(60))?;
    }
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    assert_eq!(verify(&RecordedSession::open(&file)?, &|_, _| {})?.findings, []);
    let (_, verified) = changed(&file, "fine.mcap", "level.1.changes=[]")?;
    assert_eq!(verified.findings, []);
    Ok(())
}

#[test]
fn regress_a_what_if_with_other_steps_reports_what_its_original_lacks() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Max, Some(2.0), PublishRate::Hz(300.0))?;
    let (_, folder) = service.finish()?;
    let file = folder.path().join("run.mcap");
    let less =
        rewritten(&file, "less.mcap", &|n, message| as_is(n, message).filter(|_| !(1000..1030).contains(&n)), &str::to_owned)?;
    for step_s in ["5e-4", "7e-4"] {
        let (_, verified) = changed(&less, &format!("{step_s}.mcap"), &format!("solver.step_s={step_s}"))?;
        let is_reported = verified.findings.iter().any(|finding| match finding {
            Finding::Dropped { topic, why: LossReason::Source, .. } => topic == "angles",
            _ => false,
        });
        assert!(is_reported && !verified.is_wrong(), "{step_s}: {:?}", verified.findings);
    }
    Ok(())
}

/// The largest difference of the driving torque that a what-if with these changes reports, N·m.
fn torque_difference_nm(file: &Path, name: &str, changes: &[&str]) -> Outcome<f64> {
    let overrides = changes.iter().map(|change| (*change).to_owned()).collect();
    let change = Change { overrides, ..Change::default() };
    let outcome = what_if(&RecordedSession::open(file)?, &change, &file.with_file_name(name), &|_| {})?;
    Ok(outcome.deviation.largest.get("driving torque, N·m").ok_or("no driving torque was compared")?.value)
}

/// The recorded torques are means over 4 or 6 ms, those of longer steps over up to 24 ms.
#[test]
fn regress_driving_torques_of_other_steps_are_compared_over_the_same_time() -> Outcome {
    let service = Service::start(SceneSource::open("crank-slider", &[])?, Pace::Max, Some(1.0), PublishRate::Hz(200.0))?;
    let (_, folder) = service.finish()?;
    let file = folder.path().join("run.mcap");
    for step_s in ["0.001", "0.003", "0.004"] {
        let step = format!("solver.step_s={step_s}");
        let difference_nm = torque_difference_nm(&file, &format!("{step_s}.mcap"), &[&step])?;
        assert!(difference_nm < 1e-12, "{step_s}: {difference_nm:e}");
        // One more newton metre in the mean of the pulse is up to two at its peak.
        let difference_nm = torque_difference_nm(&file, &format!("{step_s}-pulse.mcap"), &[&step, "pulse.0.torque_nm=21"])?;
        assert!((1.5..=2.0).contains(&difference_nm), "{step_s}: {difference_nm:e}");
    }
    Ok(())
}

/// A pulse that takes effect between two of the longer steps begins there, and not with the next of them.
#[test]
fn regress_pulses_keep_their_instants_with_other_steps() -> Outcome {
    let fine = scene(&["solver.step_s=5e-4"])?;
    let (_, folder) = Service::start(fine, Pace::Max, Some(1.0), PublishRate::Hz(200.0))?.finish()?;
    let [file, pulsed] = ["run.mcap", "pulsed.mcap"].map(|name| folder.path().join(name));
    let pulses = vec![AddedPulse { start_s: 0.3005, torque_nm: 5.0, duration_s: 0.1 }];
    what_if(&RecordedSession::open(&file)?, &Change { pulses, ..Change::default() }, &pulsed, &|_| {})?;
    for step_s in ["1e-3", "2e-3", "5e-3"] {
        let name = format!("{step_s}.mcap");
        let difference_nm = torque_difference_nm(&pulsed, &name, &[&format!("solver.step_s={step_s}")])?;
        assert!(difference_nm < 1e-9, "{step_s}: {difference_nm:e}");
        assert_eq!(verify(&RecordedSession::open(&pulsed.with_file_name(&name))?, &|_, _| {})?.findings, [], "{step_s}");
    }
    Ok(())
}

/// The pulse ends among the lost samples. The next recorded torque is a mean since the last of them.
#[test]
fn regress_a_driving_torque_after_lost_samples_is_not_compared() -> Outcome {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(1.0), PublishRate::Hz(300.0))?.finish()?;
    let file = folder.path().join("run.mcap");
    let less =
        rewritten(&file, "less.mcap", &|n, message| as_is(n, message).filter(|_| !(100..130).contains(&n)), &str::to_owned)?;
    assert_eq!(torque_difference_nm(&less, "heavy.mcap", &["slider.mass_kg=2"])?, 0.0);
    Ok(())
}

/// Runs `what-if` in a folder: exit code, standard output and standard error.
fn told(folder: &Path, words: &[&str]) -> Outcome<(Option<i32>, String, String)> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    let ended = command.arg("what-if").args(words).current_dir(folder).stdin(Stdio::null()).output()?;
    Ok((ended.status.code(), String::from_utf8(ended.stdout)?, String::from_utf8(ended.stderr)?))
}

/// A what-if records no status, because nothing ran.
#[test]
fn regress_info_states_why_a_what_if_has_no_last_status() -> Outcome {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(0.5), PublishRate::Hz(100.0))?.finish()?;
    changed(&folder.path().join("run.mcap"), "changed.mcap", "slider.mass_kg=0.3")?;
    for (file, status) in [("run.mcap", "finished, at simulated 0.5 s"), ("changed.mcap", "none: the re-simulation ended")] {
        let info = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(["info", file]).current_dir(folder.path()).output()?;
        let printed = String::from_utf8(info.stdout)?;
        assert!(printed.contains(&format!("\n  last status   {status}\n")), "{printed}");
    }
    Ok(())
}

/// Four of five samples of the loads are lost: before each of the others, samples are missing.
#[test]
fn regress_a_driving_torque_that_is_never_compared_is_not_the_same() -> Outcome {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(1.0), PublishRate::Hz(300.0))?.finish()?;
    let loads = Cell::new(0_u32);
    let is_kept = |topic: &str| {
        let is_loads = topic.ends_with("/loads");
        loads.set(loads.get() + u32::from(is_loads));
        !is_loads || loads.get().is_multiple_of(5)
    };
    let file = folder.path().join("run.mcap");
    rewritten(&file, "less.mcap", &|n, message| as_is(n, message).filter(|_| is_kept(&message.channel.topic)), &str::to_owned)?;
    let (code, printed, said) = told(folder.path(), &["less.mcap", "--set", "slider.mass_kg=2", "--record", "heavy.mcap"])?;
    assert_eq!(code, Some(0), "{said}");
    let torque = printed.lines().find(|line| line.contains("driving torque")).unwrap_or_default();
    assert!(torque.contains(" was not compared: "), "{printed}");
    Ok(())
}

/// Records a rod of four elements that bends from the first step on.
fn bending_rod(model: &str) -> Outcome<tempfile::TempDir> {
    let overrides = [format!("solver.model={model}").as_str(), "solver.step_s=0.001", "rod.elements=4"].map(str::to_owned);
    let service = Service::start(SceneSource::open("ref-r2s", &overrides)?, Pace::Max, Some(0.3), PublishRate::Hz(200.0))?;
    let (_, folder) = service.finish()?;
    Ok(folder)
}

/// Node by node, the rods would differ by the whole deflection, 0.04 m.
#[test]
fn regress_finer_meshes_are_compared_at_the_same_places() -> Outcome {
    let folder = bending_rod("finite-element")?;
    let (outcome, verified) = changed(&folder.path().join("run.mcap"), "fine.mcap", "rod.elements=8")?;
    let deviation = outcome.deviation;
    let meshes = UnlikeMeshes { link: "rod".to_owned(), recorded: 4, computed: 8 };
    assert_eq!((verified.findings, &deviation.unlike_meshes), (vec![], &BTreeSet::from([meshes])));
    assert!(deviation.first.as_ref().is_some_and(|first| first.instant > (0, 0)), "{deviation:?}");
    for quantity in ["rod deflection, m", "node position, m"] {
        let difference_m = deviation.largest[quantity].value;
        assert!(difference_m > 0.0 && difference_m < 1e-4, "{quantity}: {difference_m:e}");
    }
    Ok(())
}

/// The modal model moves alike whatever nodes it publishes. At rest, a rigid rod has no deflection, and a flexible one has none either.
#[test]
fn regress_deviations_of_other_nodes_and_of_zero_are_none() -> Outcome {
    let folder = bending_rod("modal")?;
    let (code, printed, said) = told(folder.path(), &["run.mcap", "--set", "rod.elements=6", "--record", "six.mcap"])?;
    let meshes = "no deviation\n  rod: 4 elements recorded, 6 computed: compared at the nodes that both have\n";
    assert!(code == Some(0) && printed.ends_with(meshes), "{printed}{said}");
    let (_, printed, _) = told(folder.path(), &["run.mcap", "--set", "rod.elements=3", "--record", "three.mcap"])?;
    let pins = "  rod: 4 elements recorded, 3 computed: compared at the nodes that both have, none of which deflects\n";
    assert!(printed.ends_with(pins), "{printed}");
    let (outcome, _) = changed(&folder.path().join("run.mcap"), "rigid.mcap", "solver.model=rigid")?;
    let first = outcome.deviation.first.ok_or("no deviation")?;
    assert!(first.instant > (0, 0), "{first}");
    Ok(())
}

/// A rigid rod computes no deflection, which counts as zero: the rods differ by all that the flexible one deflects.
#[test]
fn regress_deflections_are_compared_with_those_of_a_rigid_rod() -> Outcome {
    let deflection = |recorded: &str, change: &str| -> Outcome<LargestDifference> {
        let folder = bending_rod(recorded)?;
        let (outcome, _) = changed(&folder.path().join("run.mcap"), "changed.mcap", change)?;
        Ok(*outcome.deviation.largest.get("rod deflection, m").ok_or("no deflection of the rod was compared")?)
    };
    let straightened = deflection("finite-element", "solver.model=rigid")?;
    assert!(straightened.value > 0.03, "{straightened:?}");
    assert_eq!(deflection("rigid", "solver.model=finite-element")?, straightened);
    assert!(deflection("finite-element", "rod.rigid=true")?.value > 0.03);
    Ok(())
}

/// The only step ends between two samples.
#[test]
fn regress_a_what_if_whose_steps_reach_no_sample_claims_no_agreement() -> Outcome {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(1.0), PublishRate::Hz(300.0))?.finish()?;
    let (code, printed, said) = told(folder.path(), &["run.mcap", "--set", "solver.step_s=0.7777", "--record", "long.mcap"])?;
    assert_eq!(code, Some(0), "{said}");
    let compared = "only the beginning was compared: the changed session's steps reach no later sample";
    assert_eq!(printed.lines().last(), Some(compared), "{printed}");
    Ok(())
}

/// Samples every 5 ms, of which steps of 2 ms reach every second one.
#[test]
fn regress_a_what_if_whose_steps_miss_samples_says_so_and_names_steps_that_do_not() -> Outcome {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(1.0), PublishRate::Hz(200.0))?.finish()?;
    let warning = "warning: 100 of 201 samples lie between steps of 0.002 s, and are left out: a step that divides 0.005 s, the time \
                   between samples, reaches all\n";
    for (step, is_told) in [("0.002", true), ("0.0025", false)] {
        let change = format!("solver.step_s={step}");
        let (code, _, said) = told(folder.path(), &["run.mcap", "--set", &change, "--record", &format!("{step}.mcap")])?;
        assert_eq!((code, said.contains(warning), said.contains("samples lie")), (Some(0), is_told, is_told), "{step}: {said}");
    }
    Ok(())
}

#[test]
fn regress_a_what_if_that_ends_badly_names_a_remedy() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/sample-three-pulses.mcap");
    let remedy = "`flexcrank check SCENE --until TIME` suggests a step; `flexcrank trade SCENE --tolerance ERROR --until TIME` chooses one; SCENE is the recorded scene with";
    for (step, code, line) in [("0.1", 6, format!("not to be trusted: {remedy}")), ("5.0", 4, remedy.to_owned())] {
        let change = format!("solver.step_s={step}");
        let (ended, _, said) = told(folder.path(), &[sample, "--set", &change, "--record", &format!("{step}.mcap")])?;
        let last = said.lines().last().unwrap_or_default();
        assert!(ended == Some(code) && last.starts_with(&line), "{step}: {ended:?} {said}");
    }
    Ok(())
}

/// The recorded pulse is within the limit of its own scene.
#[test]
fn regress_a_change_that_refuses_a_recorded_torque_is_not_blamed_on_the_recording() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(20.0), None, PublishRate::Hz(200.0))?;
    let listener = Listener::new(&service.client, &service.name)?;
    let pulse = wire::TorquePulse { torque_nm: 5.0, duration_s: 0.1, ..wire::TorquePulse::default() };
    assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
    listener.wait_for(Topic::Angles, 100, Duration::from_secs(60))?;
    let (_, folder) = service.stop()?;
    let change = ["run.mcap", "--set", "commands.torque_limit_nm=2", "--record", "limited.mcap"];
    let (code, _, said) = told(folder.path(), &change)?;
    let refusal = "error: run.mcap: the change does not suit the recorded session: at t = ";
    assert!(code == Some(2) && said.lines().any(|line| line.starts_with(refusal)), "{code:?} {said}");
    let why =
        " s, a recorded torque would be refused: |torque_nm| = 5 is over the scene's limit of 2 N·m (commands.torque_limit_nm)";
    assert!(said.contains(why), "{said}");
    assert!(!folder.path().join("limited.mcap").exists());
    Ok(())
}

/// The limit was raised before the pulse, and that command is lost: the recorded session refuses the pulse without any change.
#[test]
fn regress_a_torque_that_a_damaged_recording_refuses_is_not_blamed_on_the_change() -> Outcome {
    let limited = scene(&["commands.torque_limit_nm=2"])?;
    let service = Service::start(limited, Pace::Factor(20.0), None, PublishRate::Hz(200.0))?;
    let listener = Listener::new(&service.client, &service.name)?;
    let raise = "commands.torque_limit_nm=10";
    let control = wire::Control { id: String::new(), action: Some(Action::Set(wire::Set { changes: vec![raise.to_owned()] })) };
    assert!(client::control(&service.client, &service.name, &control)?.accepted);
    let pulse = wire::TorquePulse { torque_nm: 5.0, duration_s: 0.1, ..wire::TorquePulse::default() };
    assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
    listener.wait_for(Topic::Angles, 100, Duration::from_secs(60))?;
    let (_, folder) = service.stop()?;
    let is_kept = |data: &[u8]| !String::from_utf8_lossy(data).contains(raise);
    let less = |n, message: &RecordedMessage| as_is(n, message).filter(|data| is_kept(data));
    rewritten(&folder.path().join("run.mcap"), "less.mcap", &less, &str::to_owned)?;
    for change in [["--add-pulse", "0.001:1:0.1"], ["--set", "slider.mass_kg=2"], ["--set", "commands.torque_limit_nm=3"]] {
        let (code, _, said) = told(folder.path(), &["less.mcap", change[0], change[1], "--record", "changed.mcap"])?;
        let refusal = "error: less.mcap: the recording cannot be re-simulated: at t = ";
        assert!(code == Some(1) && said.lines().any(|line| line.starts_with(refusal)), "{change:?}: {code:?} {said}");
        let why = " s, a recorded torque would be refused: |torque_nm| = 5 is over the scene's limit of 2 N·m (commands.torque_limit_nm)";
        assert!(said.contains(why), "{change:?}: {said}");
    }
    let (code, _, said) = told(folder.path(), &["run.mcap", "--set", "slider.mass_kg=2", "--record", "changed.mcap"])?;
    assert_eq!(code, Some(0), "the whole recording: {said}");
    Ok(())
}

#[test]
fn regress_a_what_if_warns_of_numbers_that_the_change_makes_suspect() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/sample-three-pulses.mcap");
    let warned = |change: &str, name: &str| -> Outcome<usize> {
        let (_, _, said) = told(folder.path(), &[sample, "--set", change, "--record", name])?;
        Ok(said.lines().filter(|line| line.starts_with("warning: start.angle_rad")).count())
    };
    assert_eq!((warned("start.angle_rad=180", "degrees.mcap")?, warned("slider.mass_kg=2", "heavy.mcap")?), (1, 0));
    let (_, _, said) = told(folder.path(), &["degrees.mcap", "--set", "slider.mass_kg=2", "--record", "both.mcap"])?;
    assert!(!said.contains("radians"), "the recorded scene had it already: {said}");
    Ok(())
}

#[test]
fn regress_a_what_if_that_diverges_says_what_was_compared() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/sample-three-pulses.mcap");
    for (file, change, compared) in [
        ("step.mcap", &["--set", "solver.step_s=5.0"][..], "only the beginning was compared: the changed session diverged"),
        (
            "pulse.mcap",
            &["--set", "commands.torque_limit_nm=1e12", "--add-pulse", "3.001:1e10:0.1"],
            "no deviation up to t = 3 s",
        ),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        command.args(["what-if", sample, "--record", file]).args(change).current_dir(folder.path()).stdin(Stdio::null());
        let ended = command.output()?;
        let (printed, said) = (String::from_utf8(ended.stdout)?, String::from_utf8(ended.stderr)?);
        assert!(ended.status.code() == Some(4) && said.starts_with("error: diverged in step "), "{said}");
        assert_eq!(printed.lines().last(), Some(compared), "{printed}");
    }
    Ok(())
}

/// A rod a seventh as stiff bends out of the range of its model: a run says so, and a what-if as well.
#[test]
fn regress_a_what_if_says_when_a_link_bends_too_far() -> Outcome {
    let flexible = scene(&["solver.model=modal", "solver.integrator=esdirk"])?;
    let (_, folder) = Service::start(flexible, Pace::Max, Some(1.0), PublishRate::Hz(500.0))?.finish()?;
    for (change, is_told) in [("rod.youngs_modulus_pa=3e10", true), ("rod.youngs_modulus_pa=2e11", false)] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        command.args(["what-if", "run.mcap", "--set", change, "--record", &format!("{is_told}.mcap")]);
        let ended = command.current_dir(folder.path()).stdin(Stdio::null()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert_eq!(said.contains("warning: out of the model's range: a link was bent by "), is_told, "{change}: {said}");
        assert_eq!(ended.status.code(), Some(0), "{change}: {said}");
    }
    Ok(())
}

#[test]
fn regress_a_what_if_that_cannot_be_recorded_names_the_option_and_makes_no_folder() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/sample-three-pulses.mcap");
    let refused = |change: [&str; 2]| -> Outcome<(Option<i32>, String)> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        command.args(["what-if", sample]).args(change).current_dir(folder.path()).stdin(Stdio::null());
        let ended = command.output()?;
        Ok((ended.status.code(), String::from_utf8(ended.stderr)?))
    };
    assert_eq!(refused(["--set", "rod.length_m=-1"])?.0, Some(2));
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 0, "no folder of recordings");
    std::fs::write(folder.path().join("recordings"), "a file")?;
    let (code, said) = refused(["--add-pulse", "1:1:0.1"])?;
    assert!(code == Some(1) && said.contains("recordings: ") && said.contains("record elsewhere with --record FILE"), "{said}");
    Ok(())
}
