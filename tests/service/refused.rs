//! Commands that a service refuses, in its log.

use std::io::Read as _;
use std::net::TcpListener;
use std::process::{Command, Stdio};

#[cfg(target_os = "linux")]
use flexcrank::bus::NameClaim;
use flexcrank::bus::{self, BusOptions, Name, client};
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

/// A service that was stopped by Ctrl-Z keeps its name, and a client was told to start it, which was refused.
#[cfg(target_os = "linux")]
#[test]
fn regress_a_service_that_has_its_name_and_does_not_answer_is_not_to_be_started() -> Outcome {
    let name = format!("silent-{}", std::process::id());
    let claim = NameClaim::take(&name.parse()?);
    let told = |more: &[&str]| -> Outcome<(Option<i32>, String)> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        let ended = command.args(["control", &name, "pause"]).args(more).stdin(Stdio::null()).output()?;
        Ok((ended.status.code(), String::from_utf8(ended.stderr)?))
    };
    let why = "runs on this machine, but does not answer: one that was stopped (Ctrl-Z) goes on with `fg` ";
    let silent = format!("a service named `{name}` {why}");
    let (code, said) = told(&[])?;
    assert!(code == Some(1) && said.starts_with(&format!("error: {silent}")) && !said.contains("start it"), "{said}");
    let (code, said) = told(&["--wait=100ms"])?;
    assert!(code == Some(1) && said.contains(&format!(" did not appear in 0.1 s: {silent}")), "{said}");
    // Whoever names an endpoint does not ask this machine.
    let (_, said) = told(&["--connect", "tcp/127.0.0.1:9"])?;
    assert!(!said.contains("runs on this machine"), "{said}");
    drop(claim);
    let (_, said) = told(&[])?;
    assert!(!said.contains("runs on this machine"), "{said}");
    Ok(())
}

/// The usual ports of this machine were blamed, though the endpoint that was given answers.
#[test]
fn regress_a_list_where_something_listens_and_no_service_answers_says_so() -> Outcome {
    let endpoint = format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?);
    let session = BusOptions { listen: vec![endpoint.clone()], ..BusOptions::default() }.open_service()?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    let ended = command.args(["list", "--connect", &endpoint]).stdin(Stdio::null()).output()?;
    bus::close(&session)?;
    let said = String::from_utf8(ended.stderr)?;
    let way = "error: no service answers: start one with `flexcrank run`; one that was stopped (Ctrl-Z) goes on with `fg` ";
    assert!(ended.status.code() == Some(1) && said.starts_with(way), "{said}");
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

/// The command was carried out, and the failure of printing its reply read as a refusal.
#[test]
fn regress_a_reply_that_cannot_be_printed_is_told_all_the_same() -> Outcome {
    let endpoint = format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?);
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["run", "--name", "unprinted", "--no-record", "--listen", &endpoint]);
    let _service = Victim(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?);
    let (client, name): (_, Name) = (connect(&endpoint)?, "unprinted".parse()?);
    client::wait_for_service(&client, &name)?;
    bus::close(&client)?;
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("pulses.csv");
    std::fs::write(&file, "torque_nm,duration_s\n1,0.1\n1,0.1\n")?;
    let file = file.to_str().ok_or("a path that is no text")?;
    for (words, what) in [
        (&["pulse", "unprinted", "--torque", "1", "--duration", "100ms"][..], "pulse"),
        (&["pulse", "unprinted", "--from", file], "pulse of line 2, the last that was sent,"),
        (&["setpoint", "unprinted", "--torque", "0", "--hold", "1ms", "--json"], "setpoint"),
        (&["control", "unprinted", "pause"], "command"),
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full")?;
        let mut sent = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        let ended = sent.args(words).args(["--connect", &endpoint]).stdin(Stdio::null()).stdout(full).output()?;
        let said = String::from_utf8(ended.stderr)?;
        let why = format!("error: standard output: No space left on device (os error 28); the {what} was accepted\n");
        assert!(ended.status.code() == Some(1) && said.ends_with(&why), "{words:?}: {said}");
    }
    Ok(())
}
