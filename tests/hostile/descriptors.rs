//! Too few files may be open.

use std::process::Command;

use crate::common::Outcome;

#[test]
fn regress_too_few_open_files_are_refused_in_a_sentence() -> Outcome {
    for files in [10, 12, 16, 20, 25, 60, 255] {
        let script = format!("ulimit -n {files}; exec \"$0\" run --no-record --until 1 --listen tcp/127.0.0.1:0");
        let output = Command::new("sh").args(["-c", &script, env!("CARGO_BIN_EXE_flexcrank")]).output()?;
        let said = String::from_utf8(output.stderr)?;
        assert_eq!(output.status.code(), Some(1), "{files}: {said}");
        assert!(said.contains(&format!("only {files} files may be open at a time")) && said.lines().count() == 1, "{said}");
    }
    Ok(())
}

#[test]
fn regress_a_soft_limit_of_open_files_is_raised() -> Outcome {
    let script = "ulimit -S -n 12; exec \"$0\" run --no-record --until 0.1 --pace max --listen tcp/127.0.0.1:0";
    let output = Command::new("sh").args(["-c", script, env!("CARGO_BIN_EXE_flexcrank")]).output()?;
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8(output.stderr)?);
    Ok(())
}
