//! Recordings.

use std::process::Command;

use super::{complaint, plot, texts};

#[test]
fn prop_a_recording_gives_its_standard_figures() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = ["run", "thesis-crank-slider", "--pace", "max", "--until", "5", "--publish-hz", "all", "--record", "run.mcap"];
    let ran = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(run).arg("--force").current_dir(at).output().unwrap();
    assert_eq!(ran.status.code(), Some(0), "{}", complaint(&ran));
    let output = plot(at, &["run.mcap", "-o", "out", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let expected = [
        ("angles", ["Chord angles", "time [s]", "chord angle [rad]", "crank", "rod"].as_slice()),
        ("rates", &["Chord rates", "chord rate [rad/s]", "crank", "rod"]),
        ("slider-position", &["Slider position", "x of the slider [m]"]),
        ("slider-velocity", &["Slider velocity", "velocity of the slider [m/s]"]),
        ("path", &["Path of the crank pin", "x [m]", "y [m]"]),
        ("torque", &["Driving torque", "driving torque [N·m]"]),
        ("energies", &["Energies", "energy [J]", "kinetic"]),
    ];
    for (name, expected) in expected {
        let texts = texts(&std::fs::read_to_string(at.join(format!("out/run-{name}.svg"))).unwrap());
        for text in expected {
            assert!(texts.iter().any(|other| other == text), "{name}: {text} in {texts:?}");
        }
    }
    // Of every step, not of every status.
    let energies = std::fs::read_to_string(at.join("out/run-energies.svg")).unwrap();
    let document = roxmltree::Document::parse(&energies).unwrap();
    let lines = document.descendants().filter_map(|node| node.attribute("points"));
    let longest = lines.map(|points| points.split_whitespace().count()).max().unwrap();
    assert_eq!(longest, 51, "a curve through every step");
    let output = plot(at, &["run.mcap", "--y", "links.crank.chord_rd"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("did you mean `links.crank.chord_rad`?"), "{}", complaint(&output));
    let output = plot(at, &["run.mcap", "--x", "nodes.crank.1.x_m", "--y", "links.crank.chord_rad"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("different topics"), "{}", complaint(&output));
}
