//! Deadlines: reports of missed ones, the policies, the age of samples. No test here depends on the speed of the machine.

mod common;

use std::io::Read as _;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use common::process::Victim;
use common::{Outcome, Service, scene};
use flexcrank::runtime::{Ending, Overrun, Pace};
use flexcrank::simulation::Simulation;
use flexcrank::wire::{Angles, Histogram, Overruns, Status};
use prost::Message as _;
use zenoh::Wait as _;

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
    assert_eq!((counted(&status.step_cost), counted(&status.lateness)), (Some(1000), Some(1000)));
    assert!(status.step_cost_max_s >= status.step_cost_p50_s);
    assert_eq!((status.sample_age, status.sample_age_max_s), (None, None), "without subscribers");
    Ok(())
}

fn counted(histogram: &Option<Histogram>) -> Option<u64> {
    histogram.as_ref().map(|all| all.counts.iter().sum())
}

/// The output thread is held up once, in the callback that it calls with every status. Samples wait meanwhile, steps do not.
#[test]
fn val_the_age_of_samples_is_what_an_outside_clock_measures() -> Outcome {
    const HELD: Duration = Duration::from_millis(300);
    let held: Arc<OnceLock<[SystemTime; 2]>> = Arc::default();
    let hold = Arc::clone(&held);
    let service = Service::start_as(tempfile::tempdir()?, scene(&[])?, Pace::Factor(1.0), Some(2.0), |live| {
        live.on_status = Box::new(move |status| {
            if status.stamp.is_some_and(|stamp| stamp.step > 200) {
                hold.get_or_init(|| {
                    let begun = SystemTime::now();
                    std::thread::sleep(HELD);
                    [begun, SystemTime::now()]
                });
            }
        });
    })?;
    let arrivals: Arc<Mutex<Vec<(Angles, SystemTime)>>> = Arc::default();
    let keep = Arc::clone(&arrivals);
    let keep = move |sample: zenoh::sample::Sample| {
        let angles = Angles::decode(sample.payload().to_bytes().as_ref()).unwrap_or_default();
        keep.lock().unwrap_or_else(PoisonError::into_inner).push((angles, SystemTime::now()));
    };
    let subscriber = service.client.declare_subscriber(format!("{}/angles", service.name.presence())).callback(keep);
    subscriber.background().wait().map_err(|error| error.to_string())?;
    let (_, folder) = service.finish()?;
    let status = common::decoded::<Status>(&folder.path().join("run.mcap"), "status")?.pop().ok_or("no status")?;

    let [begun, ended] = *held.get().ok_or("never held up")?;
    let arrivals = std::mem::take(&mut *arrivals.lock().unwrap_or_else(PoisonError::into_inner));
    let wall = |angles: &Angles| angles.stamp.and_then(|stamp| SystemTime::try_from(stamp.wall_time?).ok());
    // The start belongs to no step.
    let of_steps = arrivals.iter().filter(|(angles, _)| angles.stamp.is_some_and(|stamp| stamp.step > 0));
    let taken: Vec<_> = of_steps.filter_map(|(angles, arrived)| Some((wall(angles)?, *arrived))).collect();
    assert_eq!(counted(&status.sample_age), Some(taken.len() as u64), "every sample that came, once");
    // A step's deadline precedes its sample's wall time; by how much, lateness and cost of steps bound.
    let first = taken.iter().map(|(taken, _)| *taken).filter(|taken| *taken >= begun).min().ok_or("nothing after the hold")?;
    let longest = taken.iter().filter_map(|(taken, arrived)| arrived.duration_since(*taken).ok()).max().unwrap_or_default();
    let at_least_s = ended.duration_since(first)?.as_secs_f64();
    let at_most_s = longest.as_secs_f64() + status.lateness_max_s.unwrap_or(0.0) + status.step_cost_max_s.unwrap_or(0.0) + 0.05;
    let age_s = status.sample_age_max_s.ok_or("no age")?;
    assert!(0.99 * at_least_s <= age_s && age_s <= 1.01 * at_most_s, "{at_least_s} <= {age_s} <= {at_most_s}");
    assert!(at_least_s > 0.5 * HELD.as_secs_f64(), "samples come every 5 ms: {at_least_s}");
    let quantiles = [status.sample_age_p50_s, status.sample_age_p99_s, status.sample_age_p999_s, status.sample_age_max_s];
    assert!(quantiles[0] > Some(0.0) && quantiles.is_sorted(), "{quantiles:?}");
    Ok(())
}

/// It was published as it would be without the limit, up to 200 µs.
#[test]
fn regress_the_published_spin_is_at_most_a_fifth_of_the_time_between_deadlines() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["run", "--no-bus", "--until", "1.5", "--set", "solver.step_s=5e-4", "--record", "run.mcap"]);
    let ended = command.current_dir(folder.path()).stdin(Stdio::null()).output()?;
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    let told: Vec<Status> = common::decoded(&folder.path().join("run.mcap"), "status")?;
    let spins_s: Vec<f64> = told.iter().filter_map(|status| status.spin_s).collect();
    assert!(spins_s.iter().any(|spin_s| *spin_s > 0.0) && spins_s.iter().all(|spin_s| *spin_s <= 1e-4), "{spins_s:?}");
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
fn val_exit_codes_of_divergence_and_missed_deadlines() -> Outcome {
    let run = |arguments: &[&str]| {
        let ran =
            Command::new(env!("CARGO_BIN_EXE_flexcrank")).arg("run").args(arguments).args(["--no-bus", "--no-record"]).output();
        ran.map(|ran| (ran.status.code(), String::from_utf8_lossy(&ran.stderr).into_owned()))
    };
    let (code, said) = run(&["thesis-crank-slider", "--set", "solver.weight=0.48", "--pace", "max", "--until", "22.8"])?;
    assert_eq!(code, Some(4), "{said}");
    let (code, said) = run(&["--pace", "1e6", "--overrun", "stop", "--until", "1"])?;
    assert!(code == Some(5) && said.contains("missed its deadline"), "{said}");
    Ok(())
}

/// Nobody could ask for a step, and the run waited without end.
#[test]
fn regress_lockstep_without_the_bus_is_refused() -> Outcome {
    for more in [None, Some("--supervise")] {
        let folder = tempfile::tempdir()?;
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        command.args(["run", "--no-bus", "--pace", "lockstep", "--until", "1"]).args(more);
        let mut run = Victim(command.current_dir(folder.path()).stderr(Stdio::piped()).spawn()?);
        let begun = Instant::now();
        while run.0.try_wait()?.is_none() {
            assert!(begun.elapsed() < Duration::from_secs(60), "{more:?}: waits for steps");
            std::thread::sleep(Duration::from_millis(10));
        }
        let mut said = String::new();
        run.0.stderr.take().ok_or("no standard error")?.read_to_string(&mut said)?;
        let why = "error: --pace lockstep takes the steps that clients ask for, and with --no-bus nobody can ask";
        assert!(run.0.wait()?.code() == Some(2) && said.starts_with(why), "{more:?}: {said}");
        assert_eq!(std::fs::read_dir(folder.path())?.count(), 0);
    }
    Ok(())
}

/// The exit code and the remedy of a scene that diverges while `--fixed-cost` rates it are those of a run.
#[test]
fn regress_a_scene_that_diverges_while_it_is_rated_ends_as_a_run_does() -> Outcome {
    let run = ["run", "ref-r2s", "--set", "solver.step_s=0.05", "--until", "1", "--pace", "max", "--no-bus", "--no-record"];
    for more in [&[][..], &["--fixed-cost"]] {
        let ran = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(run).args(more).output()?;
        let said = String::from_utf8(ran.stderr)?;
        assert_eq!(ran.status.code(), Some(4), "{more:?}: {said}");
        assert!(said.contains("diverged in step 14 at t = 0.65 s"), "{more:?}: {said}");
        let remedy = "`flexcrank check SCENE --until TIME` suggests a step; `flexcrank trade SCENE --tolerance ERROR --until TIME` chooses one";
        assert_eq!(said.lines().last(), Some(remedy), "{more:?}: {said}");
    }
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
