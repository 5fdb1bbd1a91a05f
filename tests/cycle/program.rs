//! `flexcrank cycle`: its output and its refusals.

use flexcrank::study::Table;
use flexcrank::study::cycle::{Options, cycle};

use crate::{Outcome, compressor};

/// The program itself: exit code, what it prints, what it complains of.
fn program(args: &[&str]) -> (Option<i32>, String, String) {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_flexcrank")).arg("cycle").args(args).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn val_program_prints_extremes_and_writes_what_the_library_computes() -> Outcome {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("cycle.csv");
    let csv = path.to_str().unwrap();
    let (code, out, _) = program(&["--ratio", "0.1,0.25", "--dimensionless", "--csv", csv, "--points", "91"]);
    assert_eq!(code, Some(0));
    assert!(out.contains("thesis-compressor, one turn at 157.08 rad/s") && out.contains("ratio 0.25"), "{out}");
    assert!(out.contains("piston acceleration") && out.contains("-0.3125") && out.contains("(182 rows)"), "{out}");
    let options = Options { ratios: vec![0.1, 0.25], dimensionless: true, points: 91, ..Options::default() };
    assert_eq!(Table::read_csv(&path)?, cycle(&compressor(&[]), &options)?);

    let (code, out, _) = program(&["--balance", "--r4", "0.03", "--r5", "0.06"]);
    assert_eq!(code, Some(0));
    assert!(out.contains("m4 = 4.33832 kg at r4 = 0.03 m, m5 = 2.26033 kg at r5 = 0.06 m"), "{out}");
    let (code, out, _) = program(&["--sweep-ratio", "--csv", csv]);
    assert_eq!(code, Some(0));
    assert!(out.contains("swept volume per size") && out.contains("11 of 51 ratios"), "{out}");
    assert_eq!(Table::read_csv(&path)?.rows(), 51);
    Ok(())
}

#[test]
fn regress_bad_usage_is_refused_with_exit_code_2_and_a_reason() {
    for (args, expected) in [
        (&["ref-r5"][..], "ref-r5 is not a crank-slider"),
        (&["thesis-compresor"], "did you mean `thesis-compressor`?"),
        (&["--ratio", "0.25,1"], "a number above 0 and below 1"),
        (&["--speed", "nan"], "a number from"),
        (&["--speed", "0", "--dimensionless"], "divide by the crank's speed"),
        (&["thesis-crank-slider", "--dimensionless"], "divide by the slider's mass"),
        (&["--speed", "1", "--acceleration", "-1"], "needs more than 3.545 rad/s"),
        (&["--balance", "--r4", "0.03"], "--r5"),
        (&["--balance", "--r4", "0", "--r5", "1"], "a number from"),
        (&["--sweep-ratio", "0.6:0.1:5"], "FROM:TO:N, as in 0.1:0.6:51"),
        (&["--sweep-ratio", "thesis-compressor"], "a scene goes before it"),
        (&["--points", "1"], "a number from 3"),
        (&["--set", "crank.length_m=0.2"], "crank.length_m = 0.2: must be shorter than rod.length_m = 0.145"),
    ] {
        let (code, _, error) = program(args);
        assert_eq!(code, Some(2), "{args:?}: {error}");
        assert!(error.contains(expected), "{args:?}: {error}");
    }
    let (code, _, error) = program(&["--csv", "no/such/folder/table.csv"]);
    assert_eq!(code, Some(1), "{error}");
    assert!(error.contains("no/such/folder/table.csv"), "{error}");
}
