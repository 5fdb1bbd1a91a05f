//! `kill -9` at any instant loses no more than the flush period and one step.

use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use flexcrank::bus::{Name, Topic};
use flexcrank::recording::{RecordingError, recover};
use flexcrank::wire::Angles;
use prost::Message as _;

use crate::common::process::{Victim, connect};
use crate::common::{self, Listener, Outcome};

const FLUSH_S: f64 = 0.5;
const STEP_S: f64 = 1e-3;

fn last_s(angles: &[Vec<u8>]) -> f64 {
    angles.last().and_then(|bytes| Angles::decode(bytes.as_slice()).ok()).map_or(0.0, |angles| common::time_s(&angles.stamp))
}

/// Simulated time that a kill at `kill_s` costs, s.
fn lost_s(folder: &Path, kill_s: f64) -> Outcome<f64> {
    let (file, whole) = (folder.join("run.mcap"), folder.join("whole.mcap"));
    let endpoint = format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?);
    let model = ["--set", "solver.model=rigid", "--set", "solver.integrator=runge-kutta", "--set", "solver.step_s=0.001"];
    let mut victim = Victim(
        Command::new(env!("CARGO_BIN_EXE_flexcrank"))
            .args(["run", "--name", "victim", "--publish-hz", "all", "--listen", &endpoint, "--flush", "500ms", "--record"])
            .arg(&file)
            .args(model)
            .stderr(Stdio::null())
            .spawn()?,
    );
    let client = connect(&endpoint)?;
    let name: Name = "victim".parse()?;
    let heard = Listener::new(&client, &name)?;
    let begun = Instant::now();
    while last_s(&heard.payloads(Topic::Angles)) < kill_s {
        if begun.elapsed() > Duration::from_secs(60) || victim.0.try_wait()?.is_some() {
            return Err("no telemetry".into());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    victim.0.kill()?;
    victim.0.wait()?;
    let seen_s = last_s(&heard.payloads(Topic::Angles));
    flexcrank::bus::close(&client)?;
    let recovered = match recover(&file, &whole, |_, _| {}) {
        Err(RecordingError::Empty { .. }) => return Ok(seen_s),
        recovered => recovered?,
    };
    assert!(recovered.loss.cut_off && recovered.loss.places == 0, "{recovered:?}");
    assert!(mcap::Summary::read(&std::fs::read(&whole)?)?.is_some());
    let kept = common::decoded::<Angles>(&whole, "angles")?;
    let steps: Vec<u64> = kept.iter().filter_map(|row| row.stamp.as_ref()).map(|stamp| stamp.step).collect();
    assert_eq!(steps, (0..steps.len() as u64).collect::<Vec<u64>>(), "nothing is missing before the end");
    Ok(seen_s - last_s(&common::payloads(&whole, "angles")?))
}

#[test]
fn prop_kill_9_loses_at_most_the_flush_period_and_a_step() -> Outcome {
    let instants_s = [0.137, 0.611, 0.893, 1.249, 1.502];
    let losses: Vec<Result<f64, String>> = std::thread::scope(|scope| {
        let trial = |kill_s: f64| {
            let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
            lost_s(folder.path(), kill_s).map_err(|error| error.to_string())
        };
        let trials: Vec<_> = instants_s.into_iter().map(|kill_s| scope.spawn(move || trial(kill_s))).collect();
        trials.into_iter().map(|trial| trial.join().unwrap_or_else(|_| Err("a trial panicked".to_owned()))).collect()
    });
    for (kill_s, loss) in instants_s.into_iter().zip(losses) {
        let loss = loss?;
        assert!(loss <= FLUSH_S + STEP_S, "killed at {kill_s} s: {loss} s lost");
    }
    Ok(())
}
