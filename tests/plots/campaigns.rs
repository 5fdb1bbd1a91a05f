//! Tables of campaigns.

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
