//! Gaps: every step that a full queue dropped is reported.

use std::collections::BTreeSet;
use std::sync::mpsc::{channel, sync_channel};
use std::time::Duration;

use flexcrank::runtime::{
    Outbox, Output, Pace, Ports, Spin, Stepper, SteppingOptions, ThreadOptions, inbox, run_stepping_thread,
};
use flexcrank::simulation::{PublishRate, PublishRates, Simulation};
use flexcrank::wire::{Angles, Energies, Gap, Loads, Stamp};

use crate::common::{self, Outcome, Service, scene};

/// Steps that should be there and are not.
fn missing(stamps: impl Iterator<Item = Option<Stamp>>, steps: u64) -> BTreeSet<u64> {
    let there: BTreeSet<u64> = stamps.flatten().map(|stamp| stamp.step).collect();
    (0..=steps).filter(|step| !there.contains(step)).collect()
}

#[test]
fn prop_every_missing_step_of_an_overloaded_run_is_in_a_gap() -> Outcome {
    let steps = 60_000;
    let service = Service::start_as(tempfile::tempdir()?, scene(&[])?, Pace::Factor(1e5), Some(steps as f64 * 1e-3), |live| {
        live.stepping.publish = PublishRate::All.into();
        // The output thread is held up again and again.
        live.on_status = Box::new(|_| std::thread::sleep(Duration::from_millis(25)));
    })?;
    let (report, folder) = service.finish()?;
    assert!(report.dropped > 0, "100,000 times real time is more than any queue takes");
    let file = folder.path().join("run.mcap");
    let gaps = common::decoded::<Gap>(&file, "gaps")?;
    let angles = missing(common::decoded::<Angles>(&file, "angles")?.into_iter().map(|row| row.stamp), steps);
    let loads = missing(common::decoded::<Loads>(&file, "loads")?.into_iter().map(|row| row.stamp), steps);
    let energies = missing(common::decoded::<Energies>(&file, "energies")?.into_iter().map(|row| row.stamp), steps);
    for (topic, missing) in [("angles", angles), ("loads", loads), ("energies", energies)] {
        let told: Vec<&Gap> = gaps.iter().filter(|gap| gap.topic == topic).collect();
        let count: u64 = told.iter().map(|gap| gap.count).sum();
        assert_eq!(missing.len() as u64, count, "{topic}: missing and told of");
        let explained = |step: &u64| {
            told.iter().any(|gap| (gap.first_step..=gap.stamp.as_ref().map_or(0, |stamp| stamp.step)).contains(step))
        };
        assert!(missing.iter().all(explained), "{topic}: every missing step is inside a gap");
    }
    Ok(())
}

#[test]
fn prop_samples_dropped_by_an_empty_pool_are_reported_by_topic() -> Outcome {
    let simulation = Simulation::new(&scene(&[])?.scene)?;
    let (inbox, commands) = inbox();
    let (output, outputs) = channel();
    let (_no_samples, pool) = sync_channel(1);
    let ports = Ports { commands, output: Outbox::new(output, 0), pool, shared: inbox.shared() };
    let publish = "all,loads=100,energies=10".parse::<PublishRates>()?;
    let stepping = SteppingOptions { pace: Pace::Factor(1e5), until_s: Some(0.5), publish, ..SteppingOptions::default() };
    let (finish, finished) = channel();
    let stepper = Stepper::new(simulation, None, stepping, ports)?;
    let options = ThreadOptions { spin: Spin::NONE, realtime: false };
    run_stepping_thread(vec![(stepper, Box::new(move |summary| drop(finish.send(summary))))], options);
    let dropped = finished.recv()?.dropped;
    let missed: Vec<_> = outputs
        .try_iter()
        .filter_map(|(_, output)| if let Output::MissedSamples(missed, _) = output { Some(missed) } else { None })
        .collect();
    let displacements = || missed.iter().filter_map(|missed| missed.displacements);
    assert_eq!((dropped, displacements().map(|missed| missed.count).sum::<u64>()), (501, 501));
    assert_eq!(displacements().next().map(|missed| missed.first_step), Some(0));
    assert_eq!(displacements().next_back().map(|missed| missed.last.step), Some(500));
    let loads = missed.iter().filter_map(|missed| missed.loads).map(|missed| missed.count);
    assert_eq!(loads.sum::<u64>(), 51, "loads are due every tenth step");
    let energies = missed.iter().filter_map(|missed| missed.energies).map(|missed| missed.count);
    assert_eq!(energies.sum::<u64>(), 6, "energies every hundredth");
    Ok(())
}
