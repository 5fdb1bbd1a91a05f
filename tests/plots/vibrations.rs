//! Motion of links that is faster than the samples.

use std::fs::{remove_file, write};
use std::process::Command;

use super::recording::{coarse_turning, record};
use super::{complaint, plot};

/// The sentence about accelerations of this link, with this rate.
fn rare_accelerations(link: &str, how: &str) -> String {
    let so = "so that curves of them, and perhaps of forces, have wrong swings and peaks; record with --publish-hz";
    format!("warning: run.mcap: samples are too rare for accelerations of the {link}, {so} {how} for right ones\n")
}

/// Its rod bends at 201 Hz.
const PRESS: &str = r#"
[crank]
length_m = 0.11
section = { shape = "rectangle", width_m = 0.015, height_m = 0.03 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7e10
elements = 4

[rod]
length_m = 0.42
section = { shape = "tube", outer_m = 0.014, inner_m = 0.011 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7e10
elements = 8

[slider]
mass_kg = 2.4
resistance_n = 10.0

[gravity]
y_m_per_s2 = -9.81

[start]
angle_rad = 3.141592653589793

[drive]
ramp = { to_rad_per_s = 20.0, over_s = 0.5 }

[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.0004
"#;

#[test]
fn regress_plot_names_links_whose_vibration_is_faster_than_the_samples() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("press.toml"), PRESS).unwrap();
    write(at.join("long_steps.toml"), PRESS.replace("step_s = 0.0004", "step_s = 0.001")).unwrap();
    let rare = |how: &str| {
        let so = "so that curves have wrong swings and peaks; record with --publish-hz";
        format!("warning: run.mcap: samples are too rare for the vibration of the rod, {so} {how} for right ones\n")
    };
    let [all, deflection, force, angle]: [&[&str]; 4] =
        [&["--list"], &["--y", "rod.4.deflection_m"], &["--y", "pivot.fx_n"], &["--y", "links.rod.chord_rad"]];
    let turning = coarse_turning("crank", "0.3", "300");
    let time: &[&str] = &["--y", "log_time"];
    for (scene, rate, drawn, expected) in [
        ("press.toml", "200", &[all, deflection, force][..], rare("all")),
        ("press.toml", "200", &[angle, time], String::new()),
        ("press.toml", "200,loads=all", &[all, deflection], rare("all")),
        ("press.toml", "200,loads=all", &[force], String::new()),
        ("press.toml", "200,displacements=all", &[deflection, angle], String::new()),
        // The crank bends at 1915 Hz.
        (
            "press.toml",
            "200,displacements=all",
            &[all, force],
            rare_accelerations("crank", "all, perhaps with a shorter solver.step_s,"),
        ),
        ("press.toml", "all", &[all, deflection, force], String::new()),
        // Every step is five samples in a period, too few for a link that only vibrates.
        ("long_steps.toml", "200", &[deflection], rare("all and solver.step_s = 0.0004")),
        // Four samples in a period: lines are off by 12 % of the range.
        ("crank-slider", "50", &[deflection, force], format!("{turning}{}", rare("200"))),
        ("crank-slider", "200", &[all, deflection, force], String::new()),
    ] {
        // Recordings are never overwritten.
        let _ = remove_file(at.join("run.mcap"));
        record(at, scene, "2", "run.mcap", &["--publish-hz", rate]);
        for &chosen in drawn {
            let output = plot(at, &[&["run.mcap", "-o", "curves.svg"][..], chosen].concat());
            let said = complaint(&output);
            assert_eq!((output.status.code(), &said), (Some(0), &expected), "{scene} {rate} {chosen:?}");
        }
    }
}

/// A compressor whose rod bends at 3086 Hz, beside slow bending as it turns.
const COMPRESSOR: &str = r#"
[crank]
length_m = 0.028
rigid = true
mass_kg = 4.0
centre_of_mass_m = 0.0
inertia_kg_m2 = 0.02

[rod]
length_m = 0.11
section = { shape = "rectangle", width_m = 0.012, height_m = 0.016 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7.1e10
elements = 6
damping_s = 1e-6
axial = true

[slider]
mass_kg = 0.35
resistance_table = [[0.0, 1400], [0.7, 50], [3.2, 0], [4.5, 200], [5.5, 1400]]

[start]
angle_rad = 0.7
rate_rad_per_s = 151.8

[solver]
integrator = "esdirk"
step_s = 0.00005
"#;

/// From samples so rare, the rod seemed to vibrate at 670 Hz: at the rate that was named for that, `plot` named another.
#[test]
fn regress_a_rate_that_is_named_for_a_vibration_shows_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("compressor.toml"), COMPRESSOR).unwrap();
    for rate in ["200", "300", "all"] {
        let _ = remove_file(at.join("run.mcap"));
        record(at, "compressor.toml", "0.8", "run.mcap", &["--publish-hz", rate]);
        let said = complaint(&plot(at, &["run.mcap", "--y", "rod.3.deflection_m", "-o", "curves.svg"]));
        let named = said.contains("the vibration of the rod").then(|| said.contains("--publish-hz all for right ones"));
        assert_eq!(named, (rate != "all").then_some(true), "{rate}: {said}");
    }
}

/// After the start, its rod rings at 719 Hz, and is still after some hundredths of a second.
const PUMP: &str = r#"
[crank]
length_m = 0.06
rigid = true
mass_kg = 12.0
inertia_kg_m2 = 0.15

[rod]
length_m = 0.26
section = { shape = "tube", outer_m = 0.02, inner_m = 0.014 }
density_kg_per_m3 = 4430.0
youngs_modulus_pa = 1.138e11
elements = 4
damping_s = 1e-5

[slider]
mass_kg = 0.8
resistance_table = [[0.0, 0.0], [0.15, -60.0], [3.0, -60.0], [3.3, 1800.0], [6.0, 1800.0], [6.25, 0.0]]

[torque]
constant_nm = 38.0

[start]
angle_rad = 0.3
rate_rad_per_s = 60.0

[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.0001
"#;

#[test]
fn regress_plot_names_links_whose_vibration_dies_away_after_some_samples() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("pump.toml"), PUMP).unwrap();
    record(at, "pump.toml", "0.3", "rare.mcap", &["--publish-hz", "200"]);
    record(at, "pump.toml", "0.3", "all.mcap", &[]);
    let said = |file: &str, range: &[&str]| {
        let output = plot(at, &[&[file, "-o", "curves.svg", "--y", "rod.2.deflection_m"], range].concat());
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        complaint(&output)
    };
    for range in [&[][..], &["--to", "0.02"]] {
        let rare = said("rare.mcap", range);
        assert!(rare.contains("warning: rare.mcap: samples are too rare for the vibration of the rod, "), "{range:?}: {rare}");
        assert_eq!(said("all.mcap", range), "", "{range:?}");
    }
    assert!(!said("rare.mcap", &["--from", "0.1"]).contains("vibration"));
}

/// The edges of its pulses make it ring at 308 Hz, which bends it by a fiftieth of its largest deflection.
const PENDULUM: &str = r#"
[beam]
length_m = 0.8
section = { shape = "rectangle", width_m = 0.03, height_m = 0.003 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7e10
elements = 8
modes = 3

[tip]
mass_kg = 0.1

[[pulse]]
start_s = 0.1
torque_nm = 0.5
duration_s = 0.36

[[pulse]]
start_s = 0.7
torque_nm = -0.5
duration_s = 0.36

[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.001
"#;

#[test]
fn regress_plot_names_links_whose_accelerations_are_faster_than_the_samples() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("pendulum.toml"), PENDULUM).unwrap();
    let acceleration: &[&str] = &["--y", "links.beam.acceleration_rad_per_s2"];
    let [all, force, deflection, angle]: [&[&str]; 4] =
        [&["--list"], &["--y", "pivot.fx_n"], &["--y", "beam.4.deflection_m"], &["--y", "links.beam.chord_rad"]];
    let rare = rare_accelerations("beam", "all");
    let animation: &[&str] = &["--animation"];
    // At 12 Hz, samples show it.
    let rare_pictures = "warning: run: at 0.5 times the real speed, pictures are too rare for the bending of the beam; \
                         --animation=0.1 shows the motion, with --from and --to at most 1 s apart\n";
    // The edges of a pulse are no vibration.
    let rigid: &[&str] = &["--set", "beam.rigid=true"];
    for (rate, more, drawn, expected) in [
        ("200", &[][..], &[all, force, acceleration][..], rare.as_str()),
        ("200", &[], &[deflection, angle], ""),
        ("200", &[], &[animation], rare_pictures),
        ("200,angles=all,loads=all", &[], &[all, force, acceleration], ""),
        ("200,loads=all", &[], &[acceleration], &rare),
        ("200,loads=all", &[], &[force], ""),
        ("all", &[], &[all, force, acceleration], ""),
        ("200", rigid, &[all, force, acceleration], ""),
    ] {
        // Recordings are never overwritten.
        let _ = remove_file(at.join("run.mcap"));
        record(at, "pendulum.toml", "1.2", "run.mcap", &[&["--publish-hz", rate][..], more].concat());
        for &chosen in drawn {
            let output = plot(at, &[&["run.mcap", "-o", "curves.svg"][..], chosen].concat());
            assert_eq!((output.status.code(), complaint(&output).as_str()), (Some(0), expected), "{rate} {more:?} {chosen:?}");
        }
    }
}

/// Samples of a torque that drives a mechanism are its exact means; the torque of a prescribed motion depends on accelerations.
#[test]
fn regress_plot_judges_no_load_that_is_given() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("pendulum.toml"), PENDULUM).unwrap();
    write(at.join("press.toml"), PRESS).unwrap();
    let said = |scene: &str, until: &str, rate: &str, column: &str| {
        // Recordings are never overwritten.
        let _ = remove_file(at.join("run.mcap"));
        record(at, scene, until, "run.mcap", &["--publish-hz", rate]);
        let output = plot(at, &["run.mcap", "-o", "curve.svg", "--y", column]);
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        complaint(&output)
    };
    assert_eq!(said("pendulum.toml", "1.2", "200", "driving_torque_nm"), "");
    assert_eq!(said("crank-slider", "2", "50", "driving_torque_nm"), "");
    assert_eq!(said("press.toml", "2", "200", "resistance_n"), "");
    let needed = said("press.toml", "2", "200", "driving_torque_nm");
    assert!(needed.contains("run.mcap: samples are too rare for the vibration of the rod, "), "{needed}");
}

/// `what-if` has no `--publish-hz`.
#[test]
fn regress_plot_of_a_what_if_advises_to_record_its_original() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("pendulum.toml"), PENDULUM).unwrap();
    record(at, "pendulum.toml", "1.2", "original.mcap", &["--publish-hz", "200"]);
    let mut what_if = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    what_if.args(["what-if", "original.mcap", "--set", "tip.mass_kg=0.11", "--record", "run.mcap"]);
    let changed = what_if.current_dir(at).output().unwrap();
    assert_eq!(changed.status.code(), Some(0), "{}", complaint(&changed));
    let way = "; this is a what-if: record its original so (with all, if their steps differ), and run `what-if` on that\n";
    for (column, expected) in [
        ("links.beam.acceleration_rad_per_s2", rare_accelerations("beam", "all").replace('\n', way)),
        ("links.beam.chord_rad", String::new()),
    ] {
        assert_eq!(complaint(&plot(at, &["run.mcap", "-o", "curve.svg", "--y", column])), expected, "{column}");
    }
}

#[test]
fn regress_plot_judges_every_figure_by_its_own_samples() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("pendulum.toml"), PENDULUM.replace("[tip]", "[start]\nrate_rad_per_s = 6.0\n\n[tip]")).unwrap();
    let accelerations = rare_accelerations("beam", "all");
    let [crank, beam] = [coarse_turning("crank", "1.7", "300"), coarse_turning("beam", "0.8", "100")];
    for (scene, until, rate, all, energy) in [
        ("crank-slider", "2", "200,energies=10", String::new(), crank),
        ("pendulum.toml", "1.2", "200,energies=10", accelerations.clone(), beam.clone()),
        // Energies have the rate of loads.
        ("pendulum.toml", "1.2", "200,loads=10", format!("{beam}{accelerations}"), beam),
    ] {
        // Recordings are never overwritten.
        let _ = remove_file(at.join("run.mcap"));
        record(at, scene, until, "run.mcap", &["--publish-hz", rate]);
        for (chosen, expected) in [(&["--list"][..], all.as_str()), (&["--animation"], ""), (&["--y", "kinetic_j"], &energy)] {
            let output = plot(at, &[&["run.mcap", "-o", "curves.svg"][..], chosen].concat());
            assert_eq!((output.status.code(), complaint(&output).as_str()), (Some(0), expected), "{scene} {rate} {chosen:?}");
        }
    }
}

/// The coarse mesh has no node of the number that the fine one has at the place: its samples were not judged.
#[test]
fn regress_samples_of_a_node_with_another_number_are_judged() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("fine.toml"), PRESS).unwrap();
    write(at.join("coarse.toml"), PRESS.replace("elements = 8", "elements = 4")).unwrap();
    record(at, "fine.toml", "1", "fine.mcap", &["--publish-hz", "all"]);
    record(at, "coarse.toml", "1", "coarse.mcap", &["--publish-hz", "200"]);
    for files in [["fine.mcap", "coarse.mcap"], ["coarse.mcap", "fine.mcap"]] {
        let node = if files[0] == "fine.mcap" { "rod.6.deflection_m" } else { "rod.3.deflection_m" };
        let said = complaint(&plot(at, &[&files[..], &["--overlay", "--y", node, "-o", "curves.svg"]].concat()));
        assert_eq!(said.matches("warning: ").count(), 1, "{said}");
        assert!(said.contains("coarse.mcap: samples are too rare for the vibration of the rod"), "{said}");
    }
}

#[test]
fn regress_check_names_the_rate_that_shows_the_bending_of_a_link() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("press.toml"), PRESS).unwrap();
    let check = |words: &[&str]| {
        let program = env!("CARGO_BIN_EXE_flexcrank");
        let output = Command::new(program).arg("check").args(words).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let line = |rate: &str| format!("  published    200 times a second; bending at 201.181 Hz shows with --publish-hz {rate}\n");
    for (words, rate) in [
        (&["press.toml"][..], "all"),
        (&["press.toml", "--set", "solver.step_s=1e-4"], "2500"),
        (&["press.toml", "--set", "solver.step_s=0.0008"], "all"),
        // Five steps in a period: `check` said that they show it, and `plot` that they do not.
        (&["press.toml", "--set", "solver.step_s=0.001"], "all and solver.step_s = 0.0004"),
        (&["press.toml", "--set", "solver.step_s=0.0015"], "all and solver.step_s = 0.0004"),
    ] {
        let said = check(words);
        assert!(said.contains(&line(rate)), "{said}");
    }
    assert!(!check(&["crank-slider"]).contains("published"));
    let json: serde_json::Value = serde_json::from_str(&check(&["press.toml", "--json"])).unwrap();
    assert!((json["lowest_bending_hz"].as_f64().unwrap() - 201.181).abs() < 1e-3, "{json}");
}
