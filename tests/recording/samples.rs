//! The sample recordings stay readable.

use std::path::{Path, PathBuf};

use flexcrank::recording::{read_columns, recover};

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
        let contents = read_columns(&path(name))?;
        assert_eq!(contents.cut_off, cut_off, "{name}");
        let columns: usize = contents.topics.iter().map(|topic| topic.columns.len()).sum();
        assert!(contents.topics.len() >= 5 && columns > 60 && contents.skipped.is_empty(), "{name}: {columns} columns");
        let recovered = recover(&path(name), &folder.path().join(name), |_, _| {})?;
        assert_eq!((recovered.loss.is_none(), recovered.loss.cut_off), (!cut_off, cut_off), "{name}: {recovered:?}");
        assert!(recovered.span_s > seconds, "{name}: {} s", recovered.span_s);
    }
    Ok(())
}

#[test]
fn prop_samples_are_small() -> Outcome {
    let sizes: Vec<u64> = SAMPLES.iter().map(|(name, ..)| Ok(std::fs::metadata(path(name))?.len())).collect::<Outcome<_>>()?;
    assert!(sizes.iter().sum::<u64>() < 5_000_000, "{sizes:?}");
    Ok(())
}
