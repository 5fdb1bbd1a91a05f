//! A service whose terminal is gone ends in order; one that was started to outlive its terminal goes on.

use std::net::TcpListener;
use std::process::{Command, Stdio};
use std::time::Duration;

use flexcrank::bus::{Name, Topic};
use rustix::process::{Pid, Signal, kill_process};

use crate::common::process::{Victim, connect};
use crate::common::{Listener, Outcome};

const PATIENCE: Duration = Duration::from_secs(60);

/// A recording whose service gets these signals one after another, each when it publishes; how SIGHUP is treated at its start.
fn is_whole(hangup: &str, signals: &[Signal]) -> Outcome<bool> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("run.mcap");
    let endpoint = format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?);
    let mut victim = Victim(
        Command::new("env")
            .args([hangup, env!("CARGO_BIN_EXE_flexcrank"), "run", "--name", "victim", "--listen", &endpoint, "--record"])
            .arg(&file)
            .stderr(Stdio::null())
            .spawn()?,
    );
    let client = connect(&endpoint)?;
    let name: Name = "victim".parse()?;
    let heard = Listener::new(&client, &name)?;
    for signal in signals {
        heard.wait_for(Topic::Angles, heard.payloads(Topic::Angles).len() + 10, PATIENCE)?;
        kill_process(Pid::from_child(&victim.0), *signal)?;
    }
    let ended = victim.0.wait()?;
    flexcrank::bus::close(&client)?;
    Ok(ended.success() && mcap::Summary::read(&std::fs::read(&file)?)?.is_some())
}

#[test]
fn regress_a_terminal_that_is_gone_ends_a_run_in_order() -> Outcome {
    assert!(is_whole("--default-signal=HUP", &[Signal::HUP])?);
    Ok(())
}

#[test]
fn prop_a_run_that_ignores_its_terminal_goes_on_without() -> Outcome {
    assert!(is_whole("--ignore-signal=HUP", &[Signal::HUP, Signal::HUP, Signal::TERM])?);
    Ok(())
}
