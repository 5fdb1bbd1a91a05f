//! `stability --plot`: a picture for every map.

use std::fs;
use std::process::Command;

use crate::{png_size, texts};

fn stability(arguments: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.arg("stability").args(arguments).args(["--plot", "."]).current_dir(folder.path());
    assert!(command.output().expect("the program starts").status.success());
    folder
}

#[test]
fn prop_a_map_names_its_cases_and_ends() {
    let folder = stability(&["crank-slider", "--quick", "--only", "starts-rigid"]);
    let drawn = texts(&fs::read_to_string(folder.path().join("starts-rigid.svg")).unwrap());
    for text in [
        "start angle rad, rigid model, runge-kutta",
        "start angle (rad)",
        "ratio",
        "0.9999",
        "-1e6",
        "stable",
        "diverged",
        "refused",
    ] {
        assert!(drawn.iter().any(|drawn| drawn == text), "no `{text}` in {drawn:?}");
    }
    let svg = fs::read_to_string(folder.path().join("starts-rigid.svg")).unwrap();
    for (category, colour) in [("stable", "#0072B2"), ("wrong", "#F0A830"), ("diverged", "#C01820"), ("refused", "#BEBEBE")] {
        assert!(svg.to_uppercase().contains(colour), "the colour of {category}");
    }
    let [width, height] = png_size(&fs::read(folder.path().join("starts-rigid.png")).unwrap());
    assert!(width > 1000 && height > 800);
}

#[test]
fn prop_every_scheme_is_drawn_in_theory_and_as_run() {
    let folder = stability(&[]);
    for name in ["two-point", "generalized-alpha"] {
        for file in
            [format!("spectral-radius-{name}-in-theory"), format!("spectral-radius-{name}-as-run"), format!("order-{name}")]
        {
            let drawn = texts(&fs::read_to_string(folder.path().join(format!("{file}.svg"))).unwrap());
            assert!(drawn.iter().any(|text| text.starts_with(name)), "{file}: {drawn:?}");
        }
    }
    assert!(folder.path().join("spectral-radius-runge-kutta.png").exists());
    for name in ["two-point", "generalized-alpha", "runge-kutta", "esdirk"] {
        let drawn = texts(&fs::read_to_string(folder.path().join(format!("left-half-plane-{name}.svg"))).unwrap());
        assert!(drawn.iter().any(|text| text.ends_with("spectral radius on the left half-plane")), "{name}: {drawn:?}");
    }
}
