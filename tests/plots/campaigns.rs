//! Tables of campaigns.

use flexcrank::plot::{Mark, Named, figure};
use flexcrank::study::Table;

use super::{complaint, plot};

/// Runs that diverged, with forces far beyond those of the others, were points of the curve.
#[test]
fn regress_runs_that_failed_are_no_points_of_a_curve() {
    let folder = tempfile::tempdir().unwrap();
    let header = "index,id,speed,ending,cause,verdict,force_n\n";
    let good = ["0,a1,10,done,,balanced,1.5\n", "1,a2,20,done,,balanced,2.5\n", "2,a3,30,done,,not judged,3.5\n"];
    let bad = ["3,a4,40,diverged,why,balanced,7e9\n", "4,a5,50,done,,unbalanced,8e9\n", "5,a6,60,refused,why,,\n"];
    let drawn = |name: &str, rows: &[&str]| {
        let at = folder.path().join(name);
        std::fs::create_dir(&at).unwrap();
        std::fs::write(at.join("runs.csv"), [&[header], rows].concat().concat()).unwrap();
        let output = plot(&at, &["runs.csv", "--x", "speed", "--y", "force_n", "-o", "runs.svg"]);
        (output.status.code(), complaint(&output), std::fs::read(at.join("runs.svg")).ok())
    };
    let (code, said, of_good) = drawn("good", &good);
    assert!(code == Some(0) && !said.contains("warning"), "{said}");
    let (code, said, of_all) = drawn("all", &[good, bad].concat());
    let warning = "warning: runs.csv: 3 runs not drawn: failed, or not to be trusted (columns `ending` and `verdict`)\n";
    assert!(code == Some(0) && said.contains(warning) && of_all == of_good, "{said}");
    let (code, said, of_bad) = drawn("bad", &bad);
    assert!(code == Some(1) && said.contains("no run ended well and can be trusted") && of_bad.is_none(), "{said}");
    let (code, said, of_failed) = drawn("failed", &["3,a4,40,diverged,why,,7e9\n", "5,a6,60,refused,why,,1\n"]);
    assert!(code == Some(1) && said.contains("no run ended well and can be trusted") && of_failed.is_none(), "{said}");
    // A table that is no campaign's.
    std::fs::write(folder.path().join("own.csv"), "index,id,cause,ending,verdict,y\n0,a,b,happy,guilty,1\n1,c,d,sad,free,2\n")
        .unwrap();
    let output = plot(folder.path(), &["own.csv", "-o", "own.svg"]);
    assert!(output.status.code() == Some(0) && !complaint(&output).contains("warning"), "{}", complaint(&output));
}

#[test]
fn regress_runs_of_a_campaign_are_in_the_order_of_a_key_or_points() {
    for (lengths, mark) in [([1.4, 1.2, 1.7], Mark::Points), ([1.2, 1.4, 1.7], Mark::Line)] {
        let mut table = Table::default();
        table.push("index", vec![0.0, 1.0, 2.0]);
        table.push("rod.length_m", lengths.to_vec());
        table.push("rod_peak_deflection_m", vec![2.0, 1.0, 3.0]);
        let table = Named { table, ..Named::default() };
        let drawn = figure(&[table], Some("rod.length_m"), &["rod_peak_deflection_m".to_owned()]).unwrap();
        assert_eq!(drawn.panels[0].series[0].mark, mark);
    }
}

/// Runs of a grid were points of one colour: nothing told the values of the second key.
#[test]
fn regress_a_grid_of_two_keys_is_a_curve_for_each_value_of_the_other_key() {
    let mut table = Table::default();
    table.push("index", (0..5).map(f64::from).collect());
    // Values in no order, and without the run of 1.4 m and 2 kg, which failed.
    table.push("rod.length_m", vec![1.4, 1.4, 1.2, 1.2, 1.2]);
    table.push("slider.mass_kg", vec![1.0, 0.5, 1.0, 0.5, 2.0]);
    table.push("work_j", vec![5.0, 4.0, 2.0, 3.0, 1.0]);
    let table = [Named { table, ..Named::default() }];
    let curves = |x: &str, y: &str| -> Vec<(String, Mark, Vec<f64>, Vec<f64>)> {
        let panels = figure(&table, Some(x), &[y.to_owned()]).unwrap().panels.into_iter();
        panels.flat_map(|panel| panel.series).map(|curve| (curve.label, curve.mark, curve.xs, curve.ys)).collect()
    };
    let curve = |label: &str, xs: &[f64], ys: &[f64]| (label.to_owned(), Mark::Line, xs.to_vec(), ys.to_vec());
    let over_mass =
        [curve("rod.length_m = 1.4", &[0.5, 1.0], &[4.0, 5.0]), curve("rod.length_m = 1.2", &[0.5, 1.0, 2.0], &[3.0, 2.0, 1.0])];
    assert_eq!(curves("slider.mass_kg", "work_j"), over_mass);
    let over_length = [
        curve("slider.mass_kg = 1", &[1.2, 1.4], &[2.0, 5.0]),
        curve("slider.mass_kg = 0.5", &[1.2, 1.4], &[3.0, 4.0]),
        curve("slider.mass_kg = 2", &[1.2], &[1.0]),
    ];
    assert_eq!(curves("rod.length_m", "work_j"), over_length);
    // A key over the other, and a result over a result, have no curves.
    for (x, y) in [("rod.length_m", "slider.mass_kg"), ("work_j", "index")] {
        assert!(curves(x, y).iter().all(|(label, mark, ..)| *mark == Mark::Points && !label.contains('=')), "{y} over {x}");
    }
}

/// Results with the same value in two runs made curves of them, named after the result.
#[test]
fn regress_runs_of_a_random_campaign_are_points_whatever_their_results() {
    for keys in [
        &[("rod.length_m", [1.4, 1.2, 1.7, 1.3])][..],
        &[("rod.length_m", [1.4, 1.2, 1.7, 1.3]), ("rod.modes", [1.0, 2.0, 1.0, 2.0])],
    ] {
        let mut table = Table::default();
        table.push("index", (0..4).map(f64::from).collect());
        keys.iter().for_each(|(name, values)| table.push(*name, values.to_vec()));
        table.push("factorizations", vec![6.0, 6.0, 7.0, 7.0]);
        table.push("pivot_peak_force_n", vec![2.0, 1.0, 3.0, 5.0]);
        let table = [Named { table, ..Named::default() }];
        let drawn = figure(&table, Some("rod.length_m"), &["pivot_peak_force_n".to_owned()]).unwrap();
        let marks: Vec<Mark> = drawn.panels[0].series.iter().map(|series| series.mark).collect();
        assert_eq!(marks, [Mark::Points], "{keys:?}");
    }
}
