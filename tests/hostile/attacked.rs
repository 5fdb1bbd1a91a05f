//! Declarations on keys of thousands of chunks, at which zenoh overflows its stack: a service survives them; if its configuration
//! lifts the limits, a supervisor resumes it.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use flexcrank::bus::{self, Name, Topic, client};
use flexcrank::recording::has_checkpoint;
use flexcrank::wire::{Angles, TorquePulse};
use prost::Message as _;
use rustix::process::{Pid, Signal, kill_process};
use zenoh::Wait as _;

use crate::common::{Listener, Outcome, decoded};
use crate::{Victim, connect, endpoint, flexcrank};

const PATIENCE: Duration = Duration::from_secs(60);
/// Variables of the attacking process.
const ENDPOINT: &str = "ATTACKED_ENDPOINT";
const CHUNKS: &str = "ATTACKED_CHUNKS";

/// The attacking process: declares a subscriber on a long key, and leaves.
#[test]
#[ignore = "is started by the other tests, with larger stacks"]
fn attacker() -> Outcome {
    let session = connect(&std::env::var(ENDPOINT)?)?;
    let key = vec!["c"; std::env::var(CHUNKS)?.parse()?].join("/");
    let subscriber = session.declare_subscriber(key).callback(|_| {}).wait();
    // The declaration has arrived when the answer to a later query has.
    let _ = client::wait_for_service(&session, &"victim".parse()?);
    drop(subscriber);
    // A service that is gone already is no failure of the attack.
    let _ = bus::close(&session);
    Ok(())
}

fn attack(endpoint: &str, chunks: usize) -> Outcome {
    let ended = Command::new(std::env::current_exe()?)
        .args(["attacked::attacker", "--exact", "--ignored"])
        .env(ENDPOINT, endpoint)
        .env(CHUNKS, chunks.to_string())
        .env("RUST_MIN_STACK", (256 << 20).to_string())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()?;
    assert!(ended.success(), "the attack itself failed: {ended}");
    Ok(())
}

fn verify(file: &Path) -> Outcome<Option<i32>> {
    Ok(flexcrank(&["verify"]).arg(file).stdout(Stdio::null()).stderr(Stdio::null()).status()?.code())
}

#[test]
fn regress_keys_of_thousands_of_chunks_do_not_kill_a_service() -> Outcome {
    let (folder, endpoint) = (tempfile::tempdir()?, endpoint()?);
    let file = folder.path().join("run.mcap");
    let arguments = ["run", "crank-slider", "--name", "victim", "--listen", &endpoint, "--record"];
    let mut victim = Victim(flexcrank(&arguments).arg(&file).stderr(Stdio::null()).spawn()?);
    let client = connect(&endpoint)?;
    let name: Name = "victim".parse()?;
    client::wait_for_service(&client, &name)?;
    for chunks in [4_000, 7_000, 32_000] {
        attack(&endpoint, chunks)?;
        let pulse = TorquePulse { id: format!("{chunks}"), torque_nm: 1.0, duration_s: 0.1, ..TorquePulse::default() };
        assert!(client::pulse(&client, &name, &pulse)?.accepted, "after {chunks} chunks");
    }
    bus::close(&client)?;
    kill_process(Pid::from_child(&victim.0), Signal::TERM)?;
    assert_eq!(victim.0.wait()?.code(), Some(0));
    assert_eq!(verify(&file)?, Some(0));
    Ok(())
}

/// Waits for a topic, and returns the steps of its samples.
fn steps(listener: &Listener, count: usize) -> Outcome<Vec<u64>> {
    listener.wait_for(Topic::Angles, count, PATIENCE)?;
    let stamp = |bytes: &Vec<u8>| Angles::decode(bytes.as_slice()).ok()?.stamp.map(|stamp| stamp.step);
    Ok(listener.payloads(Topic::Angles).iter().filter_map(stamp).collect())
}

/// The service of a supervisor.
fn child_of(supervisor: &Victim) -> Outcome<Pid> {
    let id = supervisor.0.id();
    let children = std::fs::read_to_string(format!("/proc/{id}/task/{id}/children"))?;
    let child: i32 = children.split_whitespace().next().ok_or("no service")?.parse()?;
    Ok(Pid::from_raw(child).ok_or("no process")?)
}

#[test]
fn regress_a_supervised_service_that_dies_resumes_its_own_recording() -> Outcome {
    let (folder, endpoint) = (tempfile::tempdir()?, endpoint()?);
    let (file, lifted) = (folder.path().join("run.mcap"), folder.path().join("lifted.json5"));
    // Other values than zenoh's own, so that the service leaves them as they are.
    std::fs::write(&lifted, "{ transport: { link: { tx: { batch_size: 65534 }, rx: { max_message_size: 1000000 } } } }")?;
    let arguments = ["run", "crank-slider", "--supervise", "--name", "victim", "--publish-hz", "all", "--listen", &endpoint];
    let mut command = flexcrank(&arguments);
    command.arg("--zenoh-config").arg(&lifted).arg("--record").arg(&file).current_dir(folder.path());
    let mut supervisor = Victim(command.stderr(Stdio::null()).spawn()?);
    let name: Name = "victim".parse()?;
    let mut died_at = Vec::new();
    for way in ["attacked", "killed"] {
        let client = connect(&endpoint)?;
        let listener = Listener::new(&client, &name)?;
        let seen = steps(&listener, 300)?;
        died_at.push(seen.last().copied().unwrap_or(0));
        match way {
            "attacked" => attack(&endpoint, 20_000)?,
            _ => kill_process(child_of(&supervisor)?, Signal::KILL)?,
        }
        bus::close(&client)?;
    }
    let client = connect(&endpoint)?;
    let after = steps(&Listener::new(&client, &name)?, 300)?;
    assert!(died_at[0] > 0 && died_at[1] > died_at[0] && after.last() > died_at.last(), "{died_at:?} {after:?}");
    bus::close(&client)?;
    kill_process(Pid::from_child(&supervisor.0), Signal::TERM)?;
    assert_eq!(supervisor.0.wait()?.code(), Some(0));
    let files = [file, folder.path().join("run-resumed-1.mcap"), folder.path().join("run-resumed-2.mcap")];
    assert_eq!(files.iter().map(|file| verify(file)).collect::<Outcome<Vec<_>>>()?, [Some(3), Some(3), Some(0)]);
    let mut next = 0;
    for file in &files {
        let angles = decoded::<Angles>(file, "angles").or_else(|_| recovered(file, folder.path()))?;
        let steps: Vec<u64> = angles.iter().filter_map(|row| row.stamp.as_ref()).map(|stamp| stamp.step).collect();
        let first = steps.first().copied().unwrap_or(0);
        // A kill may separate the topics of one step.
        assert!(next <= first && first <= next + 1, "{}: {first}, not {next}", file.display());
        assert_eq!(steps, (first..first + steps.len() as u64).collect::<Vec<u64>>(), "{}", file.display());
        next = first + steps.len() as u64;
    }
    Ok(())
}

/// The angles of a recording that was cut off.
fn recovered(file: &Path, folder: &Path) -> Outcome<Vec<Angles>> {
    let whole = folder.join("whole.mcap");
    let _ = std::fs::remove_file(&whole);
    flexcrank::recording::recover(file, &whole, |_, _| {})?;
    decoded(&whole, "angles")
}

#[test]
fn prop_a_service_without_its_supervisor_ends_in_order() -> Outcome {
    let (folder, endpoint) = (tempfile::tempdir()?, endpoint()?);
    let file = folder.path().join("run.mcap");
    let arguments = ["run", "crank-slider", "--supervise", "--name", "victim", "--listen", &endpoint, "--record"];
    let mut supervisor = Victim(flexcrank(&arguments).arg(&file).stderr(Stdio::null()).spawn()?);
    let client = connect(&endpoint)?;
    steps(&Listener::new(&client, &"victim".parse()?)?, 20)?;
    let service = child_of(&supervisor)?;
    supervisor.0.kill()?;
    supervisor.0.wait()?;
    let begun = Instant::now();
    // Whoever adopts the service may not have reaped it yet.
    while verify(&file)? != Some(0) {
        assert!(begun.elapsed() < PATIENCE, "{service:?} goes on");
    }
    Ok(())
}

/// The last death announced that the service resumes its recording, and then none was started.
#[test]
fn regress_a_supervisor_that_gives_up_announces_no_further_service_and_names_the_way_on() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("run.mcap");
    let mut command = flexcrank(&["run", "crank-slider", "--supervise", "--no-bus", "--flush", "50ms", "--record", "run.mcap"]);
    command.current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut supervisor = Victim(command.spawn()?);
    let said = BufReader::new(supervisor.0.stderr.take().ok_or("no standard error")?).lines();
    let mut said = said.map_while(Result::ok);
    for _ in 0..5 {
        said.by_ref().find(|line| line.contains("; not on the bus; ")).ok_or("no service begins")?;
        let begun = Instant::now();
        while !has_checkpoint(&file) {
            assert!(begun.elapsed() < PATIENCE, "nothing is recorded");
            std::thread::sleep(Duration::from_millis(10));
        }
        kill_process(child_of(&supervisor)?, Signal::KILL)?;
    }
    let errors: Vec<String> = said.filter(|line| line.starts_with("error: ")).collect();
    let [died, given_up] = &errors[..] else { return Err(format!("{errors:?}").into()) };
    assert_eq!(died, "error: the service died (signal: 9 (SIGKILL))");
    let way = "error: the service died 5 times within 60 s: given up; `flexcrank run --resume run";
    assert!(given_up.starts_with(way) && given_up.ends_with(".mcap` goes on from its recording"), "{given_up}");
    assert_eq!(supervisor.0.wait()?.code(), Some(1));
    Ok(())
}

#[test]
fn regress_a_supervisor_ends_as_its_service_ends() -> Outcome {
    let folder = tempfile::tempdir()?;
    let ended = |more: &[&str]| -> Outcome<Option<i32>> {
        let arguments = ["run", "--supervise", "--no-bus", "--pace", "max", "--until", "1"];
        let run = flexcrank(&arguments).args(more).current_dir(folder.path()).stderr(Stdio::null()).status()?;
        Ok(run.code())
    };
    assert_eq!(ended(&["--record", "a.mcap"])?, Some(0));
    assert_eq!(ended(&["--record", "a.mcap"])?, Some(1), "a recording that exists already");
    assert_eq!(ended(&["nosuch", "--record", "b.mcap"])?, Some(2));
    assert_eq!(verify(&folder.path().join("a.mcap"))?, Some(0));
    Ok(())
}
