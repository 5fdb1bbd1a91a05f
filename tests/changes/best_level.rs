//! The shadow at the best level: the error that cheaper levels leave, measured beside the run.

use std::time::{Duration, SystemTime};

use flexcrank::bus::{Topic, client};
use flexcrank::resimulation::{BestLevelRun, Change, RecordedSession, verify, what_if};
use flexcrank::runtime::Pace;
use flexcrank::scene::SceneSource;
use flexcrank::service::SecondRun;
use flexcrank::simulation::{PublishRate, Simulation, Stamp};
use flexcrank::wire::applied_command::Command;
use flexcrank::wire::control::Action;
use flexcrank::wire::{self, Angles, AppliedCommand, Control, Setpoint, Shadow, TorquePulse};

use crate::common::{self, Outcome, Service};
use crate::service::leveled;

/// The truth is the recording computed again with the changes of all levels taken away. It takes commands from the file, the shadow took
/// them from the run.
#[test]
fn val_the_shadow_at_the_best_level_is_the_run_without_cheaper_levels() -> Outcome {
    let scene = leveled()?;
    let second = SecondRun::BestLevel(Box::new(BestLevelRun::new(&scene)?));
    let folder = tempfile::tempdir()?;
    let service = Service::start_with(folder, scene, Some(second), Pace::Factor(10.0), None, PublishRate::Hz(100.0))?;
    let listener = common::Listener::new(&service.client, &service.name)?;
    let control = |action| client::control(&service.client, &service.name, &Control { id: String::new(), action: Some(action) });
    let set = |change: &str| Action::Set(wire::Set { changes: vec![change.to_owned()] });
    let mut heard = 0;
    for (round, name) in ["rough", "fair", "good", "rough", "fair"].into_iter().enumerate() {
        assert!(control(Action::Level(wire::Level { name: name.to_owned() }))?.accepted);
        let pulse = TorquePulse { torque_nm: 5.0, duration_s: 0.0503, delay_s: 0.0107, ..TorquePulse::default() };
        assert!(client::pulse(&service.client, &service.name, &pulse)?.accepted);
        assert!(control(set(&format!("slider.mass_kg={}", 0.2 + 0.01 * round as f64)))?.accepted);
        if round == 2 {
            assert!(control(Action::Reset(wire::Reset {}))?.accepted);
        }
        heard += 100;
        listener.wait_for(Topic::Angles, heard, Duration::from_secs(60))?;
    }
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let source = RecordedSession::open(&file)?;
    assert_eq!(verify(&source, &|_, _| {})?.findings, []);
    let overrides = ["level.1.changes=[]", "level.2.changes=[]"].map(str::to_owned).to_vec();
    let best = file.with_file_name("best.mcap");
    what_if(&source, &Change { overrides, ..Change::default() }, &best, &|_| {})?;
    let at = |stamp: &Option<wire::Stamp>| stamp.as_ref().map(|stamp| (stamp.epoch, stamp.sim_time_s.to_bits()));
    let (run, best): (Vec<Angles>, Vec<Angles>) = (common::decoded(&file, "angles")?, common::decoded(&best, "angles")?);
    let statuses: Vec<wire::Status> = common::decoded(&file, "status")?;
    let lost: Vec<&str> =
        statuses.iter().map(|status| status.message.as_str()).filter(|message| message.contains("shadow")).collect();
    assert!(lost.is_empty(), "{lost:?}");
    let measured: Vec<Shadow> = common::decoded(&file, "shadow")?;
    let truth: Vec<_> =
        run.iter().zip(&best).map(|(run, best)| (at(&run.stamp), best.links[0].chord_rad - run.links[0].chord_rad)).collect();
    let found: Vec<_> = measured.iter().map(|shadow| (at(&shadow.stamp), shadow.angle_rad)).collect();
    assert!(run.len() >= heard && best.len() == run.len() && found.len() == truth.len(), "{} of {}", found.len(), truth.len());
    let other = found.iter().zip(&truth).position(|(found, truth)| found != truth);
    assert_eq!(other.map(|place| (found[place], truth[place])), None, "message {other:?}");
    assert!(truth.iter().any(|(_, error_rad)| error_rad.abs() > 1e-4), "cheaper levels err");
    assert!(measured.iter().all(|shadow| shadow.model == "modal" && shadow.shadow_step_s > 0.0));
    Ok(())
}

/// The run's steps are half as long as the best level's: a command between two of those takes effect at the later one.
#[test]
fn regress_commands_between_the_steps_of_the_best_level_are_followed() -> Outcome {
    let mut best = BestLevelRun::new(&leveled()?)?;
    let mut run = Simulation::new(&SceneSource::open("crank-slider", &["solver.step_s=1e-3".to_owned()])?.scene)?;
    for step in 1..=20 {
        run.step()?;
        let sim_time_s = run.time_s();
        let at = Some(wire::Stamp { step, sim_time_s, ..wire::Stamp::default() });
        let setpoint = Command::Setpoint(Setpoint { torque_nm: 0.1, hold_s: 1.0, ..Setpoint::default() });
        best.apply(&AppliedCommand { stamp: at, command: Some(setpoint), ..AppliedCommand::default() }, run.step_s())?;
        let pulse = TorquePulse { torque_nm: 1.0, duration_s: 0.01, ..TorquePulse::default() };
        best.apply(
            &AppliedCommand { stamp: at, command: Some(Command::Torque(pulse)), ..AppliedCommand::default() },
            run.step_s(),
        )?;
        let stamp = Stamp { step, epoch: 0, sim_time_s, epoch_start_s: 0.0, wall: SystemTime::UNIX_EPOCH };
        assert_eq!(best.difference(run.observe()?, &stamp)?.is_some(), step % 2 == 0, "step {step}");
    }
    Ok(())
}
