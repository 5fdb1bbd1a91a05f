//! Devices without end, pipes and folders in place of files.

use std::process::{Command, Stdio};

use crate::common::Outcome;
use crate::sample;

/// Exit code and standard error with at most 2 GB of memory, and within a minute.
fn ended(folder: &std::path::Path, words: &[&str]) -> Outcome<(Option<i32>, String)> {
    let script = "ulimit -v 2000000; exec timeout 60 \"$0\" \"$@\"";
    let mut command = Command::new("sh");
    command.args(["-c", script, env!("CARGO_BIN_EXE_flexcrank")]).args(words).current_dir(folder);
    let output = command.stdin(Stdio::null()).output()?;
    Ok((output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned()))
}

#[test]
fn regress_endless_devices_pipes_and_folders_are_refused() -> Outcome {
    let folder = tempfile::tempdir()?;
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe")).status()?.success());
    for file in ["/dev/zero", "/dev/full", "/dev/urandom", "pipe", "."] {
        let of_recordings: [&[&str]; 7] = [
            &["verify", file],
            &["recover", file, "-o", "whole.mcap"],
            &["export", file, "--csv", "tables"],
            &["info", file],
            &["replay", file, "--listen", "tcp/127.0.0.1:0"],
            &["what-if", file, "--add-pulse", "1:1:1"],
            &["run", "--resume", file, "--no-bus"],
        ];
        for words in of_recordings {
            let (code, said) = ended(folder.path(), words)?;
            let why = if file == "." { "is a folder, not a file" } else { "is a pipe or a device, not a file" };
            assert!(code == Some(1) && said.contains(why) && said.lines().count() == 1, "{words:?}: {code:?} {said}");
        }
        // Scenes and tables may come through a pipe.
        let of_texts: [&[&str]; 4] = [
            &["run", file, "--no-bus", "--no-record"],
            &["pulse", "crank", "--from", file],
            &["plot", file, "-o", "p"],
            &["run", "--no-record", "--until", "1", "--zenoh-config", file],
        ];
        for words in of_texts.iter().filter(|_| file != "pipe") {
            let (code, said) = ended(folder.path(), words)?;
            assert!(matches!(code, Some(1 | 2)) && said.contains(file), "{words:?}: {code:?} {said}");
        }
    }
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 1, "nothing but the pipe");
    Ok(())
}

#[test]
fn regress_a_file_that_lets_its_reader_wait_is_refused() -> Outcome {
    let folder = tempfile::tempdir()?;
    for words in [["verify", "/proc/kmsg"].as_slice(), &["replay", "/proc/kmsg", "--listen", "tcp/127.0.0.1:0"]] {
        let (code, said) = ended(folder.path(), words)?;
        assert!(code == Some(1) && said.contains("/proc/kmsg"), "{words:?}: {code:?} {said}");
    }
    Ok(())
}

#[test]
fn regress_a_large_scene_is_refused_in_a_file_and_in_a_recording() -> Outcome {
    let folder = tempfile::tempdir()?;
    let large = format!("crank = [{}]\n", "1,".repeat(1 << 20));
    std::fs::write(folder.path().join("large.toml"), &large)?;
    let (code, said) = ended(folder.path(), &["run", "large.toml", "--no-bus", "--no-record"])?;
    assert!(code == Some(2) && said.contains("large.toml: is larger than 1024 KiB"), "{said}");
    let copy = folder.path().join("take.mcap");
    std::fs::copy(sample("sample-three-pulses.mcap"), &copy)?;
    let forged = crate::common::rewritten::rewritten(&copy, "forged.mcap", &crate::common::rewritten::as_is, &|_| large.clone())?;
    let forged = forged.to_string_lossy();
    for words in
        [&["verify", &forged][..], &["run", "--no-bus", "--resume", &forged], &["what-if", &forged, "--add-pulse", "1:1:1"]]
    {
        let (code, said) = ended(folder.path(), words)?;
        assert!(matches!(code, Some(1 | 2)) && said.contains("a scene has at most 1024 KiB"), "{words:?}: {code:?} {said}");
    }
    Ok(())
}
