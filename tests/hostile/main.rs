//! Hostile input: clients that attack a service, files that lie, systems that run out of something.

mod attacked;
#[path = "../common/mod.rs"]
mod common;
mod descriptors;
mod devices;
mod growing;
mod index;
mod interrupted;
mod long_names;
mod memory;
mod resumed;
mod whole;

use std::process::Command;

use common::Outcome;
use common::process::{Victim, connect};

fn flexcrank(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(words);
    command
}

/// An endpoint that nobody uses.
fn endpoint() -> Outcome<String> {
    Ok(format!("tcp/{}", std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?))
}

/// A recording that comes with the program.
fn sample(name: &str) -> String {
    format!("{}/recordings/{name}", env!("CARGO_MANIFEST_DIR"))
}
