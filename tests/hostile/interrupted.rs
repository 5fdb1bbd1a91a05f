//! Ctrl-C in commands that write files.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::common::Outcome;
use crate::common::process::Victim;
use crate::flexcrank;

/// Paths of all files below a folder.
fn files(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { found.extend(files(&path)?) } else { found.push(path) }
    }
    Ok(found)
}

fn is_part(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "part")
}

#[test]
fn regress_ctrl_c_leaves_no_unfinished_file_and_says_so() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    std::fs::write(at.join("turn.csv"), "mine")?;
    let long = ["run", "--no-bus", "--pace", "max", "--until", "60", "--publish-hz", "all", "--record", "long.mcap"];
    assert!(flexcrank(&long).current_dir(at).output()?.status.success());
    let mut there = files(at)?;
    there.sort();
    for words in [
        &["export", "long.mcap", "--csv", ".", "--parquet", "."][..],
        &["export", "long.mcap", "--ros2", "bag.mcap"],
        &["recover", "long.mcap", "-o", "whole.mcap"],
        &["what-if", "long.mcap", "--set", "rod.density_kg_per_m3=2700", "--record", "other.mcap"],
        &["what-if", "long.mcap", "--set", "rod.density_kg_per_m3=2700"],
        &["cycle", "--points", "1000000", "--csv", "turn.csv"],
    ] {
        let mut child = flexcrank(words);
        let child = child.current_dir(at).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = Victim(child.spawn()?);
        let patience = Instant::now() + Duration::from_secs(60);
        while !files(at)?.iter().any(|path| is_part(path)) {
            assert!(Instant::now() < patience && child.0.try_wait()?.is_none(), "{words:?} begins a file");
            std::thread::yield_now();
        }
        kill_process(Pid::from_child(&child.0), Signal::INT)?;
        let code = child.0.wait()?.code();
        let said = std::io::read_to_string(child.0.stderr.take().ok_or("no standard error")?)?;
        assert_eq!((code, said.trim_end()), (Some(130), "interrupted: nothing was written"), "{words:?}");
        let mut left = files(at)?;
        left.sort();
        assert_eq!(left, there, "{words:?}");
        assert!(!at.join("recordings").exists(), "{words:?} leaves no folder");
    }
    assert_eq!(std::fs::read(at.join("turn.csv"))?, b"mine", "a table stays as it was");
    Ok(())
}
