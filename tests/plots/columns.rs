//! Columns of recordings that are asked for by name.

use std::fs::read_to_string;

use flexcrank::plot::{Named, figure};
use flexcrank::study::Table;

use super::recording::record;
use super::{complaint, plot, texts};

/// A topic with a column that counts its messages from 1, at these instants: epoch, and simulated time in s.
fn topic(name: &str, column: &str, stamps: &[[f64; 2]]) -> Named {
    let mut table = Table::default();
    for (place, field) in ["stamp.epoch", "stamp.sim_time_s"].into_iter().enumerate() {
        table.push(field, stamps.iter().map(|stamp| stamp[place]).collect());
    }
    table.push(column, (1..=stamps.len()).map(|row| row as f64).collect());
    Named { name: format!("flexcrank/crank/{name}"), table, ..Named::default() }
}

#[test]
fn regress_columns_of_different_topics_are_joined_by_simulated_time() {
    let angles = [[0.0, 0.0], [0.0, 0.1], [0.0, 0.2], [1.0, 0.0], [1.0, 0.1], [f64::NAN; 2]];
    let loads = [[0.0, 0.1], [0.0, 0.15], [0.0, 0.2], [1.0, 0.1], [f64::NAN; 2]];
    let tables = [
        topic("angles", "links.crank.chord_rad", &angles),
        topic("energies", "kinetic_j", &[[0.0, 0.1], [0.0, 0.7]]),
        topic("loads", "driving_torque_nm", &loads),
        topic("status", "lateness_p99_s", &[[0.0, 0.1]]),
    ];
    let drawn = |x: &str, y: &str| figure(&tables, Some(x), &[y.to_owned()]);
    let torque = drawn("crank.chord_rad", "driving_torque_nm").unwrap();
    let series = &torque.panels[0].series[0];
    assert_eq!([series.xs.as_slice(), series.ys.as_slice()], [[2.0, 3.0, 5.0], [1.0, 3.0, 4.0]]);
    for ([x, from], [y, of], advice) in [
        (
            ["links.crank.chord_rad", "angles"],
            ["kinetic_j", "energies"],
            "record with --publish-hz all (of a what-if, its original), so that both have every step",
        ),
        (
            ["lateness_p99_s", "status"],
            ["driving_torque_nm", "loads"],
            "choose an x column of samples: of angles, displacements, loads or energies",
        ),
        (["links.crank.chord_rad", "angles"], ["lateness_p99_s", "status"], "choose an x column of status"),
    ] {
        let refusal = format!("`{x}` of {from} and `{y}` of {of} have fewer than two instants in common; {advice}");
        assert_eq!(drawn(x, y).unwrap_err().to_string(), refusal);
    }
}

#[test]
fn regress_torque_is_drawn_over_the_crank_angle() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "0.3", "slow.mcap", &[]);
    record(at, "crank-slider", "0.3", "fast.mcap", &["--set", "start.rate_rad_per_s=20"]);
    let over_angle = ["--x", "crank.chord_rad", "--y", "driving_torque_nm", "-o", "torque.svg"];
    for (files, title) in
        [(&["slow.mcap"][..], "Driving torque: slow"), (&["slow.mcap", "fast.mcap", "--overlay"][..], "Driving torque")]
    {
        let output = plot(at, &[files, &over_angle].concat());
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        let drawn = texts(&read_to_string(at.join("torque.svg")).unwrap());
        for text in [title, "crank chord angle (rad)", "driving torque (N·m)"] {
            assert!(drawn.iter().any(|other| other == text), "{text} in {drawn:?}");
        }
    }
}

/// Checkpoints have a field of the same name, and come before energies.
#[test]
fn regress_work_is_drawn_from_every_sample() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "0.3", "run.mcap", &["--set", "start.rate_rad_per_s=20"]);
    let output = plot(at, &["run.mcap", "--y", "work_in_j", "-o", "work.svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let svg = read_to_string(at.join("work.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let lines = document.descendants().filter_map(|node| node.attribute("points"));
    assert_eq!(lines.map(|points| points.split_whitespace().count()).max(), Some(151), "a curve through every step");
}
