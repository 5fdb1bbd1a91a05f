//! Columns of recordings that are asked for by name.

use std::fs::read_to_string;

use flexcrank::plot::{Named, figure, overview};
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
    assert_eq!(series.xs, [2.0, 3.0, 5.0, 5.0]);
    assert_eq!([&series.ys[..2], &series.ys[3..]].concat(), [1.0, 3.0, 4.0]);
    assert!(series.ys[2].is_nan(), "a gap at the reset");
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

#[test]
fn regress_columns_of_one_name_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (text, code, says) in [
        ("t_s,a_m,a_m\n0,1,2\n1,2,3\n", 1, "several columns have the name `a_m`: give each a name of its own"),
        ("when,t_s,when\nx,0,y\nz,1,w\n", 1, "several columns have the name `when`"),
        // Columns without contents, as of a spreadsheet, are none.
        ("t_s,a_m,,\n0,1,,\n1,2,,\n", 0, ""),
    ] {
        std::fs::write(at.join("table.csv"), text).unwrap();
        let output = plot(at, &["table.csv", "--list"]);
        assert_eq!(output.status.code(), Some(code), "{text}: {}", complaint(&output));
        assert!(complaint(&output).contains(says), "{text}: {}", complaint(&output));
    }
}

#[test]
fn regress_an_exported_topic_is_drawn_over_simulated_time() {
    let mut table = Table::default();
    for name in ["stamp.step", "stamp.sim_time_s", "driving_torque_nm"] {
        table.push(name, vec![0.0, 1.0, 2.0]);
    }
    for (_, drawn) in overview(&table).unwrap() {
        assert_eq!([&drawn.x.label, &drawn.x.unit], ["time", "s"]);
    }
    let drawn = figure(&[Named { table, ..Named::default() }], None, &["driving_torque_nm".to_owned()]).unwrap();
    assert_eq!([&drawn.x.label, &drawn.x.unit], ["time", "s"]);
}

#[test]
fn regress_the_only_column_of_numbers_is_named() {
    let mut table = Table::default();
    table.push_words("when", ["2026-01-01T00:00:00Z", "2026-01-01T00:00:01Z"].map(str::to_owned).to_vec());
    assert_eq!(overview(&table).unwrap_err().to_string(), "nothing to draw: no column of numbers");
    table.push("a_m", vec![1.0, 2.0]);
    let refusal = "nothing to draw: `a_m` is the only column of numbers, so that it was taken as the horizontal axis; a second \
                   one is needed (columns of text are not drawn)";
    assert_eq!(overview(&table).unwrap_err().to_string(), refusal);
}
