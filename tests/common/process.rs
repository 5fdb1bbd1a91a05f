//! The program in a process of its own, and a client of it.

use std::process::Child;
use std::time::{Duration, Instant};

use flexcrank::bus::{BusOptions, Session};

use super::Outcome;

/// Kills, and reaps, whatever happens.
pub struct Victim(pub Child);

impl Drop for Victim {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Connects as soon as the service is there.
pub fn connect(endpoint: &str) -> Outcome<Session> {
    let begun = Instant::now();
    loop {
        match (BusOptions { connect: vec![endpoint.to_owned()], ..BusOptions::default() }).open_client() {
            Err(error) if begun.elapsed() > Duration::from_secs(60) => return Err(error.into()),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
            Ok(session) => return Ok(session),
        }
    }
}
