//! A recording that is still being written is said to end early; once it is closed, it is not.

use std::process::Stdio;
use std::time::Duration;

use flexcrank::bus::{self, Name, Topic};
use rustix::process::{Pid, Signal, kill_process};

use crate::common::{Listener, Outcome};
use crate::{Victim, connect, endpoint, flexcrank};

#[test]
fn regress_a_recording_still_being_written_is_said_to_end_early() -> Outcome {
    let (folder, endpoint) = (tempfile::tempdir()?, endpoint()?);
    let arguments = ["run", "crank-slider", "--name", "growing", "--listen", &endpoint, "--record", "run.mcap"];
    let mut command = flexcrank(&arguments);
    let mut running = Victim(command.current_dir(folder.path()).stderr(Stdio::null()).spawn()?);
    let client = connect(&endpoint)?;
    let name: Name = "growing".parse()?;
    Listener::new(&client, &name)?.wait_for(Topic::Angles, 200, Duration::from_secs(60))?;
    bus::close(&client)?;
    let readers: [&[&str]; 5] = [
        &["export", "run.mcap", "--csv", "tables"],
        &["plot", "run.mcap", "-o", "plots"],
        &["replay", "run.mcap", "--rate", "1000", "--name", "ghost", "--listen", "tcp/127.0.0.1:0"],
        &["info", "run.mcap"],
        &["verify", "run.mcap"],
    ];
    let ends_early = |words: &[&str]| -> Outcome<(Option<i32>, bool)> {
        let output = flexcrank(words).current_dir(folder.path()).stdin(Stdio::null()).output()?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
        assert_eq!(said.contains("ends early"), said.contains("still being recorded"), "{words:?}: {said}");
        Ok((output.status.code(), said.contains("ends early")))
    };
    for words in readers {
        assert_eq!(ends_early(words)?, (Some(3), true), "{words:?}");
    }
    kill_process(Pid::from_child(&running.0), Signal::TERM)?;
    assert!(running.0.wait()?.success());
    for words in readers {
        assert_eq!(ends_early(words)?, (Some(0), false), "{words:?}");
    }
    Ok(())
}
