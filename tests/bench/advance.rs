//! Round trips of `advance` beside zenoh's own, in the same run over loopback: `cargo bench --bench advance`.
//!
//! Fails when an advance, less its step, takes more than 1.5 times as long as a query that is answered at once, with an answer as
//! long. As a test (`cargo test --bench advance`) it makes few round trips and judges nothing.

#[path = "../common/mod.rs"]
mod common;

use std::error::Error;
use std::time::{Duration, Instant};

use common::Service;
use flexcrank::bus::{Session, client};
use flexcrank::runtime::Pace;
use flexcrank::scene::SceneSource;
use flexcrank::simulation::Simulation;
use flexcrank::wire::{Advance, AdvanceReply};
use prost::Message as _;
use zenoh::Wait as _;

const ROUNDS: usize = 21;
const PATIENCE: Duration = Duration::from_secs(10);
const MOST: f64 = 1.5;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo gives this option to benchmarks, and not to tests.
    let judges = std::env::args().any(|word| word == "--bench");
    let (rounds, count) = if judges { (ROUNDS, 500) } else { (3, 100) };
    let scene = SceneSource::open("crank-slider", &[])?;
    let service = Service::start_as(tempfile::tempdir()?, scene.clone(), Pace::Lockstep, None, |live| live.record = None)?;
    let message = Advance { id: String::new(), torque_nm: Some(0.1), steps: 1 };
    let answer = client::advance(&service.client, &service.name, &message, PATIENCE)?;
    let (_echo, client) = echo(answer.encode_to_vec())?;
    let step_s = step_s(&scene)?;
    let (mut plain, mut advances) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        plain.push(seconds(count, || query(&client, &message))?);
        advances.push(seconds(count, || Ok(client::advance(&service.client, &service.name, &message, PATIENCE)?))?);
    }
    service.stop()?;
    let (plain_s, advance_s) = (median(&mut plain), median(&mut advances));
    let ratio = (advance_s - step_s) / plain_s;
    println!("zenoh's own query    {:6.1} µs, {:6.0} a second", 1e6 * plain_s, 1.0 / plain_s);
    println!(
        "advance of one step  {:6.1} µs, {:6.0} a second (the step: {:.1} µs)",
        1e6 * advance_s,
        1.0 / advance_s,
        1e6 * step_s
    );
    println!("less the step, {ratio:.2} times zenoh's own, median of {rounds} rounds of {count}");
    if judges && ratio > MOST { Err(format!("more than {MOST}").into()) } else { Ok(()) }
}

/// Mean time of a call, s.
fn seconds<T>(count: u32, mut call: impl FnMut() -> Result<T, Box<dyn Error>>) -> Result<f64, Box<dyn Error>> {
    let begun = Instant::now();
    for _ in 0..count {
        call()?;
    }
    Ok(begun.elapsed().as_secs_f64() / f64::from(count))
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Time of a step, s.
fn step_s(scene: &SceneSource) -> Result<f64, Box<dyn Error>> {
    let mut simulation = Simulation::new(&scene.scene)?;
    seconds(1000, || Ok(simulation.step()?))
}

/// A pair of linked sessions, one of which answers every query at once.
fn echo(answer: Vec<u8>) -> Result<(Session, Session), Box<dyn Error>> {
    let (server, client) = common::linked_sessions()?;
    let reply = move |query: zenoh::query::Query| {
        // As the service does; without a reply, the client fails.
        if query.payload().is_some_and(|payload| Advance::decode(&*payload.to_bytes()).is_ok()) {
            let _ = query.reply("echo", answer.clone()).wait();
        }
    };
    server.declare_queryable("echo").callback(reply).background().wait().map_err(|error| error.to_string())?;
    while client.get("echo").payload(Advance::default().encode_to_vec()).wait().is_ok_and(|replies| replies.recv().is_err()) {}
    Ok((server, client))
}

fn query(client: &Session, message: &Advance) -> Result<AdvanceReply, Box<dyn Error>> {
    let replies = client.get("echo").payload(message.encode_to_vec()).wait().map_err(|error| error.to_string())?;
    let sample = replies.recv().map_err(|error| error.to_string())?.into_result().map_err(|error| error.to_string())?;
    Ok(AdvanceReply::decode(&*sample.payload().to_bytes())?)
}
