//! Refusals: each names the problem and a remedy, and its exit code shows whose fault it is.

use std::error::Error;
use std::process::Command;

const SAMPLE: &str = "recordings/sample-three-pulses.mcap";
/// An endpoint apart from the local services.
const ALONE: &str = "tcp/127.0.0.1:0";

/// Runs the program in the project's folder; returns exit code, standard output and standard error.
fn flexcrank(words: &[&str]) -> Result<(Option<i32>, String, String), Box<dyn Error>> {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(env!("CARGO_MANIFEST_DIR")).output()?;
    Ok((output.status.code(), String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?))
}

fn refused(words: &[&str], code: i32, why: &[&str]) -> Result<(), Box<dyn Error>> {
    let (ended, _, said) = flexcrank(words)?;
    assert_eq!(ended, Some(code), "{words:?}: {said}");
    for part in why {
        assert!(said.contains(part), "{words:?}: {part} in {said}");
    }
    Ok(())
}

#[test]
fn regress_invalid_addresses() -> Result<(), Box<dyn Error>> {
    let usual = "tcp/127.0.0.1:7447";
    refused(&["run", "--listen", "nonsense"], 2, &["'nonsense' for '--listen", usual])?;
    refused(&["watch", "--connect", "foo"], 2, &["'foo' for '--connect", usual])?;
    refused(&["run", "--listen", "tcp/127.0.0.1:99999"], 2, &["99999 is not a port", usual])?;
    refused(&["run", "--listen", "pigeon/loft:1"], 2, &["the protocol pigeon is not supported", usual])?;
    refused(&["run", "--zenoh-config", "nosuch.json5"], 2, &["--zenoh-config nosuch.json5: No such file"])?;
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("zenoh.json5");
    let path = file.to_str().ok_or("a path that is no text")?;
    for (text, why) in [
        ("{\n listen: { endpoints: ['nonsense'] } }", ": line 2: Endpoints must be"),
        ("{ lisen: 3 }", ": line 1: unknown field `lisen`"),
    ] {
        std::fs::write(&file, text)?;
        refused(&["run", "--zenoh-config", path], 2, &[path, why])?;
    }
    Ok(())
}

#[test]
fn regress_names_that_nothing_has() -> Result<(), Box<dyn Error>> {
    refused(&["stability", "crank-slider", "--only", "nosuch"], 2, &["`nosuch`", "stiffness-modal", "revolutions"])?;
    refused(&["stability", "crank-slider", "--only", "stifness-modal"], 2, &["did you mean `stiffness-modal`?"])?;
    refused(&["guide", "buss"], 2, &["did you mean `bus`?"])?;
    refused(
        &["replay", SAMPLE, "--remap", "nosuch:=other", "--listen", ALONE],
        2,
        &["no topic `nosuch`", "flexcrank/crank/angles"],
    )
}

#[test]
fn prop_an_unstable_weight_is_warned_of() -> Result<(), Box<dyn Error>> {
    let run = |weight: &str| {
        let given =
            ["run", "thesis-two-masses", "--set", weight, "--until", "0.01", "--pace", "max", "--no-record", "--listen", ALONE];
        flexcrank(&given).map(|(_, _, said)| said)
    };
    assert!(run("solver.weight=0.3")?.contains("two-point is unstable below 0.5"));
    assert!(!run("solver.weight=0.5")?.contains("unstable"));
    Ok(())
}

#[test]
fn regress_files_for_folders_and_folders_for_files() -> Result<(), Box<dyn Error>> {
    refused(&["verify", "src"], 1, &["src: is a folder"])?;
    refused(&["replay", "src"], 1, &["src: is a folder"])?;
    refused(&["export", SAMPLE, "--csv", "README.md"], 1, &["README.md: is a file"])?;
    refused(&["stability", "--csv", "README.md"], 1, &["README.md: is a file"])?;
    refused(&["trade", "--tolerance", "1e-2", "--write", "README.md"], 1, &["README.md: exists already"])?;
    let (code, _, said) = flexcrank(&["run", "src"])?;
    assert!(code == Some(2) && said.starts_with("error: src: cannot be read: ") && !said.contains("did you mean"), "{said}");
    Ok(())
}

#[test]
fn regress_incomplete_arguments() -> Result<(), Box<dyn Error>> {
    refused(&["run", "--set", "pulse=[{"], 2, &["--set pulse=[{: not TOML: "])?;
    refused(&["run", "--set", "rod.length_m=1.2m"], 2, &["--set rod.length_m=1.2m: not TOML: "])?;
    refused(&["run", "--set", "solver.model=modla"], 2, &["did you mean \"modal\"?"])?;
    refused(&["pulse", "crank"], 2, &["--torque <NM>|--from <FILE>"])?;
    refused(&["pulse", "crank", "--torque", "1"], 2, &["--duration <S>"])?;
    refused(&["watch", "crank", "--plain", "--signals", "nosuch.field"], 2, &["cannot be used with", "--signals"])?;
    refused(&["what-if", SAMPLE], 2, &["--add-pulse <START:TORQUE:DURATION>|--set <KEY=VALUE>"])?;
    refused(&["what-if", SAMPLE, "--add-pulse", "1:1"], 2, &["three numbers START:TORQUE:DURATION"])
}

#[test]
fn regress_a_quantity_that_a_change_leaves_alone_is_the_same() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let record = folder.path().join("same.mcap");
    let path = record.to_str().ok_or("a path that is no text")?;
    let (code, out, _) = flexcrank(&["what-if", SAMPLE, "--set", "slider.mass_kg=2", "--record", path])?;
    let told = |quantity: &str| out.lines().find(|line| line.trim_start().starts_with(quantity)).unwrap_or_default();
    assert!(code == Some(0) && told("crank angle, rad").contains("differs by at most"), "{out}");
    assert!(told("driving torque, N·m").ends_with("is the same"), "{out}");
    Ok(())
}
