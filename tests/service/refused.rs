//! Commands that a service refuses, in its log.

use std::io::Read as _;
use std::net::TcpListener;
use std::process::{Command, Stdio};

use flexcrank::bus::{self, Name, client};
use flexcrank::wire::{self, control::Action};

use crate::common::Outcome;
use crate::common::process::{Victim, connect};
use crate::{control, pulse};

/// zenoh ignores passwords in a build without them: the service was open, and the client was not admitted by another one.
#[cfg(not(feature = "tls"))]
#[test]
fn regress_passwords_in_a_build_without_them_are_a_usage_error() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("zenoh.json5");
    let service = ["run", "--no-record", "--until", "0.1", "--listen", "tcp/127.0.0.1:0", "--zenoh-config"];
    let client = ["list", "--connect", "tcp/127.0.0.1:9", "--zenoh-config"];
    for (words, keys, key) in [
        (&service[..], r#"dictionary_file: "users.txt""#, "dictionary_file"),
        (&service[..], r#"user: "service", password: "a""#, "user"),
        (&client[..], r#"user: "viewer", password: "a""#, "user"),
    ] {
        std::fs::write(&file, format!("{{ transport: {{ auth: {{ usrpwd: {{ {keys} }} }} }} }}"))?;
        let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).arg(&file).stdin(Stdio::null()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert_eq!(ended.status.code(), Some(2), "{words:?}: {said}");
        let why = format!("this build has no passwords, which transport/auth/usrpwd/{key} needs: build it with `--features tls`");
        assert!(said.contains(&why), "{words:?}: {said}");
    }
    Ok(())
}

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
