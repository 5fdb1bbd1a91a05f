//! `--quiet`: results, errors, and the reason for an exit code other than 0.

use std::error::Error;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

type Tried<T = ()> = Result<T, Box<dyn Error>>;

const TRUNCATED: &str = "recordings/sample-truncated.mcap";
const RUN: [&str; 5] = ["run", "--no-bus", "--no-record", "--pace", "max"];

fn flexcrank(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Exit code, standard output and standard error.
fn said(arguments: &[&str]) -> Tried<(Option<i32>, String, String)> {
    let ended = flexcrank(arguments).output()?;
    Ok((ended.status.code(), String::from_utf8(ended.stdout)?, String::from_utf8(ended.stderr)?))
}

#[test]
fn prop_quiet_leaves_results_and_errors() -> Tried {
    let folder = tempfile::tempdir()?;
    let tables = folder.path().join("t");
    let tables = tables.to_str().ok_or("a path that is no text")?;
    let run = [&RUN[..], &["--until", "0.1"]].concat();
    assert_eq!(said(&[&["-q"], run.as_slice()].concat())?, (Some(0), String::new(), String::new()));
    let (code, out, err) = said(&["export", TRUNCATED, "--csv", tables, "--quiet"])?;
    assert!(code == Some(3) && out.contains("angles.csv ("), "{out}");
    assert_eq!(err, "warning: the recording ends early (still being recorded, or cut off); everything before was exported\n");
    let (code, _, err) = said(&["-q", "info", "nosuch.mcap"])?;
    assert!(code == Some(1) && err.starts_with("error: nosuch.mcap: "), "{err}");
    assert_eq!(said(&[&["-q", "-v"], run.as_slice()].concat())?.0, Some(2), "one or the other");
    let open = ["run", "--no-record", "--pace", "max", "--until", "0.1", "--name", "heard", "--listen", "tcp/127.0.0.1:0"];
    let lines = |more: &[&str]| said(&[more, open.as_slice()].concat()).map(|(_, _, err)| err.lines().count());
    assert!(lines(&["-v"])? > lines(&[])?, "zenoh says more");
    Ok(())
}

#[test]
fn regress_the_reason_for_an_exit_code_is_printed_quietly() -> Tried {
    let folder = tempfile::tempdir()?;
    let paths = ["what-if.mcap", "whole.mcap", "plots", "limited.mcap"].map(|name| folder.path().join(name));
    let [what_if, whole, plots, limited] = paths.each_ref().map(|path| path.to_str().unwrap_or_default());
    let long_step = ["--set", "solver.step_s=0.1"];
    let unstable = ["thesis-crank-slider", "--set", "solver.weight=0.48", "--until", "22.8"];
    let trade = ["trade", "ref-r1", "--models", "rigid", "--integrators", "runge-kutta", "--until", "0.2", "--steps", "20ms"];
    let trade = [&trade[..], &["--budget", "1", "--outputs", "energy", "--real-time-factor", "1e8"]].concat();
    let replay = ["replay", TRUNCATED, "--rate", "100", "--name", "quiet-ghost", "--listen", "tcp/127.0.0.1:0"];
    for (words, code, reason) in [
        ([&["check", "crank-slider"][..], &long_step].concat(), 6, "warning: not to be trusted: the energy balance was off"),
        ([&RUN[..], &long_step, &["--until", "1"]].concat(), 6, "warning: not to be trusted: the energy balance was off"),
        ([&RUN[..], &unstable].concat(), 4, "error: diverged in step "),
        (vec!["what-if", TRUNCATED, "--add-pulse", "0.1:1:0.1", "--record", what_if], 3, "warning: the recording ends early"),
        (vec!["recover", TRUNCATED, "-o", whole], 3, "lost: all after "),
        (vec!["plot", TRUNCATED, "--to", "0.3", "--y", "kinetic_j", "-o", plots], 3, "warning: recordings/"),
        (replay.to_vec(), 3, "warning: the recording ends early"),
        ([&trade[..], &["--tolerance", "10"]].concat(), 1, "error: the real-time factor fails"),
        ([&trade[..], &["--levels", "2"]].concat(), 1, "error: the real-time factor fails"),
    ] {
        let (ended, _, err) = said(&[&["-q"], words.as_slice()].concat())?;
        assert_eq!(ended, Some(code), "{words:?}: {err}");
        assert!(err.starts_with(reason) && err.lines().count() == 1, "{words:?}: {err}");
    }
    let run = ["-q", "run", "--no-bus", "--record", limited, "--max-recording-size", "1MB", "--pace", "max", "--until", "3"];
    let (code, _, err) = said(&run)?;
    assert!(code == Some(3) && err.ends_with("limited.mcap, and then stopped: --max-recording-size\n"), "{err}");
    Ok(())
}

#[test]
fn regress_an_interrupted_run_says_so_quietly() -> Tried {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("run.mcap");
    let path = file.to_str().ok_or("a path that is no text")?;
    let mut run = flexcrank(&["-q", "run", "--no-bus", "--until", "1000", "--record", path]).spawn()?;
    let patience = Instant::now() + Duration::from_secs(20);
    // Beyond the first flush: the first step alone may err by more than the balance allows.
    let (mut seen, mut growths) = (0, 0);
    while growths < 2 {
        assert!(Instant::now() < patience && run.try_wait()?.is_none(), "the run records");
        let size = fs::metadata(&file).map_or(0, |file| file.len());
        growths += u32::from(size > seen);
        seen = size;
        std::thread::yield_now();
    }
    kill_process(Pid::from_raw(i32::try_from(run.id())?).ok_or("no process id")?, Signal::INT)?;
    let ended = run.wait_with_output()?;
    assert_eq!((ended.status.code(), String::from_utf8(ended.stderr)?.as_str()), (Some(130), "interrupted before --until\n"));
    Ok(())
}

/// Whether the process handles Ctrl-C itself, as Linux states it: the lowest bit is signal 1.
fn catches_interrupt(process: &Child) -> Tried<bool> {
    let status = fs::read_to_string(format!("/proc/{}/status", process.id()))?;
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).ok_or("no mask of signals")?;
    Ok(u64::from_str_radix(mask.trim(), 16)? >> 1 & 1 == 1)
}

#[test]
fn regress_ctrl_c_while_fixed_cost_is_rated_says_so() -> Tried {
    // Each scene is rated by itself.
    let rated = [&["-q"][..], &RUN, &["ref-r2s"; 12], &["--fixed-cost", "--until", "1000"]].concat();
    let mut run = flexcrank(&rated).spawn()?;
    let patience = Instant::now() + Duration::from_secs(20);
    while !catches_interrupt(&run)? {
        assert!(Instant::now() < patience && run.try_wait()?.is_none(), "the run begins");
        std::thread::yield_now();
    }
    kill_process(Pid::from_child(&run), Signal::INT)?;
    let ended = run.wait_with_output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert_eq!((ended.status.code(), said.as_str()), (Some(130), "interrupted: nothing was written\n"));
    Ok(())
}

/// Nobody has sent a command: the stop is that of the signal.
#[test]
fn regress_ctrl_c_is_not_counted_among_the_commands() -> Tried {
    let mut run = flexcrank(&["run", "--no-bus", "--no-record", "--set", "solver.step_s=0.1"]).spawn()?;
    let mut lines = BufReader::new(run.stderr.take().ok_or("no standard error")?).lines().map_while(Result::ok);
    lines.find(|line| line.contains("not to be trusted")).ok_or("no warning")?;
    kill_process(Pid::from_child(&run), Signal::INT)?;
    let said: Vec<String> = lines.collect();
    assert_eq!(run.wait()?.code(), Some(6), "{said:?}");
    assert!(said.last().is_some_and(|last| last.starts_with("not to be trusted: `flexcrank check SCENE")), "{said:?}");
    Ok(())
}
