//! The sample recordings stay readable.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::process::Command;

use flexcrank::recording::{Export, RecordingError, export, read_columns, recover};

use crate::common::Outcome;

/// Name, seconds that it spans at least, and whether it is cut off.
const SAMPLES: [(&str, f64, bool); 4] = [
    ("sample-thesis.mcap", 20.0, false),
    ("sample-three-pulses.mcap", 5.9, false),
    ("sample-diverging.mcap", 6.0, false),
    ("sample-truncated.mcap", 3.0, true),
];

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings").join(name)
}

#[test]
fn regress_samples_are_read_and_recovered() -> Outcome {
    let folder = tempfile::tempdir()?;
    for (name, seconds, cut_off) in SAMPLES {
        let contents = read_columns(&path(name), &|_| {})?;
        assert_eq!(contents.cut_off, cut_off, "{name}");
        let columns: usize = contents.topics.iter().map(|topic| topic.columns.len()).sum();
        assert!(contents.topics.len() >= 5 && columns > 60 && contents.skipped.is_empty(), "{name}: {columns} columns");
        let recovered = recover(&path(name), &folder.path().join(name), |_, _| {})?;
        assert_eq!((recovered.loss.is_none(), recovered.loss.cut_off), (!cut_off, cut_off), "{name}: {recovered:?}");
        assert!(recovered.span_s > seconds, "{name}: {} s", recovered.span_s);
    }
    Ok(())
}

/// Each is computed again to the bit and replayed; the one that was cut off is reported as lossy.
#[test]
fn regress_samples_are_verified_and_replayed() -> Outcome {
    for (name, _, cut_off) in SAMPLES {
        let run = |arguments: &[&str]| Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(arguments).arg(path(name)).output();
        let verified = run(&["verify"])?;
        let said = String::from_utf8_lossy(&verified.stdout).into_owned();
        let expected = if cut_off { 3 } else { 0 };
        assert_eq!(verified.status.code(), Some(expected), "{name}: {said}");
        assert!(
            said.contains("intact, and equal to the bit"),
            "{name}: {said}; if steps are computed otherwise, recordings/make"
        );
        let replayed = run(&["replay", "--rate", "1000", "--listen", "tcp/127.0.0.1:0"])?;
        assert_eq!(replayed.status.code(), Some(expected), "{name}: {replayed:?}");
        assert!(String::from_utf8_lossy(&replayed.stderr).contains("replayed "), "{name}: {replayed:?}");
    }
    Ok(())
}

#[test]
fn prop_samples_are_small() -> Outcome {
    let sizes: Vec<u64> = SAMPLES.iter().map(|(name, ..)| Ok(std::fs::metadata(path(name))?.len())).collect::<Outcome<_>>()?;
    assert!(sizes.iter().sum::<u64>() < 5_000_000, "{sizes:?}");
    Ok(())
}

/// A recording of commit 98840a7, whose scene names an integrator that is no more: it is read, recovered and exported; to compute it again
/// takes the build that made it.
#[test]
fn regress_an_old_recording_stays_readable() -> Outcome {
    let old = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/recordings/composed-midpoint.mcap");
    let folder = tempfile::tempdir()?;
    assert!(!read_columns(&old, &|_| {})?.cut_off);
    assert!(recover(&old, &folder.path().join("recovered.mcap"), |_, _| {})?.loss.is_none());
    let run = |arguments: &[&str]| Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(arguments).arg(&old).output();
    let tables = folder.path().join("tables");
    let exported = run(&["export", "--csv", tables.to_str().ok_or("a path that is no text")?])?;
    assert!(exported.status.success() && tables.join("flexcrank.crank.angles.csv").exists(), "{exported:?}");
    let replayed = run(&["replay", "--rate", "1000", "--listen", "tcp/127.0.0.1:0"])?;
    assert!(replayed.status.success(), "{replayed:?}");
    let verified = run(&["verify"])?;
    let said = String::from_utf8(verified.stderr)?;
    assert!(verified.status.code() == Some(1) && said.contains("composed-midpoint") && said.contains("another build"), "{said}");
    Ok(())
}

/// The scene has no gravity, and no exact solution is known of it.
#[test]
fn regress_a_column_that_no_message_has_is_told_from_an_unknown_one() -> Outcome {
    let folder = tempfile::tempdir()?;
    let refused = |column: &str| {
        let columns = Export { csv: Some(folder.path().join("tables")), columns: vec![column.to_owned()], ..Export::default() };
        export(&path("sample-three-pulses.mcap"), &columns, &|_| {}).err()
    };
    for column in ["potential_j", "nodes.rod.1.exact_x_m"] {
        let said = refused(column).map(|error| error.to_string()).unwrap_or_default();
        assert!(said.contains(&format!("no column `{column}`: no message of this recording")), "{said}");
    }
    for column in ["potential_jj", "links.rd.chord_rad"] {
        let said = refused(column);
        assert!(matches!(said, Some(RecordingError::Column { .. })), "{said:?}");
    }
    assert!(!folder.path().join("tables").exists(), "a refusal writes nothing");
    Ok(())
}

#[test]
fn prop_readings_report_the_part_that_is_done() -> Outcome {
    let folder = tempfile::tempdir()?;
    let is_even = |reported: &[f64]| {
        let rises = reported.windows(2).all(|pair| pair[0] <= pair[1]);
        let mut distinct = reported.to_vec();
        distinct.dedup();
        rises && distinct.len() > 100 && reported.first() == Some(&0.0) && reported.last() == Some(&1.0)
    };
    let reported = RefCell::new(Vec::new());
    let progress = |done: f64| reported.borrow_mut().push(done);
    read_columns(&path("sample-three-pulses.mcap"), &progress)?;
    assert!(is_even(&reported.take()));
    let [csv, ros2] = ["tables", "bag.mcap"].map(|name| Some(folder.path().join(name)));
    for (from_s, to_s) in [(0.0, None), (1.0, Some(4.0))] {
        let both = Export { csv: csv.clone(), ros2: ros2.clone(), from_s, to_s, ..Export::default() };
        export(&path("sample-three-pulses.mcap"), &both, &progress)?;
        assert!(is_even(&reported.take()), "from {from_s} s");
        std::fs::remove_file(folder.path().join("bag.mcap"))?;
    }
    Ok(())
}
