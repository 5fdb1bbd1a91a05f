//! Recordings.

use std::collections::BTreeSet;
use std::fs::read_to_string;
use std::path::Path;
use std::process::Command;

use flexcrank::plot::{Axis, Figure, Format, Mark, Named, Picture as _, overlaid, recorded, shade_levels};
use flexcrank::scene::SceneSource;
use flexcrank::study::Table;

use super::{complaint, plot, texts};

/// Runs a scene into a recording, with every step unless `more` has a rate.
pub(super) fn record(folder: &Path, scene: &str, until: &str, file: &str, more: &[&str]) {
    let mut run = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    run.args(["run", scene, "--pace", "max", "--until", until, "--record", file, "--force"]);
    if !more.contains(&"--publish-hz") {
        run.args(["--publish-hz", "all"]);
    }
    let ran = run.args(["--listen", "tcp/127.0.0.1:0"]).args(more).current_dir(folder).output().unwrap();
    assert_eq!(ran.status.code(), Some(0), "{}", complaint(&ran));
}

#[test]
fn prop_a_recording_gives_its_standard_figures() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "thesis-crank-slider", "5", "run.mcap", &[]);
    let output = plot(at, &["run.mcap", "-o", "out", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let expected = [
        ("angles", ["Chord angles", "time (s)", "chord angle (rad)", "crank", "rod"].as_slice()),
        ("rates", &["Chord rates", "chord rate (rad/s)", "crank", "rod"]),
        ("slider-position", &["Slider position", "x of the slider (m)"]),
        ("slider-velocity", &["Slider velocity", "velocity of the slider (m/s)"]),
        ("path", &["Path of the crank pin", "x (m)", "y (m)"]),
        ("torque", &["Driving torque", "driving torque (N·m)"]),
        ("energies", &["Energies", "energy (J)", "kinetic"]),
    ];
    for (name, expected) in expected {
        let texts = texts(&std::fs::read_to_string(at.join(format!("out/run-{name}.svg"))).unwrap());
        let title = format!("{}: run", expected[0]);
        for text in expected[1..].iter().chain([&title.as_str()]) {
            assert!(texts.iter().any(|other| other == text), "{name}: {text} in {texts:?}");
        }
    }
    // Of every step, not of every status.
    let energies = std::fs::read_to_string(at.join("out/run-energies.svg")).unwrap();
    let document = roxmltree::Document::parse(&energies).unwrap();
    let lines = document.descendants().filter_map(|node| node.attribute("points"));
    let longest = lines.map(|points| points.split_whitespace().count()).max().unwrap();
    assert_eq!(longest, 51, "a curve through every step");
    let listed = plot(at, &["run.mcap", "--list", "-o", "none"]);
    let names = String::from_utf8(listed.stdout).unwrap();
    assert!(
        expected.iter().all(|(name, words)| names
            .lines()
            .any(|line| line.starts_with(&format!("run-{name} ")) && line.ends_with(&format!("{}: run", words[0])))),
        "{names}"
    );
    assert!(listed.status.success() && !at.join("none").exists(), "nothing is drawn");
    let columns = "links.crank.chord_rad,links.rod.chord_rad,nodes.crank.1.vx_m_per_s";
    assert_eq!(plot(at, &["run.mcap", "--y", columns, "-o", "y.svg"]).status.code(), Some(0));
    let drawn = texts(&std::fs::read_to_string(at.join("y.svg")).unwrap());
    for text in [
        "Crank chord angle, rod chord angle, crank node 1 velocity along x: run",
        "time (s)",
        "crank node 1 velocity along x (m/s)",
    ] {
        assert!(drawn.iter().any(|other| other == text), "{text} in {drawn:?}");
    }
    let output = plot(at, &["run.mcap", "--y", "links.crank.chord_rd"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("did you mean `links.crank.chord_rad`?"), "{}", complaint(&output));
}

#[test]
fn prop_a_page_names_every_file_beside_it_and_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "1", "run.mcap", &[]);
    let output = plot(at, &["run.mcap", "-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let page = read_to_string(at.join("out/index.html")).unwrap();
    let linked: BTreeSet<&str> = page.split('"').filter(|text| text.ends_with(".svg") || text.ends_with(".png")).collect();
    let names = std::fs::read_dir(at.join("out")).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let there: BTreeSet<String> = names.filter(|name| name != "index.html").collect();
    assert_eq!(linked, there.iter().map(String::as_str).collect());
    for file in ["run-strobe.svg", "run-strobe.png", "run-animation.svg", "run-angles.svg"] {
        assert!(there.contains(file), "{file} in {there:?}");
    }
    for fact in ["run.mcap", "0 s to 1 s", "crank-slider"] {
        assert!(page.contains(fact), "{fact} in {page}");
    }
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(printed.lines().count(), there.len() + 1, "a line for each file and the page: {printed}");
    let strobe = read_to_string(at.join("out/run-strobe.svg")).unwrap();
    assert_eq!(strobe.matches("<path").count(), 24, "a crank and a rod in each of twelve positions");
    assert!(texts(&strobe).iter().any(|text| text.starts_with("12 positions in one turn")), "{:?}", texts(&strobe));
}

#[test]
fn prop_a_range_of_time_cuts_figures_and_mechanism() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "1", "run.mcap", &[]);
    let output = plot(at, &["run.mcap", "--from", "0.25", "--to", "0.5", "-o", "out", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let angles = texts(&read_to_string(at.join("out/run-angles.svg")).unwrap());
    let ticks: Vec<f64> = angles.iter().filter_map(|text| text.parse().ok()).collect();
    assert!(["0.25", "0.50"].iter().all(|tick| angles.iter().any(|text| text == tick)), "{angles:?}");
    assert!(ticks.contains(&0.3) && !angles.iter().any(|text| text == "0.6"), "{angles:?}");
    let page = read_to_string(at.join("out/index.html")).unwrap();
    assert!(page.contains("from 0.25 s (pale) to 0.484 s (dark), 0.026 s apart") && page.contains("0.25 s to 0.5 s"), "{page}");
    for (range, says) in [
        (["--from", "1.5", "--to", "2"], "nothing was recorded between --from and --to; the recording covers 0 s to 1 s"),
        (["--from", "0.5", "--to", "0.25"], "--from 0.5 must be less than --to 0.25"),
    ] {
        let output = plot(at, &[&["run.mcap"], range.as_slice()].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(complaint(&output).contains(says), "{}", complaint(&output));
    }
}

#[test]
fn prop_recordings_are_laid_over_one_another() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "0.5", "steel.mcap", &[]);
    record(at, "crank-slider", "0.5", "soft.mcap", &["--set", "rod.youngs_modulus_pa=1e11"]);
    let arguments = ["steel.mcap", "soft.mcap", "--overlay", "-o", "out", "--format", "svg"];
    let output = plot(at, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let page = read_to_string(at.join("out/index.html")).unwrap();
    let alike = page.matches("s apart, bending from the chord drawn 2 times as large (").count();
    assert_eq!(alike, 2, "the steel rod by itself is drawn with a larger factor: {page}");
    let svg = read_to_string(at.join("out/overlay-rates.svg")).unwrap();
    let drawn = texts(&svg);
    let count = |wanted: &str| drawn.iter().filter(|text| *text == wanted).count();
    assert_eq!([count("steel"), count("soft")], [1, 1], "one legend for all panels: {drawn:?}");
    assert_eq!([count("crank chord rate (rad/s)"), count("rod chord rate (rad/s)")], [1, 1], "{drawn:?}");
    for colour in ["#0072b2", "#d55e00"] {
        assert_eq!(svg.matches(&format!("stroke=\"{colour}\"")).count(), 3, "two panels and the legend");
    }
    let columns = ["--y", "links.crank.chord_rad", "-o", "one.svg"];
    assert_eq!(plot(at, &[&arguments[..3], columns.as_slice()].concat()).status.code(), Some(0));
    std::fs::create_dir(at.join("other")).unwrap();
    std::fs::copy(at.join("soft.mcap"), at.join("other/steel.mcap")).unwrap();
    let output = plot(at, &["steel.mcap", "other/steel.mcap", "--overlay", "-o", "same", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let drawn = texts(&read_to_string(at.join("same/overlay-rates.svg")).unwrap());
    assert!(["steel", "other/steel", "Chord rates"].iter().all(|name| drawn.iter().any(|text| text == name)), "{drawn:?}");
}

#[test]
fn regress_flexible_links_that_are_drawn_straight_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let [crank, rod] = ["crank.elements=1", "rod.elements=1"];
    for (file, changes, links) in [
        ("both.mcap", &[crank, rod][..], "crank and rod"),
        ("rod.mcap", &[rod], "rod"),
        ("none.mcap", &[], ""),
        ("rigid-crank.mcap", &[crank, "crank.rigid=true"], ""),
        ("rigid.mcap", &[crank, rod, "solver.model=rigid", "solver.integrator=runge-kutta"], ""),
    ] {
        let more: Vec<&str> = changes.iter().flat_map(|change| ["--set", *change]).collect();
        record(at, "crank-slider", "0.1", file, &more);
        let why = "there are no nodes between the pins; elements = 4 in the scene publishes some";
        let sentence = format!("warning: {file}: no deflections of {links}: {why}\n");
        for arguments in [&[file, "--list"][..], &[file, "--animation", "-o", "moving.svg"]] {
            let said = complaint(&plot(at, arguments));
            assert_eq!(said, if links.is_empty() { "" } else { sentence.as_str() }, "{changes:?}");
        }
        let columns = plot(at, &[file, "--y", "links.crank.chord_rad", "-o", "angle.svg"]);
        assert_eq!((columns.status.code(), complaint(&columns).as_str()), (Some(0), ""), "{changes:?}");
    }
}

/// The sentence about a link that turns by this angle between samples.
pub(super) fn coarse_turning(link: &str, turned_rad: &str, rate_hz: &str) -> String {
    let so = "so that curves and paths are polygons; record with --publish-hz";
    let turns = format!("the {link} turns by up to {turned_rad} rad from sample to sample");
    format!("warning: run.mcap: {turns}, {so} {rate_hz} for smooth ones\n")
}

#[test]
fn regress_paths_that_are_polygons_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let text = SceneSource::open("thesis-compressor", &[]).unwrap().text;
    let ramp = text.replace("speed_rad_per_s = 157.07963267948966", "ramp = { to_rad_per_s = 157.0, over_s = 0.2 }");
    std::fs::write(at.join("ramp.toml"), ramp).unwrap();
    let wide = |turned: &str, how: &str| coarse_turning("crank", turned, how);
    for (scene, more, range, said) in [
        ("thesis-compressor", &["--publish-hz", "200"][..], &[][..], wide("0.8", "1700")),
        ("thesis-compressor", &["--publish-hz", "1700"], &[], String::new()),
        ("thesis-compressor", &["--publish-hz", "1700,displacements=200"], &[], wide("0.8", "1700")),
        ("thesis-compressor", &["--publish-hz", "200", "--set", "solver.step_s=0.001"], &[], wide("0.8", "all")),
        ("ramp.toml", &["--publish-hz", "200"], &["--to", "0.05"], String::new()),
        ("ramp.toml", &["--publish-hz", "200"], &["--from", "0.15"], wide("0.8", "1700")),
        ("crank-slider", &["--publish-hz", "200"], &[], String::new()),
    ] {
        // Recordings are never overwritten.
        let _ = std::fs::remove_file(at.join("run.mcap"));
        record(at, scene, "0.2", "run.mcap", more);
        assert_eq!(complaint(&plot(at, &[&["run.mcap", "--list"][..], range].concat())), said, "{scene} {more:?} {range:?}");
        let curve =
            |files: &[&str], column: &str| complaint(&plot(at, &[files, &["-o", "curve.svg", "--y", column], range].concat()));
        let of_curve = if more.contains(&"1700,displacements=200") { String::new() } else { said };
        for column in ["slider-pin.fx_n", "links.rod.chord_rad"] {
            assert_eq!(curve(&["run.mcap"], column), of_curve, "{scene} {more:?} {range:?} {column}");
        }
        let twice = curve(&["run.mcap", "run.mcap", "--overlay"], "slider-pin.fx_n");
        assert_eq!(twice, of_curve.repeat(2), "{scene} {more:?} {range:?}");
        for even in ["links.crank.chord_rad", "links.crank.revolutions", "log_time", "publish_time", "stamp.step"] {
            assert_eq!(curve(&["run.mcap"], even), "", "straight lines show even turning: {even}");
        }
    }
}

#[test]
fn regress_a_free_end_is_no_slider() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let link = "length_m = 1.0\nmass_kg = 1.0\nrigid = true";
    let around = "[tip]\nmass_kg = 0.5\n[gravity]\ny_m_per_s2 = -9.81\n[solver]\nmodel = \"rigid\"\n";
    std::fs::write(at.join("pendulum.toml"), format!("[crank]\n{link}\n[rod]\n{link}\n{around}")).unwrap();
    record(at, "pendulum.toml", "0.5", "run.mcap", &[]);
    let output = plot(at, &["run.mcap", "-o", "out", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    for (name, expected) in [
        ("end-position", ["Position of the rod's end: run", "position (m)", "x", "y"]),
        ("end-velocity", ["Velocity of the rod's end: run", "velocity (m/s)", "x", "y"]),
        ("path", ["Path of the crank pin: run", "x (m)", "y (m)", "0"]),
        ("end-path", ["Path of the rod's end: run", "x (m)", "y (m)", "0"]),
    ] {
        let drawn = texts(&read_to_string(at.join(format!("out/run-{name}.svg"))).unwrap());
        assert!(expected.iter().all(|text| drawn.iter().any(|other| other == text)), "{name}: {drawn:?}");
    }
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(!printed.contains("slider"), "{printed}");
}

#[test]
fn regress_a_file_is_refused_as_many_figures_as_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "0.1", "run.mcap", &[]);
    let listed = String::from_utf8(plot(at, &["run.mcap", "--list"]).stdout).unwrap().lines().count();
    for file in ["x.png", "x.svg"] {
        let output = plot(at, &["run.mcap", "-o", file]);
        assert_eq!(output.status.code(), Some(2));
        let why = format!("{file} would hold {listed} figures");
        assert!(complaint(&output).contains(&why), "{why}: {}", complaint(&output));
    }
}

/// The node that bends most has another number in another mesh.
#[test]
fn regress_largest_deflections_of_other_nodes_share_a_panel() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "1", "coarse.mcap", &[]);
    record(at, "crank-slider", "1", "fine.mcap", &["--set", "rod.elements=8"]);
    assert_eq!(plot(at, &["coarse.mcap", "fine.mcap", "--overlay", "-o", "out"]).status.code(), Some(0));
    let drawn = texts(&read_to_string(at.join("out/overlay-deflections.svg")).unwrap());
    let panels = drawn.iter().filter(|text| text.starts_with("rod at 1/2 length")).count();
    let names = ["coarse (rod: 4 elements)", "fine (rod: 8 elements)"];
    assert!(panels == 1 && names.iter().all(|name| drawn.iter().any(|text| text == name)), "{drawn:?}");
}

#[test]
fn regress_a_single_signal_is_named_at_its_axis() {
    let mut displacements = topic("displacements", 50);
    for (node, deflection_m) in [("crank.1", 0.0), ("rod.1", 1e-3)] {
        displacements.table.push(format!("nodes.{node}.deflection_m"), vec![deflection_m; 50]);
    }
    // Only the rod bends.
    let (_, figure) = recorded(&[displacements]).into_iter().find(|(file, _)| file == "deflections").unwrap();
    let drawn = texts(&figure.to_svg());
    assert!(drawn.iter().any(|text| text == "rod deflection (10⁻³ m)"), "{drawn:?}");
}

#[test]
fn regress_the_earlier_of_two_recordings_is_seen_where_they_agree() {
    let path = |name: &str| {
        let figure = Figure::new("Path", Axis::new("x", "m"), Axis::new("y", "m"));
        let figure = Figure { equal_aspect: true, ..figure }.line("", &[0.0, 1.0, 0.0], &[0.0, 1.0, 0.0]);
        (name.to_owned(), vec![("path".to_owned(), figure)])
    };
    let svg = overlaid(&[path("before"), path("after")])[0].1.to_svg();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let width = |colour: &str| -> f64 {
        let curve = document.descendants().find(|node| node.attribute("stroke") == Some(colour)).unwrap();
        assert_eq!(curve.attribute("stroke-dasharray"), None);
        curve.attribute("stroke-width").unwrap().parse().unwrap()
    };
    assert!(width("#0072b2") > 2.0 * width("#d55e00"), "{svg}");
    assert!(svg.find("#0072b2") < svg.find("#d55e00"), "the wide curve lies beneath");
}

fn topic(name: &str, rows: usize) -> Named {
    let mut table = Table::default();
    for column in ["stamp.sim_time_s", "kinetic_j"] {
        table.push(column.to_owned(), (0..rows).map(|row| row as f64).collect());
    }
    Named { name: format!("flexcrank/crank/{name}"), table, ..Named::default() }
}

#[test]
fn regress_energies_are_drawn_from_their_own_topic_where_there_is_one() {
    let points = |topics: &[Named]| -> Vec<(Mark, usize)> {
        let drawn = recorded(topics).into_iter().filter(|(file, _)| file == "energies");
        let series = drawn.flat_map(|(_, figure)| figure.panels).flat_map(|panel| panel.series);
        series.map(|series| (series.mark, series.xs.len())).collect()
    };
    assert_eq!(points(&[topic("energies", 1000), topic("status", 19)]), [(Mark::Line, 1000)]);
    assert_eq!(points(&[topic("status", 19)]), [(Mark::Points, 19)], "of earlier versions");
}

#[test]
fn prop_times_below_the_best_level_are_shaded_and_named() {
    let with_errors = |errors: [f64; 10]| -> Named {
        let mut angles = topic("angles", 10);
        angles.texts = vec![("level".to_owned(), ["good", "fair", "rough"].map(str::to_owned).to_vec())];
        // After a reset the run goes on at the level in force, and a missing row interrupts nothing.
        angles.table.push("level".to_owned(), vec![0.0, 0.0, 1.0, 1.0, 2.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        angles.table.push("level_error_rad".to_owned(), errors.to_vec());
        angles.table.push("links.crank.chord_rad".to_owned(), (0..10).map(f64::from).collect());
        angles
    };
    let errors = [1e-3, 1e-3, 1e-2, 1e-2, f64::NAN, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2];
    let angles = with_errors(errors);
    let shaded = |angles: &Named, best: Option<&str>| -> Vec<(String, Figure)> {
        let mut figures = recorded(std::slice::from_ref(angles));
        shade_levels(&mut figures, std::slice::from_ref(angles), best);
        figures
    };
    let of_angles = |angles: &Named, best| shaded(angles, best).into_iter().find(|(file, _)| file == "angles").unwrap().1;
    let bands = |figure: &Figure| -> Vec<(String, [f64; 2])> {
        figure.bands.iter().map(|band| (band.label.clone(), band.span)).collect()
    };
    let (fair, rough) = ("level fair (1.0e-2 rad)".to_owned(), "level rough".to_owned());
    let below = [(fair.clone(), [2.0, 4.0]), (rough.clone(), [4.0, 5.0]), (fair.clone(), [7.0, 9.0])];
    let figure = of_angles(&angles, None);
    assert_eq!(bands(&figure), below);
    assert_eq!(bands(&of_angles(&angles, Some("good"))), below);
    assert_eq!(bands(&of_angles(&angles, Some("never in force"))).len(), 5, "all is below it");
    let svg = String::from_utf8(figure.render(Format::Svg).unwrap()).unwrap();
    let count = |colour: &str| svg.matches(&format!("fill=\"{colour}\"")).count();
    assert_eq!([count("#fdf3dc"), count("#f8e3bd")], [2 + 1, 1 + 1], "bands and their samples in the legend");
    let drawn = texts(&svg);
    assert!([&fair, &rough].iter().all(|label| drawn.contains(label)), "{drawn:?}");
    // The first level of a scene need not state an error, and was shaded in place of one that does.
    let unstated = with_errors(errors.map(|error| if error == 1e-3 { f64::NAN } else { error }));
    assert_eq!(bands(&of_angles(&unstated, Some("good"))), below);
    let angles = topic("angles", 10);
    assert!(shaded(&angles, None).iter().all(|(_, figure)| figure.bands.is_empty()), "a scene without levels");
}
