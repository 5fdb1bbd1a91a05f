//! Commands that a service refuses, in its log.

use std::io::Read as _;
use std::net::TcpListener;
use std::process::{Command, Stdio};

use flexcrank::bus::{self, Name, client};
use flexcrank::wire::{self, control::Action};

use crate::common::Outcome;
use crate::common::process::{Victim, connect};
use crate::{control, pulse};

/// What a client is told in a reply is logged if it is beyond the limits of commands, and not if only its numbers are wrong.
#[test]
fn regress_a_query_with_an_id_that_is_too_long_is_logged() -> Outcome {
    let endpoint = format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?);
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["run", "--name", "refusing", "--no-record", "--listen", &endpoint]);
    let mut service = Victim(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?);
    let (client, name): (_, Name) = (connect(&endpoint)?, "refusing".parse()?);
    client::wait_for_service(&client, &name)?;
    for (id, torque_nm) in [("a".to_owned(), f64::NAN), ("b".repeat(129), 1.0)] {
        assert!(!client::pulse(&client, &name, &pulse(&id, torque_nm, 0.1))?.accepted, "{id}");
    }
    assert!(client::control(&client, &name, &control(Action::Stop(wire::Stop {})))?.accepted);
    bus::close(&client)?;
    let mut log = String::new();
    service.0.stderr.take().ok_or("no standard error")?.read_to_string(&mut log)?;
    let refused: Vec<&str> = log.lines().filter(|line| line.contains("a command was refused")).collect();
    assert!(matches!(refused[..], [line] if line.contains("the id has 129 bytes: 128 at most")), "{log}");
    Ok(())
}
