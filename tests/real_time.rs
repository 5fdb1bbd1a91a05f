//! Deadlines: reports of missed ones, and the policies. No test here depends on the speed of the machine.

mod common;

use common::{Outcome, Service, scene};
use flexcrank::runtime::{Ending, Overrun, Pace};
use flexcrank::simulation::Simulation;
use flexcrank::wire::{Overruns, Status};

/// A pace that no machine holds.
const HOPELESS: Pace = Pace::Factor(1e6);

/// Runs a second of simulated time at that pace; returns the last status and the reports of missed deadlines.
fn hurried(policy: Overrun) -> Result<(Ending, Status, Vec<Overruns>), Box<dyn std::error::Error>> {
    let service =
        Service::start_as(tempfile::tempdir()?, scene(&[])?, HOPELESS, Some(1.0), |live| live.stepping.overrun = policy)?;
    let (report, folder) = service.finish()?;
    let file = folder.path().join("run.mcap");
    let status = common::decoded::<Status>(&file, "status")?.pop().ok_or("no status")?;
    Ok((report.ending, status, common::decoded(&file, "overruns")?))
}

#[test]
fn prop_every_missed_deadline_is_in_the_ledger() -> Outcome {
    let (ending, status, told) = hurried(Overrun::CatchUp)?;
    assert_eq!(ending, Ending::Finished);
    assert!(status.overruns > 500, "{}", status.overruns);
    assert_eq!(told.iter().map(|told| told.count).sum::<u64>(), status.overruns);
    for told in &told {
        assert_eq!(told.causes.iter().map(|cause| cause.count).sum::<u64>(), told.count);
        assert!(told.misses.iter().all(|miss| miss.late_s > 0.0 && miss.late_s <= told.worst_s && miss.step >= told.first_step));
    }
    assert_eq!((status.pacing_epoch, status.given_up_s), (0, 0.0), "less than a second is chased");
    let counted = |histogram: Option<flexcrank::wire::Histogram>| histogram.map(|all| all.counts.iter().sum::<u64>());
    assert_eq!(counted(status.step_cost), Some(1000));
    assert!(counted(status.lateness) <= Some(1000) && status.step_cost_max_s >= status.step_cost_p50_s);
    Ok(())
}

#[test]
fn prop_skipping_moves_deadlines_and_reports_it() -> Outcome {
    let (ending, status, told) = hurried(Overrun::Skip)?;
    assert_eq!(ending, Ending::Finished);
    assert!(status.pacing_epoch > 0 && status.given_up_s > 0.0);
    let given_up_s: f64 = told.iter().map(|told| told.given_up_s).sum();
    assert!((given_up_s - status.given_up_s).abs() < 1e-9, "{given_up_s} {}", status.given_up_s);
    assert!(status.real_time_factor < Some(0.99e6), "lost time is not hidden: {:?}", status.real_time_factor);
    Ok(())
}

#[test]
fn prop_stopping_ends_at_the_first_miss() -> Outcome {
    let (ending, status, told) = hurried(Overrun::Stop)?;
    let Ending::Late { step, late } = ending else { return Err(format!("{ending:?}").into()) };
    assert_eq!((told.len(), told[0].first_step, told[0].worst_s), (1, step, late.as_secs_f64()));
    assert_eq!(status.stamp.map(|stamp| stamp.step + 1), Some(step), "the step that was late was not taken");
    assert!(status.message.contains("late"), "{}", status.message);
    Ok(())
}

#[test]
fn prop_time_is_steps_times_step_to_the_last_bit() -> Outcome {
    for step_s in [1e-3, 1.0 / 3.0 * 1e-3, 7e-4_f64] {
        let mut simulation = Simulation::new(&scene(&[&format!("solver.step_s={step_s}")])?.scene)?;
        let mut late = simulation.checkpoint();
        late.step = 1_000_000_000 - 3;
        assert!(simulation.restore(&late));
        for _ in 0..3 {
            simulation.step()?;
        }
        assert_eq!(simulation.step_count(), 1_000_000_000);
        assert_eq!(simulation.time_s().to_bits(), (1e9 * step_s).to_bits());
    }
    Ok(())
}
