//! Links that their loads shorten: `check` says by how much, and `trade` lets them stretch where it matters.

use std::process::Command;

use flexcrank::scene::{IntegratorKind, ModelKind, SceneSource};
use flexcrank::simulation::Simulation;
use flexcrank::study::trade::{Demands, OutputGroup, Question, Selection, choose};
use flexcrank::study::{MATTERS, shortenings};

use crate::{answer, ask};

/// A press: a stiff rod of 0.3 m that forms at 60 kN, slowly turned.
const PRESS: &str = r#"
[crank]
length_m = 0.08
section = { shape = "round", diameter_m = 0.05 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.1e11
damping_s = 1e-5

[rod]
length_m = 0.3
section = { shape = "round", diameter_m = 0.038 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.1e11
damping_s = 1e-5

[slider]
mass_kg = 5.0
resistance_table = [[0.0, 0.0], [2.0, 0.0], [2.9, 60000.0], [3.3, 0.0]]

[drive]
speed_rad_per_s = 10.0
"#;
/// Axial stiffness of the press's rod, N.
const STIFFNESS_N: f64 = 2.1e11 * std::f64::consts::PI * 0.019 * 0.019;

/// The drive of a mower: a short crank, and a rod of ash that bends far more than it shortens. It turns 15 times a second.
const MOWER: &str = r#"
[crank]
length_m = 0.038
rigid = true
mass_kg = 6.0

[rod]
length_m = 0.9
section = { shape = "rectangle", width_m = 0.05, height_m = 0.025 }
density_kg_per_m3 = 680.0
youngs_modulus_pa = 1.2e10
damping_s = 2e-5

[slider]
mass_kg = 6.0
friction_n_s_per_m = 60.0

[drive]
speed_rad_per_s = 94.24777960769379

[solver]
integrator = "esdirk"
step_s = 5e-4
"#;

fn parse(text: &str, overrides: &[&str]) -> SceneSource {
    SceneSource::parse("scene.toml", text, &overrides.iter().map(|&one| one.to_owned()).collect::<Vec<_>>()).unwrap()
}

fn press(overrides: &[&str]) -> SceneSource {
    parse(PRESS, overrides)
}

/// Standard output of `check`.
fn check(text: &str, more: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).arg("check").arg(&path).args(more).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

/// A rod of little mass under a constant force F on the slider carries F/cos φ, at most F/√(1 − λ²).
#[test]
fn val_shortening_is_that_of_hookes_law() {
    let slow = ["slider.resistance_n=60000", "drive.speed_rad_per_s=1", "rod.damping_s=1e-4", "crank.damping_s=1e-4"];
    let text = PRESS.replace("resistance_table = [[0.0, 0.0], [2.0, 0.0], [2.9, 60000.0], [3.3, 0.0]]", "");
    let scene = SceneSource::parse("press.toml", &text, &slow.map(str::to_owned)).unwrap().scene;
    let [crank, rod] = shortenings(&scene).unwrap()[..] else { panic!("two links") };
    let [ratio, force_n]: [f64; 2] = [0.08 / 0.3, 60_000.0];
    let expected_m = force_n / (1.0 - ratio * ratio).sqrt() * 0.3 / STIFFNESS_N;
    println!("{crank:?} {rod:?} for {expected_m}");
    assert!((rod.shortening_m / expected_m - 1.0).abs() < 1e-3, "{rod:?}, {expected_m}");
    // At the dead centres the crank carries the whole force.
    assert!((crank.force_n / force_n - 1.0).abs() < 1e-2, "{crank:?}");
    assert!(rod.matters());
}

/// An air pump that a constant torque starts. At the start its links are not bent yet, and do not stretch: they would carry 280 N with one
/// mode and 407 N with eight.
#[test]
fn val_the_start_under_a_constant_torque_shortens_no_link() {
    const PUMP: &str = "[crank]\nlength_m = 0.025\nsection = { shape = \"rectangle\", width_m = 0.008, height_m = 0.015 }\n\
                        density_kg_per_m3 = 2700\nyoungs_modulus_pa = 7e10\ndamping_s = 1.7e-6\n[rod]\nlength_m = 0.11\n\
                        section = { shape = \"rectangle\", width_m = 0.01, height_m = 0.005 }\ndensity_kg_per_m3 = 2700\n\
                        youngs_modulus_pa = 7e10\ndamping_s = 1.7e-6\n[slider]\nmass_kg = 0.15\nfriction_n_s_per_m = 4\n\
                        [base]\ndamper_nm_s_per_rad = 0.02\n[torque]\nconstant_nm = 1\n[start]\nangle_rad = 0.3\n\
                        [solver]\nmodel = \"modal\"\nintegrator = \"esdirk\"\nstep_s = 1e-4\n";
    let stretching = parse(PUMP, &["crank.axial=true", "rod.axial=true", "rod.elements=4", "solver.step_s=2e-6"]).scene;
    let (mut simulation, mut largest_n) = (Simulation::new(&stretching).unwrap(), 0.0_f64);
    while simulation.time_s() < 2e-3 {
        simulation.step().unwrap();
        let rod = &simulation.observe().unwrap().links[1].elements;
        largest_n = largest_n.max(rod.iter().map(|element| element.axial_n).sum::<f64>().abs() / rod.len() as f64);
    }
    for modes in [1, 2, 8] {
        let scene = parse(PUMP, &[&format!("rod.modes={modes}"), &format!("crank.modes={modes}")]).scene;
        let [_, rod] = shortenings(&scene).unwrap()[..] else { panic!("two links") };
        assert!(rod.force_n.abs() < largest_n, "{modes}: {rod:?}, {largest_n} N with stretching links");
    }
}

#[test]
fn prop_nothing_is_said_of_links_that_stretch_or_are_rigid() {
    assert_eq!(shortenings(&press(&["rod.axial=true", "crank.rigid=true"]).scene), Ok(Vec::new()));
    let slender = SceneSource::open("crank-slider", &["rod.axial=false".to_owned(), "crank.axial=false".to_owned()]).unwrap();
    let of_slender = shortenings(&slender.scene).unwrap();
    assert!(of_slender.len() == 2 && of_slender.iter().all(|link| !link.matters()), "{of_slender:?}");
}

#[test]
fn val_check_recommends_axial_where_it_matters() {
    let said = check(PRESS, &[]);
    assert!(
        said.lines()
            .any(|line| line.starts_with("  shortening   rod: shortens by 7.57") && line.ends_with("set rod.axial = true")),
        "{said}"
    );
    let said = check(PRESS, &["--set", "rod.axial=true", "--set", "crank.axial=true"]);
    assert!(!said.contains("shortening"), "{said}");
    let json: serde_json::Value = serde_json::from_str(&check(PRESS, &["--json"])).unwrap();
    let rod = &json["shortening"][1];
    assert!(rod["link"] == "rod" && rod["recommends_axial"] == true, "{json}");
    let [force_n, shortening_m] = ["force_n", "shortening_m"].map(|key| rod[key].as_f64().unwrap());
    // Compression, and so negative.
    assert!((shortening_m * STIFFNESS_N / (0.3 * -force_n) - 1.0).abs() < 1e-12, "{json}");
}

/// A thick crank bends even less than it shortens.
#[test]
fn regress_check_says_why_it_recommends_nothing_where_a_link_hardly_bends() {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank"))
        .args(["check", "crank-slider", "--set", "crank.section.height_m=0.4", "--set", "crank.axial=false"])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let line = said.lines().find(|line| line.starts_with("  shortening   crank: ")).unwrap();
    let ratio: f64 = line.split_once("(ratio ").and_then(|(_, rest)| rest.split_once(')')).unwrap().0.parse().unwrap();
    assert!(ratio > 0.1 && line.ends_with("): too small to matter, not above 1e-7 of the length"), "{line}");
}

/// The slider moves further to either side by the rod's shortening s. Friction takes more power, by the part 2 s/r of a crank r.
#[test]
fn regress_a_shortening_counts_beside_a_short_stroke() {
    let loss_j = |overrides: &[&str]| {
        let mut simulation = Simulation::new(&parse(MOWER, overrides).scene).unwrap();
        // The second of two seconds: 15 turns.
        let [first_j, both_j] = [2000, 2000].map(|steps| {
            (0..steps).for_each(|_| simulation.step().unwrap());
            simulation.ledger().dissipated_j
        });
        both_j - first_j
    };
    let growth = loss_j(&["rod.axial=true"]) / loss_j(&[]) - 1.0;
    let [rod] = shortenings(&parse(MOWER, &[]).scene).unwrap()[..] else { panic!("one link") };
    println!("{growth:e} for {rod:?}");
    assert!((growth / (2.0 * rod.shortening_m / 0.038) - 1.0).abs() < 0.05, "{growth:e}, {rod:?}");
    assert!(!rod.exceeds(MATTERS) && rod.matters(), "{rod:?}");
    let said = check(MOWER, &[]);
    let line = said.lines().find(|line| line.starts_with("  shortening   rod: ")).unwrap();
    assert!(line.ends_with("; the stroke changes by up to 0.36 %: set rod.axial = true"), "{line}");
    let long = ["--set", "crank.length_m=0.38", "--set", "drive.speed_rad_per_s=9"];
    assert!(!check(MOWER, &long).contains("the stroke changes"));
}

/// A heavy crank speeds up slowly.
#[test]
fn regress_the_shortening_is_that_of_the_run_that_is_asked_for() {
    let text = MOWER.replace("[drive]\nspeed_rad_per_s = 94.24777960769379", "[torque]\nconstant_nm = 4.0");
    let force_n = |more: &[&str]| {
        let asked = [&["--json", "--set", "crank.inertia_kg_m2=0.1"][..], more].concat();
        let json: serde_json::Value = serde_json::from_str(&check(&text, &asked)).unwrap();
        json["shortening"][0]["force_n"].as_f64().unwrap().abs()
    };
    let [early_n, usual_n] = [force_n(&["--until", "0.5"]), force_n(&[])];
    assert!(early_n < 0.5 * usual_n, "{early_n} N until 0.5 s, {usual_n} N until 2 s");
}

/// Without stretch, the slider errs by the rod's shortening.
#[test]
fn val_a_stiff_rod_under_a_large_load_is_chosen_to_stretch() {
    let source = press(&[]);
    let selection = Selection {
        models: vec![ModelKind::Rigid, ModelKind::Modal],
        integrators: vec![IntegratorKind::GeneralizedAlpha, IntegratorKind::Esdirk],
        modes: vec![1],
        steps_s: vec![5e-3, 1e-3, 2e-4],
        ..Selection::default()
    };
    let asked = ask(selection, &[OutputGroup::Angle, OutputGroup::Slider], 120.0);
    let told = answer(&source, &Question { until_s: Some(0.63), ..asked });
    let least = |axial: bool| {
        let rows = told
            .measured()
            .filter(|(row, _)| row.configuration.keys(&source.scene).contains(&"rod.axial=true".to_owned()) == axial);
        rows.map(|(_, measured)| measured.errors.of(OutputGroup::Slider)).fold(f64::INFINITY, f64::min)
    };
    let expected = shortenings(&source.scene).unwrap()[1].shortening_m / 0.16;
    println!("{:e} without, {:e} with, {expected:e} expected", least(false), least(true));
    assert!((least(false) / expected - 1.0).abs() < 0.3, "{:e}", least(false));
    assert!(least(true) < 0.1 * least(false), "{:e}", least(true));
    let chosen = choose(&source.scene, &told, &Demands { tolerance: 1e-4, real_time_factor: 0.1 }, 120.0, &mut |_| {}).unwrap();
    let keys = chosen.row.configuration.keys(&source.scene);
    assert!(keys.contains(&"rod.axial=true".to_owned()), "{keys:?}");
    assert!(SceneSource::parse("press.toml", &source.text, &keys).unwrap().scene.chain().unwrap().links[1].axial);
    assert!(chosen.row.configuration.to_string().contains("axial"), "{}", chosen.row.configuration);
}
