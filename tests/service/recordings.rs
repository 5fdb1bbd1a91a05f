//! Recordings begun over the bus.

use std::time::Duration;

use flexcrank::bus::client;
use flexcrank::resimulation::{Finding, RecordedSession, verify};
use flexcrank::runtime::Pace;
use flexcrank::scene::{SceneSource, builtin};
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{self, control::Action};

use crate::common::rewritten::{Contents, as_is};
use crate::common::{Outcome, Service};
use crate::control;

/// Longest wait for the answer to an advance.
const PATIENCE: Duration = Duration::from_secs(30);

/// The command that starts the recording comes before the checkpoint that tells the step in force.
#[test]
fn regress_a_recording_begun_after_the_step_has_changed_is_as_recorded() -> Outcome {
    let text = builtin::find("crank-slider")?.text;
    let levels = "\n[[level]]\nname = \"coarse\"\n\n[[level]]\nname = \"fine\"\nchanges = [\"solver.step_s=0.001\"]\n";
    let scene = SceneSource::parse("leveled.toml", &format!("{text}{levels}"), &[])?;
    for change in [
        Action::Set(wire::Set { changes: vec!["solver.step_s=0.001".to_owned()] }),
        Action::Level(wire::Level { name: "fine".to_owned() }),
    ] {
        let service = Service::start(scene.clone(), Pace::Factor(1.0), None, PublishRate::Hz(200.0))?;
        let say = |action| client::control(&service.client, &service.name, &control(action));
        let advance = wire::Advance { steps: 101, ..wire::Advance::default() };
        let on = || -> Outcome {
            let advanced = client::advance(&service.client, &service.name, &advance, PATIENCE)?;
            assert!(advanced.reply.is_some_and(|reply| reply.accepted));
            Ok(())
        };
        let start = |name: &str| Action::StartRecording(wire::StartRecording { name: name.to_owned() });
        assert!(say(Action::StopRecording(wire::StopRecording {}))?.accepted && say(Action::Pause(wire::Pause {}))?.accepted);
        let reply = say(change)?;
        assert!(reply.accepted, "{}", reply.reason);
        on()?;
        assert!(say(start("changed"))?.accepted);
        on()?;
        assert!(say(Action::StopRecording(wire::StopRecording {}))?.accepted && say(Action::Reset(wire::Reset {}))?.accepted);
        on()?;
        assert!(say(start("reset"))?.accepted);
        on()?;
        let (_, folder) = service.stop()?;
        for name in ["changed.mcap", "reset.mcap"] {
            let file = folder.path().join(name);
            let found = verify(&RecordedSession::open(&file)?, &|_, _| {})?;
            assert_eq!(found.findings, [], "{name}");
            let mut forged = Contents::read(&file, &as_is)?;
            forged.messages[0].log_time -= 1;
            forged.write(&file.with_file_name("forged.mcap"))?;
            let found = verify(&RecordedSession::open(&file.with_file_name("forged.mcap"))?, &|_, _| {})?;
            let is_told = |finding: &Finding| matches!(finding, Finding::Time { topic, .. } if topic == "commands");
            assert!(matches!(&found.findings[..], [finding] if is_told(finding)), "{name}: {:?}", found.findings);
        }
    }
    Ok(())
}
