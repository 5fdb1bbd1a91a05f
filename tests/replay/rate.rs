//! Rates, as an outside clock measures them. A stall of the machine delays messages; nothing makes them early.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use flexcrank::runtime::Pace;
use flexcrank::service::{ReplayOptions, ReplayReport};
use flexcrank::simulation::PublishRate;
use flexcrank::wire::Angles;
use prost::Message as _;
use zenoh::Wait as _;

use crate::common::{self, Outcome, Service, scene};
use crate::{PATIENCE, Playing, ghost};

/// Time that a stall of the machine may add, s. A clock that is off by a third adds more, or is early.
const STALL_S: f64 = 1.0;
/// Recorded samples a second.
const PER_S: f64 = 100.0;

/// A replay as a subscriber saw it: the start of everything, and each sample's recorded time and arrival, s.
struct Seen {
    report: ReplayReport,
    samples: Vec<[f64; 2]>,
}

/// Arrival, s, and payload.
type Arrival = (f64, Vec<u8>);

fn replayed(options: ReplayOptions, expected: usize) -> Outcome<Seen> {
    let begun = Instant::now();
    let playing = Playing::start(ReplayOptions { name: Some(ghost()), wait_for: 1, ..options })?;
    let arrivals: Arc<Mutex<Vec<Arrival>>> = Arc::default();
    let keep = Arc::clone(&arrivals);
    let arrived = move |sample: zenoh::sample::Sample| {
        let arrival = (begun.elapsed().as_secs_f64(), sample.payload().to_bytes().into_owned());
        keep.lock().map(|mut all| all.push(arrival)).unwrap_or(());
    };
    let subscriber = playing.client.declare_subscriber("flexcrank/ghost/angles").callback(arrived);
    subscriber.background().wait().map_err(|error| error.to_string())?;
    let come = || arrivals.lock().map(|all| all.len()).unwrap_or(0);
    while come() < expected {
        assert!(begun.elapsed() < 5 * PATIENCE, "{} of {expected} samples", come());
        std::thread::sleep(Duration::from_millis(2));
    }
    let report = playing.finish()?;
    let arrivals = std::mem::take(&mut *arrivals.lock().map_err(|_| "poisoned")?);
    let sample = |(at_s, payload): Arrival| -> Outcome<[f64; 2]> {
        Ok([common::time_s(&Angles::decode(payload.as_slice())?.stamp), at_s])
    };
    Ok(Seen { report, samples: arrivals.into_iter().map(sample).collect::<Outcome<_>>()? })
}

fn samples_in(duration_s: f64) -> usize {
    (duration_s * PER_S) as usize + 1
}

/// No sample comes before its recorded time over the rate, nor a second after that. The report agrees.
#[test]
fn val_the_rate_is_the_one_asked_for() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Max, Some(20.0), PublishRate::Hz(PER_S))?;
    let (_, folder) = service.finish()?;
    let file = folder.path().join("run.mcap");
    let cases = [(0.5, 3.0), (1.0, 5.0), (2.0, 8.0), (10.0, 20.0)];
    let replay = |(rate, duration_s): (f64, f64)| {
        let topics = vec!["angles".to_owned()];
        let options =
            ReplayOptions { file: file.clone(), rate, duration_s: Some(duration_s), topics, ..ReplayOptions::default() };
        move || replayed(options, samples_in(duration_s)).map_err(|error| error.to_string())
    };
    let replays = cases.map(|case| (case, std::thread::spawn(replay(case))));
    for ((rate, duration_s), thread) in replays {
        let Seen { report, samples } = thread.join().map_err(|_| "a replay panicked")??;
        assert_eq!((samples.len(), report.messages), (samples_in(duration_s), samples_in(duration_s) as u64));
        let [first_s, first_arrival_s] = samples[0];
        for [time_s, arrival_s] in &samples {
            let due_s = (time_s - first_s) / rate;
            assert!(*arrival_s >= due_s, "rate {rate}: {time_s} s comes after {arrival_s} s");
            assert!(arrival_s - first_arrival_s < due_s + STALL_S, "rate {rate}: {time_s} s comes after {arrival_s} s");
        }
        let [last_s, last_arrival_s] = samples[samples.len() - 1];
        let took_s = last_arrival_s - first_arrival_s;
        println!("rate {rate}: {} s took {took_s:.4} s; {report:?}", last_s - first_s);
        // A message that came late was not put before it was due: the report can state no more lateness than was seen.
        let latest_s = samples.iter().map(|[time_s, arrival_s]| arrival_s - (time_s - first_s) / rate).fold(0.0, f64::max);
        let late = report.lateness.ok_or("no lateness")?;
        assert!(late.p50_s <= late.p99_s && late.p99_s <= late.max_s && late.max_s <= latest_s, "{late:?} of {latest_s} s");
        let achieved = report.achieved_rate.ok_or("no rate")?;
        let least = (last_s - first_s) / ((last_s - first_s) / rate + STALL_S);
        assert!((least..=rate * (1.0 + 1e-6)).contains(&achieved), "{achieved} for {rate}");
    }
    Ok(())
}
