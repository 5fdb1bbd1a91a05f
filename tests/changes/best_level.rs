//! The shadow at the best level: the error that cheaper levels leave, measured beside the run.

use std::time::Duration;

use flexcrank::bus::{Topic, client};
use flexcrank::resimulation::{BestLevelRun, Change, RecordedSession, verify, what_if};
use flexcrank::runtime::Pace;
use flexcrank::service::SecondRun;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::control::Action;
use flexcrank::wire::{self, Angles, Control, Shadow, TorquePulse};

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
