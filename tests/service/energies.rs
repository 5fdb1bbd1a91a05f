//! Energies and statuses of a run: their rates, and that they add up.

use std::time::{Duration, Instant};

use flexcrank::bus::{Topic, client};
use flexcrank::runtime::Pace;
use flexcrank::scene::SceneSource;
use flexcrank::simulation::{PublishRate, PublishRates};
use flexcrank::wire::{self, Displacements, Energies, Loads, Status};
use prost::Message;

use crate::common::{self, Outcome, Service, scene};

/// A run as fast as it can be, to `until_s`, whose topics are published at `rates`; its recording is in `run.mcap`.
fn recorded(scene: SceneSource, until_s: f64, rates: &str) -> Outcome<tempfile::TempDir> {
    let rates: PublishRates = rates.parse()?;
    let service = Service::start_as(tempfile::tempdir()?, scene, Pace::Max, Some(until_s), |live| live.stepping.publish = rates)?;
    Ok(service.finish()?.1)
}

fn steps(stamps: impl Iterator<Item = Option<wire::Stamp>>) -> Vec<u64> {
    stamps.flatten().map(|stamp| stamp.step).collect()
}

/// kinetic + strain + potential.
fn total_j(energies: &Energies) -> f64 {
    [energies.kinetic_j, energies.strain_j, energies.potential_j].into_iter().flatten().sum()
}

#[test]
fn prop_energies_come_at_their_own_rate_and_add_up() -> Outcome {
    let overrides = ["gravity.y_m_per_s2=-9.81".to_owned()];
    let folder = recorded(SceneSource::open("crank-slider", &overrides)?, 2.0, "200,energies=50")?;
    let file = folder.path().join("run.mcap");
    let step_s = SceneSource::open("crank-slider", &overrides)?.scene.solver.step_s;
    let rows = common::decoded::<Energies>(&file, "energies")?;
    let expected: Vec<u64> = (0..=100).map(|n| (f64::from(n) * 0.02 / step_s).round() as u64).collect();
    assert_eq!(steps(rows.iter().map(|row| row.stamp)), expected);
    assert_eq!(common::payloads(&file, "loads")?.len(), 401);
    let start_j = total_j(&rows[0]);
    for row in &rows {
        let number = |value: Option<f64>, what: &str| value.ok_or_else(|| format!("no {what}: {row:?}"));
        let work_in_j = number(row.work_in_j, "work put in")?;
        let dissipated_j = number(row.dissipated_j, "work dissipated")?;
        let in_play_j = number(row.energy_in_play_j, "energy in play")?;
        let balance_j = total_j(row) - start_j - work_in_j + dissipated_j;
        let error_j = balance_j - number(row.balance_error_j, "balance")?;
        assert!(error_j.abs() <= 1e-14 * (in_play_j + start_j.abs()), "{error_j:e} J off: {row:?}");
        assert!(in_play_j >= row.kinetic_j.unwrap_or(0.0) * 0.99, "{row:?}");
    }
    let last = rows.last().ok_or("no energies")?;
    assert!(last.dissipated_j > Some(0.0) && last.strain_j > Some(0.0) && last.potential_j.is_some(), "{last:?}");
    let status = common::decoded::<Status>(&file, "status")?.pop().ok_or("no status")?;
    let of_status = [status.kinetic_j, status.strain_j, status.potential_j, status.work_in_j, status.dissipated_j];
    assert_eq!(of_status, [last.kinetic_j, last.strain_j, last.potential_j, last.work_in_j, last.dissipated_j]);
    Ok(())
}

#[test]
fn prop_energies_have_the_rate_of_loads_by_default() -> Outcome {
    let folder = recorded(scene(&[])?, 1.0, "10,loads=37")?;
    let file = folder.path().join("run.mcap");
    let energies = steps(common::decoded::<Energies>(&file, "energies")?.iter().map(|row| row.stamp));
    let loads = steps(common::decoded::<Loads>(&file, "loads")?.iter().map(|row| row.stamp));
    assert_eq!((energies.len(), &energies), (38, &loads), "the first, and 37 of which one is the last");
    Ok(())
}

#[test]
fn prop_an_oscillator_has_energies_too() -> Outcome {
    let folder = recorded(SceneSource::open("thesis-two-masses", &[])?, 10.0, "20,energies=4")?;
    let file = folder.path().join("run.mcap");
    let rows = common::decoded::<Energies>(&file, "energies")?;
    assert_eq!((rows.len(), common::decoded::<Displacements>(&file, "displacements")?.len()), (41, 201));
    for topic in ["angles", "loads"] {
        assert!(common::payloads(&file, topic)?.is_empty(), "{topic}");
    }
    assert!(rows.iter().all(|row| row.strain_j.is_some()) && rows.iter().any(|row| row.kinetic_j > Some(0.0)));
    // It has no angle whose error could be estimated: that of its first mass, in m, was published as an angle.
    let statuses = common::decoded::<Status>(&file, "status")?;
    let is_estimated = |status: &Status| status.estimated_angle_error_rad.or(status.step_error_max_rad).is_some();
    assert!(!statuses.is_empty() && !statuses.iter().any(is_estimated));
    Ok(())
}

#[test]
fn prop_energies_reach_subscribers_and_the_snapshot() -> Outcome {
    let service = Service::start_as(tempfile::tempdir()?, scene(&[])?, Pace::Factor(1.0), None, |live| live.record = None)?;
    let begun = Instant::now();
    // The snapshot is empty until the first state has been handed over.
    let (mut joined, before) = loop {
        let joined = client::join(&service.client, &service.name, Topic::Energies)?;
        if let Some(stamp) = joined.snapshot.energies.and_then(|energies| energies.stamp) {
            break (joined, stamp);
        }
        assert!(begun.elapsed() < Duration::from_secs(10), "none in the snapshot");
    };
    let (payload, missing) = joined.next(Duration::from_secs(10)).ok_or("nothing comes")?;
    let first = Energies::decode(payload.as_slice())?;
    assert_eq!((missing, first.stamp.map(|stamp| stamp.step)), (0, Some(before.step + 5)), "200 times a second");
    service.stop()?;
    Ok(())
}

#[test]
fn regress_a_run_at_full_pace_has_a_status_in_every_half_second_of_simulated_time() -> Outcome {
    let folder = recorded(scene(&[])?, 300.0, "1")?;
    let statuses = common::decoded::<Status>(&folder.path().join("run.mcap"), "status")?;
    let at = steps(statuses.iter().map(|status| status.stamp));
    assert!(at.is_sorted());
    let by_simulated_time = (0..=600).filter(|n| at.contains(&(500 * n))).count();
    assert_eq!(by_simulated_time, 601, "{} statuses", at.len());
    // On a machine that is slow, more come by the wall clock, of which none is in place of those.
    assert!(at.len() < 1000, "{} statuses", at.len());
    assert_eq!(statuses.last().map(Status::state), Some(wire::status::State::Finished));
    Ok(())
}

#[test]
fn prop_statuses_by_simulated_time_move_nothing() -> Outcome {
    let run = |pace: Pace| -> Outcome<_> {
        let modal = SceneSource::open("crank-slider", &[])?;
        let (_, folder) = Service::start(modal, pace, Some(3.0), PublishRate::Hz(10.0))?.finish()?;
        let file = folder.path().join("run.mcap");
        let rows = common::decoded::<Energies>(&file, "energies")?;
        let timeless: Vec<Energies> = rows.into_iter().map(|row| Energies { stamp: None, ..row }).collect();
        Ok((timeless, common::payloads(&file, "status")?.len()))
    };
    let (real, fast, slow) = (run(Pace::Factor(1.0))?, run(Pace::Max)?, run(Pace::Factor(0.75))?);
    assert!(real.0 == fast.0 && real.0 == slow.0, "the same bits, whoever looks at them when");
    assert!(fast.1 >= 7 && slow.1 > fast.1, "{} statuses at full pace, {} at less than real time", fast.1, slow.1);
    Ok(())
}
