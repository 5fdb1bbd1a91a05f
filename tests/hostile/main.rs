//! Hostile input: clients that attack a service, files that lie, systems that run out of something.

mod attacked;
#[path = "../common/mod.rs"]
mod common;
mod descriptors;
mod devices;
mod growing;
mod index;
mod long_names;
mod memory;
mod resumed;
mod whole;

use std::process::{Child, Command};
use std::time::{Duration, Instant};

use common::Outcome;
use flexcrank::bus::{BusOptions, Session};

/// Kills, and reaps, whatever happens.
struct Victim(Child);

impl Drop for Victim {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn flexcrank(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(words);
    command
}

/// An endpoint that nobody uses.
fn endpoint() -> Outcome<String> {
    Ok(format!("tcp/{}", std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?))
}

/// Connects as soon as the service is there.
fn connect(endpoint: &str) -> Outcome<Session> {
    let begun = Instant::now();
    loop {
        match (BusOptions { connect: vec![endpoint.to_owned()], ..BusOptions::default() }).open_client() {
            Err(error) if begun.elapsed() > Duration::from_secs(60) => return Err(error.into()),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
            Ok(session) => return Ok(session),
        }
    }
}

/// A recording that comes with the program.
fn sample(name: &str) -> String {
    format!("{}/recordings/{name}", env!("CARGO_MANIFEST_DIR"))
}
