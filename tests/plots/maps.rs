//! `stability --plot`: a picture for every map.

use std::fs;
use std::process::Command;

use flexcrank::plot::stability::swept;
use flexcrank::plot::{Format, Picture as _};
use flexcrank::scene::SceneSource;
use flexcrank::study::stability::{BaseScene, Category, Extent, MapPlan, Outcome, Spacing, Swept};

use crate::{png_size, texts};

fn base() -> BaseScene {
    BaseScene::new(&SceneSource::open("crank-slider", &[]).unwrap()).unwrap()
}

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
        "start angle of the crank and crank-to-rod ratio λ: rigid model, runge-kutta",
        "start angle of the crank (rad)",
        "crank-to-rod ratio λ",
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

/// Texts of an SVG of this size of letters.
fn lettered(svg: &str, size: &str) -> Vec<String> {
    let document = roxmltree::Document::parse(svg).expect("well-formed XML");
    let texts = document.descendants().filter(|node| node.attribute("font-size") == Some(size));
    texts.map(|node| node.text().unwrap_or_default().trim().to_owned()).collect()
}

/// No name of a column, and no long number.
fn is_labelled_in_words(name: &str, svg: &str) {
    let drawn = texts(svg);
    assert!(drawn.iter().all(|text| !text.contains('_')), "{name}: {drawn:?}");
    let ticks = lettered(svg, "12.5");
    assert!(!ticks.is_empty() && ticks.iter().all(|tick| tick.chars().count() <= 8), "{name}: {ticks:?}");
}

#[test]
fn prop_every_map_is_labelled_in_words_with_short_ticks() {
    for extent in [Extent::Whole, Extent::Quick] {
        for map in MapPlan::extremes(&base(), extent).maps {
            let ended = Outcome::without_run(Category::Stable, String::new());
            let (name, title) = (map.name.clone(), map.title.clone());
            let outcomes = vec![ended; map.cells.len()];
            let svg = swept(&Swept { map, outcomes }).render(Format::Svg).unwrap();
            let svg = String::from_utf8(svg).unwrap();
            is_labelled_in_words(&name, &svg);
            assert!(texts(&svg).contains(&title), "{name}: {title}");
            let (quantities, method) = title.split_once(": ").unwrap();
            let integrators = ["runge-kutta", "two-point", "generalized-alpha", "esdirk"];
            assert!(integrators.iter().any(|word| method.ends_with(word)), "{name}: {title}");
            let keys = ["pa", "nm", "rad", "s", "youngs", "rho", "over", "m"];
            assert!(quantities.contains(" and ") && quantities.split(' ').all(|word| !keys.contains(&word)), "{name}: {title}");
        }
    }
}

#[test]
fn regress_speeds_beside_a_resonance_are_drawn_over_their_logarithm() {
    let plan = MapPlan::extremes(&base(), Extent::Whole);
    let speeds = plan.maps.iter().find(|map| map.name == "crank-speed-modal").map(|map| &map.y).unwrap();
    assert_eq!((speeds.spacing, speeds.values.first(), speeds.values.last()), (Spacing::Log, Some(&0.01), Some(&100.0)));
}

#[test]
fn prop_every_value_of_every_map_has_a_short_label_of_its_own() {
    for map in MapPlan::extremes(&base(), Extent::Whole).maps {
        for axis in [&map.x, &map.y] {
            let labels: Vec<String> = axis.values.iter().map(|value| axis.shown(*value)).collect();
            assert!(labels.iter().all(|label| label.chars().count() <= 8), "{}: {labels:?}", map.name);
            let distinct: std::collections::BTreeSet<&String> = labels.iter().collect();
            assert_eq!(distinct.len(), labels.len(), "{}: {labels:?}", map.name);
        }
    }
}

#[test]
fn prop_a_text_map_names_its_values_and_symbols() {
    let arguments = ["stability", "crank-slider", "--quick", "--only", "elements-finite-element"];
    let ran = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(arguments).output().expect("the program starts");
    let said = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(said.lines().next(), Some("Each character is a run: . stable, D diverged, r refused"));
    assert!(said.contains("\n  across: step (s): 1e-5, 3.162e-4, 0.01, 1\n  upwards: elements per link\n"), "{said}");
    assert!(said.contains("\n        1001  r r r r\n"), "{said}");
}

#[test]
fn prop_every_scheme_is_drawn_in_theory_and_as_run() {
    let folder = stability(&[]);
    for name in ["two-point", "generalized-alpha"] {
        for file in
            [format!("spectral-radius-{name}-in-theory"), format!("spectral-radius-{name}-as-run"), format!("order-{name}")]
        {
            let svg = fs::read_to_string(folder.path().join(format!("{file}.svg"))).unwrap();
            is_labelled_in_words(&file, &svg);
            let drawn = texts(&svg);
            assert!(drawn.iter().any(|text| text.starts_with(name)), "{file}: {drawn:?}");
        }
    }
    assert!(folder.path().join("spectral-radius-runge-kutta.png").exists());
    for name in ["two-point", "generalized-alpha", "runge-kutta", "esdirk"] {
        let drawn = texts(&fs::read_to_string(folder.path().join(format!("left-half-plane-{name}.svg"))).unwrap());
        assert!(drawn.iter().any(|text| text.ends_with("spectral radius on the left half-plane")), "{name}: {drawn:?}");
    }
}
