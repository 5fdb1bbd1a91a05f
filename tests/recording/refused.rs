//! A recording that cannot be made is refused before the run announces it.

use std::path::Path;
use std::process::Command;

use crate::common::Outcome;

/// Exit code and standard error.
fn run(record: &Path, more: &[&str]) -> Result<(Option<i32>, String), std::io::Error> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args([
        "run",
        "thesis-crank-slider",
        "--until",
        "0.2",
        "--pace",
        "max",
        "--listen",
        "tcp/127.0.0.1:0",
        "--name",
        "refused",
    ]);
    let output = command.arg("--record").arg(record).args(more).output()?;
    Ok((output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned()))
}

#[test]
fn regress_an_existing_recording_is_refused_before_the_run_announces_it() -> Outcome {
    let folder = tempfile::tempdir()?;
    let take = folder.path().join("take.mcap");
    let (code, says) = run(&take, &[])?;
    assert!(code == Some(0) && says.contains(&format!("recorded to {}", take.display())), "{says}");
    let bytes = std::fs::read(&take)?;
    std::fs::copy(&take, folder.path().join("take-001.mcap"))?;
    std::fs::copy(&take, folder.path().join("take-002.mcap"))?;
    let no_folder = take.join("take.mcap");
    for (record, more, why) in [
        (&take, &[][..], "exists already"),
        (&take, &["--split", "1MB"], "exists already"),
        (&take, &["--count", "2"], "exists already"),
        (&no_folder, &[], "take.mcap: "),
    ] {
        let (code, says) = run(record, more)?;
        assert!(code == Some(1) && says.contains(why) && !says.contains("recorded"), "{more:?}: {says}");
    }
    assert_eq!(std::fs::read(&take)?, bytes);
    Ok(())
}

/// The system's "Is a directory" said nothing of a folder that is missing.
#[test]
fn regress_a_recording_in_a_folder_that_does_not_exist_is_refused_with_its_name() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sub = folder.path().join("sub");
    let why = format!("the folder {} does not exist", sub.display());
    for record in [format!("{}/", sub.display()), format!("{}/take.mcap", sub.display())] {
        let (code, says) = run(Path::new(&record), &[])?;
        assert!(code == Some(1) && says.contains(&format!("error: {record}: {why}")), "{record}: {says}");
    }
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 0);
    Ok(())
}
