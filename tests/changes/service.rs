//! Changes of a running service: recorded once each, and computed again to the bit.

use std::collections::HashSet;
use std::path::Path;
use std::time::Duration;

use flexcrank::bus::client;
use flexcrank::resimulation::{AddedPulse, Change, RecordedSession, Resumed, resume, verify, what_if};
use flexcrank::runtime::{Overrun, Pace, Slowdown, SteppingOptions};
use flexcrank::scene::SceneSource;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::control::Action;
use flexcrank::wire::{self, AppliedCommand, CommandReply, Control, TorquePulse};

use crate::common::{self, Outcome, Service};
use crate::random::Random;

/// Longest wait for the answer to an advance.
const PATIENCE: Duration = Duration::from_secs(20);

fn set(service: &Service, id: &str, changes: Vec<String>) -> Result<CommandReply, Box<dyn std::error::Error>> {
    let control = Control { id: id.to_owned(), action: Some(Action::Set(wire::Set { changes })) };
    Ok(client::control(&service.client, &service.name, &control)?)
}

/// The default scene with three levels, the second of which has a step of its own.
pub fn leveled() -> Result<SceneSource, flexcrank::scene::SceneError> {
    leveled_with(", \"solver.step_s=4e-3\"")
}

/// The default scene with three levels, the second of them with further changes.
fn leveled_with(further: &str) -> Result<SceneSource, flexcrank::scene::SceneError> {
    let text = flexcrank::scene::builtin::find("crank-slider").map(|scene| scene.text).unwrap_or_default();
    let levels = r#"
[[level]]
name = "good"
error_rad = 1e-3
[[level]]
name = "fair"
error_rad = 1e-2
changes = ["crank.rigid=true", "rod.modes=1", "rod.axial=false"FURTHER]
[[level]]
name = "rough"
error_rad = 1e-1
changes = ["solver.model=rigid", "solver.integrator=runge-kutta"]
"#;
    SceneSource::parse("leveled.toml", &format!("{text}{}", levels.replace("FURTHER", further)), &[])
}

#[test]
fn prop_levels_are_switched_by_command_recorded_and_computed_again() -> Outcome {
    let service = Service::start(leveled()?, Pace::Factor(20.0), None, PublishRate::Hz(100.0))?;
    let listener = common::Listener::new(&service.client, &service.name)?;
    let level = |name: &str| -> Result<CommandReply, Box<dyn std::error::Error>> {
        let control = Control { id: String::new(), action: Some(Action::Level(wire::Level { name: name.to_owned() })) };
        Ok(client::control(&service.client, &service.name, &control)?)
    };
    // A level without a name was refused without a reason.
    let nameless = level("")?;
    assert!(!nameless.accepted && nameless.reason.contains("no level `` (known here: good, fair, rough)"), "{nameless:?}");
    let mut heard = 0;
    for name in ["fair", "rough", "good", "rough", "fair"] {
        let reply = level(name)?;
        assert!(reply.accepted && reply.changed_j.is_some(), "{name}: {reply:?}");
        heard += 100;
        listener.wait_for(flexcrank::bus::Topic::Angles, heard, std::time::Duration::from_secs(60))?;
        assert!(set(&service, "", vec![format!("slider.mass_kg={}", 0.2 + 1e-4 * f64::from(heard as u16))])?.accepted);
    }
    let refused = level("fairr")?;
    assert_eq!((refused.accepted, refused.reason.contains("did you mean `fair`?")), (false, true), "{}", refused.reason);
    assert!(set(&service, "", vec!["level.1.name=other".into()])?.reason.contains("keeps its levels"));
    for (change, says) in [
        ("slider.mas_kg=0.3", "slider.mas_kg = 0.3: unknown key; did you mean `mass_kg`?"),
        ("slider.mass_kg={", "slider.mass_kg={: not TOML"),
        ("crank.length_m=0.3", "crank.length_m = 0.3: a running scene keeps its geometry"),
        (
            "beam.modes=3",
            "beam.modes = 3: this scene has [crank] and [rod] instead of [beam]; did you mean `crank.modes` or `rod.modes`?",
        ),
        (
            "solver.step_s=3e-3",
            "level `fair`: a step of 0.004 s is neither a multiple nor a part of the step of level `good`, 0.003 s",
        ),
    ] {
        let reason = set(&service, "", vec![change.into()])?.reason;
        assert!(reason.contains(says) && !reason.contains("--set"), "{change}: {reason}");
    }
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let source = RecordedSession::open(&file)?;
    let found = verify(&source, &|_, _| {})?;
    assert_eq!(found.findings, []);
    let angles: Vec<wire::Angles> = common::decoded(&file, "angles")?;
    let stated = |name: &str, error: f64| angles.iter().filter(|a| a.level == name && a.level_error_rad == Some(error)).count();
    assert!(stated("good", 1e-3) > 50 && stated("fair", 1e-2) > 100 && stated("rough", 1e-1) > 100);
    let columns = flexcrank::recording::read_columns(&file, &|_| {})?;
    let texts = columns.topics.iter().find(|topic| topic.name.ends_with("/angles")).map(|topic| topic.texts.clone());
    let levels = texts.unwrap_or_default().into_iter().find(|(column, _)| column == "level").map(|(_, names)| names);
    assert_eq!(levels, Some(["good", "fair", "rough"].map(str::to_owned).to_vec()));
    // A session resumes at its level.
    let end = resume(&source, None, &|_| {})?;
    assert_eq!((end.scene.level, end.scene.in_force().map(|level| level.name.as_str())), (1, Some("fair")));
    let outcome = what_if(
        &source,
        &Change { overrides: vec!["slider.mass_kg=0.21".into()], ..Change::default() },
        &file.with_file_name("other.mcap"),
        &|_| {},
    )?;
    assert!(outcome.deviation.first.is_some());
    let found = verify(&RecordedSession::open(&file.with_file_name("other.mcap"))?, &|_, _| {})?;
    assert_eq!(found.findings, []);
    Ok(())
}

/// A load that sets in within a step costs no more than that step at its level: the spare has it.
#[test]
fn prop_steps_that_the_spare_took_are_recorded_and_computed_again() -> Outcome {
    // By this seed, steps take longer from 1.53 s to 2.05 s: more than their time at the best level, a small part of it at the next.
    let load = Slowdown::new(200.0, 134);
    let mut seen = Vec::new();
    // A stall of the machine just then has the run at the next level already.
    for _ in 0..3 {
        let rigid = leveled_with(", \"solver.model=rigid\", \"solver.integrator=runge-kutta\"")?;
        let service = Service::start_as(tempfile::tempdir()?, rigid, Pace::Factor(1.0), Some(3.5), |live| {
            live.stepping = SteppingOptions { overrun: Overrun::Degrade, spare: true, slowdown: Some(load), ..live.stepping };
        })?;
        let (_, folder) = service.finish()?;
        let file = folder.path().join("run.mcap");
        let found = verify(&RecordedSession::open(&file)?, &|_, _| {})?;
        assert_eq!(found.findings, []);
        let commands: Vec<AppliedCommand> = common::decoded(&file, "commands")?;
        seen.extend(commands.into_iter().filter_map(|command| Some(command.reply?.reason)));
        if seen.iter().any(|reason| reason == "a step took more than 1.60ms") {
            return Ok(());
        }
    }
    Err(format!("the spare never took a step: {seen:?}").into())
}

/// Changes that wait for a common instant keep their order; a pause refuses them, since the run comes to no other step.
#[test]
fn prop_changes_that_wait_are_applied_in_order_or_refused() -> Outcome {
    let service = Service::start(leveled()?, Pace::Factor(1.0), None, PublishRate::Hz(100.0))?;
    let say = |action: Action| -> Result<CommandReply, Box<dyn std::error::Error>> {
        Ok(client::control(&service.client, &service.name, &Control { id: String::new(), action: Some(action) })?)
    };
    for k in 0..10 {
        let (name, other) = if k % 2 == 0 { ("fair", "good") } else { ("good", "fair") };
        let first = say(Action::Level(wire::Level { name: name.into() }))?;
        let second = set(&service, "", vec![format!("slider.mass_kg={}", 0.2 + 0.01 * f64::from(k))])?;
        assert!(first.accepted && second.accepted && second.effective_step >= first.effective_step, "{name} {other}");
    }
    say(Action::Pause(wire::Pause {}))?;
    // A step of 4 ms can begin at every other step of 2 ms.
    let refused = (0..2).map(|_| {
        say(Action::Level(wire::Level { name: "good".into() }))?;
        // An advance is answered after its step; a single step before it.
        let step = wire::Advance { steps: 1, ..wire::Advance::default() };
        client::advance(&service.client, &service.name, &step, PATIENCE)?;
        say(Action::Level(wire::Level { name: "fair".into() })).map(|reply| (reply.accepted, reply.reason))
    });
    let refused: Vec<(bool, String)> = refused.collect::<Result<_, _>>()?;
    assert!(refused.iter().any(|(accepted, reason)| !accepted && reason.contains("1 step from here")), "{refused:?}");
    let (_, folder) = service.stop()?;
    let found = verify(&RecordedSession::open(&folder.path().join("run.mcap"))?, &|_, _| {})?;
    assert_eq!(found.findings, []);
    Ok(())
}

/// Number of changes in a run; the variable asks for more than CI makes.
fn count() -> usize {
    std::env::var("FLEXCRANK_CHANGES").ok().and_then(|count| count.parse().ok()).unwrap_or(60)
}

#[test]
fn prop_changes_of_a_running_service_are_recorded_and_computed_again() -> Outcome {
    let scene = SceneSource::open("crank-slider", &[])?;
    let service = Service::start(scene, Pace::Max, None, PublishRate::Hz(50.0))?;
    let mut random = Random(11);
    let mut accepted = HashSet::new();
    for k in 0..count() {
        let (id, changes) = (format!("set-{k}"), random.change());
        let reply = set(&service, &id, changes.clone())?;
        if reply.accepted {
            assert!(reply.changed_j.is_some() && accepted.insert(id.clone()), "{reply:?}");
            // A retry is answered, and changes nothing.
            let again = set(&service, &id, changes)?;
            assert_eq!((again.effective_step, again.changed_j), (reply.effective_step, reply.changed_j));
        } else {
            assert!(!reply.reason.is_empty() && reply.changed_j.is_none(), "{changes:?}: {reply:?}");
        }
        if k % 10 == 3 {
            let pulse = TorquePulse { id: format!("pulse-{k}"), torque_nm: 1.0, duration_s: 0.1, ..TorquePulse::default() };
            client::pulse(&service.client, &service.name, &pulse)?;
        }
        if k % 20 == 13 {
            let reset = Control { id: format!("reset-{k}"), action: Some(Action::Reset(wire::Reset {})) };
            assert!(client::control(&service.client, &service.name, &reset)?.accepted);
        }
    }
    assert!(2 * accepted.len() > count(), "{} of {}", accepted.len(), count());
    let (report, folder) = service.stop()?;
    assert_eq!(report.dropped, 0);
    let file = folder.path().join("run.mcap");
    let recorded: Vec<AppliedCommand> = common::decoded(&file, "commands")?;
    let sets: Vec<String> =
        recorded.iter().filter(|c| !c.scene.is_empty()).filter_map(|c| Some(c.reply.as_ref()?.id.clone())).collect();
    assert_eq!((sets.len(), sets.into_iter().collect::<HashSet<_>>()), (accepted.len(), accepted));
    let source = RecordedSession::open(&file)?;
    let found = verify(&source, &|_, _| {})?;
    assert_eq!(found.findings, []);
    goes_on_from_anywhere(&source, &file, &mut random, found.span_s)
}

/// Resuming at an instant, and a what-if from there, give what was recorded.
fn goes_on_from_anywhere(source: &RecordedSession, file: &Path, random: &mut Random, span_s: f64) -> Outcome {
    let angles: Vec<wire::Angles> = common::decoded(file, "angles")?;
    for _ in 0..5 {
        let at_s = random.between(0.05, 0.95) * span_s;
        let Resumed { mut simulation, scene, epoch_start_s, .. } = resume(source, Some(at_s), &|_| {})?;
        // The first sample from there on, unless another command comes before it.
        let now = (simulation.epoch(), simulation.step_count());
        let next = angles.iter().find(|angles| angles.stamp.is_some_and(|stamp| (stamp.epoch, stamp.step) >= now));
        let next = next.ok_or("nothing recorded after it")?;
        let stamp = next.stamp.unwrap_or_default();
        let commands: Vec<AppliedCommand> = common::decoded(file, "commands")?;
        let is_between = |command: &AppliedCommand| {
            let at = command.stamp.map_or((0, 0), |stamp| (stamp.epoch, stamp.step));
            at >= now && at < (stamp.epoch, stamp.step)
        };
        if !commands.iter().any(is_between) && stamp.epoch == now.0 {
            while simulation.step_count() < stamp.step {
                simulation.step()?;
            }
            let seen = simulation.observe()?;
            assert_eq!(seen.links[1].chord_rad.to_bits(), next.links[1].chord_rad.to_bits(), "{at_s} s of {}", scene.source.text);
        }
        let pulse = AddedPulse { start_s: at_s, torque_nm: 0.5, duration_s: 0.05 };
        let change = Change { pulses: vec![pulse], ..Change::default() };
        let path = file.with_file_name(format!("what-if-{at_s}.mcap"));
        let outcome = what_if(source, &change, &path, &|_| {})?;
        // A reset shortly after the pulse takes its effect back before a sample shows it.
        let is_sampled_after = angles
            .iter()
            .filter_map(|angles| angles.stamp)
            .any(|stamp| stamp.epoch == now.0 && stamp.sim_time_s + epoch_start_s > at_s + 0.03);
        match outcome.deviation.first {
            Some(first) => {
                assert!(first.sim_time_s + epoch_start_s >= at_s - 0.03, "it differs at {} s, before {at_s} s", first.sim_time_s);
            }
            None => assert!(!is_sampled_after, "the pulse at {at_s} s does nothing"),
        }
        let found = verify(&RecordedSession::open(&path)?, &|_, _| {})?;
        assert_eq!(found.findings, [], "{}", path.display());
    }
    Ok(())
}

/// A client whose patience is shorter than the way to that instant sends its change again, and gets the reply to the first.
#[test]
fn regress_a_change_that_waits_may_be_sent_again() -> Outcome {
    let service = Service::start(common::scene(&["pulse=[]"])?, Pace::Factor(1.0), None, PublishRate::Hz(100.0))?;
    let say = |id: &str, action: Action| {
        client::control(&service.client, &service.name, &Control { id: id.to_owned(), action: Some(action) })
    };
    // A step of 10 s can begin at 10 s, and a client waits for three.
    let longer = || say("long", Action::Set(wire::Set { changes: vec!["solver.step_s=10.0".to_owned()] }));
    assert!(longer().is_err());
    let replies = [(0..20).find_map(|_| longer().ok()).ok_or("no reply")?, longer()?];
    assert!(replies[0].accepted && replies[0].effective_sim_time_s == 10.0, "{replies:?}");
    assert_eq!(replies[0], replies[1]);
    let (_, folder) = service.stop()?;
    let commands: Vec<AppliedCommand> = common::decoded(&folder.path().join("run.mcap"), "commands")?;
    let changes = commands.iter().filter(|command| command.reply.as_ref().is_some_and(|reply| reply.id == "long"));
    assert_eq!(changes.count(), 1);
    Ok(())
}
