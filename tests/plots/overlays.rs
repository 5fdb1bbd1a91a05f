//! Files over one another.

use std::fs::{read_to_string, write};
use std::path::Path;

use flexcrank::plot::{Axis, Figure, Mark, Picture as _, overlaid};

use super::animations::TUBE;
use super::recording::record;
use super::{complaint, plot, texts};

/// Figures of a recording: the angles of its links, and a path of this title.
fn recording(file: &str, links: &[&str], path: &str) -> (String, Vec<(String, Figure)>) {
    let values = [0.0, 1.0];
    let angles = Figure::new("Chord angles", Axis::new("time", "s"), Axis::new("chord angle", "rad"));
    let angles = links.iter().fold(angles, |figure, link| figure.line(*link, &values, &values));
    let path = Figure::new(path, Axis::new("x", "m"), Axis::new("y", "m")).line("", &values, &values);
    (file.to_owned(), vec![("angles".to_owned(), angles), ("path".to_owned(), path)])
}

#[test]
fn regress_a_file_has_its_name_and_its_style_in_every_figure() {
    let [beam, pin] = ["Path of the beam's end", "Path of the crank pin"];
    let links = ["crank", "rod"];
    let files = [recording("arm", &["beam"], beam), recording("heavy", &links, pin), recording("light", &links, pin)];
    let figures = overlaid(&files);
    let titles: Vec<[&str; 2]> = figures.iter().map(|(name, figure)| [name.as_str(), figure.title.as_str()]).collect();
    assert_eq!(titles, [["angles", "Chord angles"], ["path", beam], ["path-2", pin]]);
    let styles = [
        ("arm", "stroke=\"#0072b2\" stroke-width=\"5\" stroke-opacity=\"0.4\"", [2, 2, 0]),
        ("heavy", "stroke=\"#d55e00\" stroke-width=\"1.9\"/>", [3, 0, 2]),
        ("light", "stroke=\"#009e73\" stroke-width=\"1.9\" stroke-dasharray=\"6 4\"", [3, 0, 2]),
    ];
    for (place, (name, figure)) in figures.iter().enumerate() {
        let svg = figure.to_svg();
        let drawn = texts(&svg);
        for (file, style, curves) in styles {
            let named = drawn.iter().filter(|text| *text == file).count();
            assert_eq!(named, usize::from(curves[place] > 0), "one legend that names {file} in {name}: {drawn:?}");
            assert_eq!(svg.matches(style).count(), curves[place], "{file} in {name}, and its sample in the legend: {svg}");
        }
    }
}

/// The first file's exact solution was thin and dashed, as that of the second: the legend had neither.
#[test]
fn regress_an_exact_solution_has_the_style_of_its_file() {
    let file = |name: &str| {
        let figure = Figure::new("Displacements of the masses", Axis::new("time", "s"), Axis::new("displacement", "m"));
        let figure = figure.line("mass 1", &[0.0, 1.0], &[0.0, 1.0]);
        (name.to_owned(), vec![("masses".to_owned(), figure.series("mass 1, exact", &[0.0, 1.0], &[0.0, 1.0], Mark::Dashes))])
    };
    let laid = overlaid(&["one", "two", "three"].map(file));
    let marks = |panel: usize| laid[0].1.panels[panel].series.iter().map(|series| series.mark).collect::<Vec<Mark>>();
    assert_eq!(marks(1), [Mark::Wide, Mark::Line, Mark::Dashes]);
    assert_eq!(marks(0), marks(1));
}

#[test]
fn regress_recordings_of_different_mechanisms_share_figures_of_one_title_only() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "thesis-beam", "0.1", "beam.mcap", &[]);
    record(at, "crank-slider", "0.1", "crank.mcap", &[]);
    let output = plot(at, &["beam.mcap", "crank.mcap", "--overlay", "-o", "out", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    for (name, title, files) in [
        ("angles", "Chord angles", ["beam", "crank"].as_slice()),
        ("end", "Displacement of the beam's end", &["beam"]),
        ("path", "Path of the beam's end", &["beam"]),
        ("path-2", "Path of the crank pin", &["crank"]),
        ("slider-position", "Slider position", &["crank"]),
    ] {
        let drawn = texts(&read_to_string(at.join(format!("out/overlay-{name}.svg"))).unwrap());
        assert!(drawn.iter().any(|text| text == title), "{name}: {drawn:?}");
        for file in ["beam", "crank"] {
            assert_eq!(drawn.iter().any(|text| text == file), files.contains(&file), "{file} in {name}: {drawn:?}");
        }
    }
}

#[test]
fn regress_tables_over_different_quantities_have_figures_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.csv"), "time_s,torque_nm\n0,1\n1,2\n").unwrap();
    std::fs::write(at.join("b.csv"), "angle_rad,torque_nm,time_s\n0,0,0\n3,3,1\n").unwrap();
    let overlay = |arguments: &[&str]| {
        let output = plot(at, &[&["a.csv", "b.csv", "--overlay", "--y", "torque_nm"], arguments].concat());
        (output.status.code(), complaint(&output))
    };
    assert_eq!(overlay(&["-o", "out", "--format", "svg"]), (Some(0), String::new()));
    for (file, x) in [("overlay", "time (s)"), ("overlay-2", "angle (rad)")] {
        let drawn = texts(&read_to_string(at.join(format!("out/{file}.svg"))).unwrap());
        assert!(drawn.iter().any(|text| text == x), "{x} in {file}: {drawn:?}");
    }
    let (code, refusal) = overlay(&["-o", "one.svg"]);
    assert!(code == Some(2) && refusal.contains("choose one horizontal axis with --x"), "{code:?}: {refusal}");
    assert_eq!(overlay(&["-o", "one.svg", "--x", "time_s"]), (Some(0), String::new()));
}

#[test]
fn regress_a_column_that_one_file_has_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("a.csv"), "time_s,torque_nm\n0,1\n1,2\n").unwrap();
    std::fs::write(at.join("b.csv"), "time_s,angle_rad\n0,0\n1,3\n").unwrap();
    let overlay = |columns: &str| plot(at, &["a.csv", "b.csv", "--overlay", "--y", columns, "-o", "one.svg"]);
    let output = overlay("torque_nm,angle_rad");
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    assert_eq!(complaint(&output), "a.csv: no column `angle_rad`\nb.csv: no column `torque_nm`\n");
    let drawn = texts(&read_to_string(at.join("one.svg")).unwrap());
    for text in ["Torque, angle", "torque (N·m)", "angle (rad)", "a", "b"] {
        assert_eq!(drawn.iter().filter(|other| *other == text).count(), 1, "{text} in {drawn:?}");
    }
    let output = overlay("torque_nm,angel_rad");
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("no column `angel_rad`"), "{}", complaint(&output));
}

#[test]
fn regress_a_table_whose_column_lacks_its_list_lies_over_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "thesis-beam", "0.1", "beam.mcap", &[]);
    std::fs::write(at.join("hand.csv"), "time_s,beam.chord_rad\n0,-1.57\n0.1,-1.5\n").unwrap();
    for (files, column) in [
        (["beam.mcap", "hand.csv"], "beam.chord_rad"),
        (["beam.mcap", "hand.csv"], "links.beam.chord_rad"),
        (["hand.csv", "beam.mcap"], "beam.chord_rad"),
    ] {
        let output = plot(at, &[&files[..], &["--overlay", "--y", column, "-o", "one.svg"]].concat());
        assert_eq!((output.status.code(), complaint(&output)), (Some(0), String::new()), "{files:?}, {column}");
        let drawn = texts(&read_to_string(at.join("one.svg")).unwrap());
        for text in ["Beam chord angle", "beam chord angle (rad)", "beam", "hand"] {
            let times = drawn.iter().filter(|other| *other == text).count();
            assert_eq!(times, 1, "{text} in {drawn:?} of {files:?}, {column}: one panel with both files");
        }
    }
}

/// Records rods of four, eight and three elements. The modal model moves alike whatever nodes it publishes.
fn record_meshes(at: &Path) {
    for (file, elements) in [("coarse.mcap", 4), ("fine.mcap", 8), ("three.mcap", 3)] {
        record(at, "crank-slider", "0.3", file, &["--set", &format!("rod.elements={elements}")]);
    }
}

/// The points of the longest line of a colour.
fn curve(svg: &str, colour: &str) -> String {
    let document = roxmltree::Document::parse(svg).unwrap();
    let lines = document.descendants().filter(|node| node.attribute("stroke") == Some(colour));
    let curves = lines.filter_map(|line| line.attribute("points"));
    curves.max_by_key(|points| points.len()).unwrap_or_default().to_owned()
}

#[test]
fn regress_nodes_of_other_meshes_lie_over_one_another_by_place() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_meshes(at);
    for (columns, labels) in [
        (["--y", "nodes.rod.2.deflection_m"].as_slice(), ["Rod at 1/2 length: deflection", "time (s)"]),
        (&["--x", "nodes.rod.2.x_m", "--y", "rod.2.y_m"], ["Rod at 1/2 length: y", "rod at 1/2 length: x (m)"]),
    ] {
        let files = ["coarse.mcap", "fine.mcap", "three.mcap", "--overlay", "-o", "one.svg"];
        let output = plot(at, &[files.as_slice(), columns].concat());
        let places = "node 2 in coarse.mcap (4 elements), node 4 in fine.mcap (8 elements), no node in three.mcap (3 elements)";
        assert_eq!((output.status.code(), complaint(&output)), (Some(0), format!("rod at 1/2 length: {places}\n")));
        let svg = read_to_string(at.join("one.svg")).unwrap();
        let drawn = texts(&svg);
        for text in labels.into_iter().chain(["coarse (rod: 4 elements)", "fine (rod: 8 elements)"]) {
            assert_eq!(drawn.iter().filter(|other| *other == text).count(), 1, "{text} in {drawn:?}");
        }
        assert!(!drawn.iter().any(|text| text.starts_with("three")), "{drawn:?}");
        let coarse = curve(&svg, "#0072b2");
        assert!(coarse.len() > 500 && coarse == curve(&svg, "#d55e00"), "{columns:?}: {svg}");
    }
}

/// A rigid rod has nodes, and no deflections.
#[test]
fn regress_a_node_stands_for_its_place_in_the_first_file_even_without_the_column() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "0.1", "fine.mcap", &["--set", "rod.elements=8"]);
    let rigid = ["--set", "solver.model=rigid", "--set", "solver.integrator=runge-kutta"];
    record(at, "crank-slider", "0.1", "rigid.mcap", &rigid);
    let output = plot(at, &["rigid.mcap", "fine.mcap", "--overlay", "--y", "rod.2.deflection_m", "-o", "one.svg"]);
    let place = "rod at 1/2 length: node 2 in rigid.mcap (4 elements), node 4 in fine.mcap (8 elements)\n";
    assert_eq!(complaint(&output), format!("{place}rigid.mcap: no column `rod.2.deflection_m`\n"));
}

#[test]
fn regress_places_that_one_mesh_has_are_drawn_alone() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_meshes(at);
    let overlay = |files: [&str; 2], more: &[&str]| {
        let output = plot(at, &[files.as_slice(), &["--overlay", "--format", "svg"], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        complaint(&output)
    };
    let said = overlay(["coarse.mcap", "fine.mcap"], &["--y", "elements.rod.1.axial_n", "-o", "one.svg"]);
    assert_eq!(said, "rod element 1 of 4: element 1 in coarse.mcap (4 elements), no element in fine.mcap (8 elements)\n");
    let drawn = texts(&read_to_string(at.join("one.svg")).unwrap());
    let names: Vec<&String> = drawn.iter().filter(|text| text.ends_with(" elements)")).collect();
    assert_eq!(names, ["coarse (rod: 4 elements)"]);
    let said = overlay(["coarse.mcap", "three.mcap"], &["-o", "out"]);
    let places = [
        "rod at 1/2 length: node 2 in coarse.mcap (4 elements), no node in three.mcap (3 elements)\n",
        "rod at 1/3 length: no node in coarse.mcap (4 elements), node 1 in three.mcap (3 elements)\n",
    ];
    assert_eq!(said, places.concat());
    let drawn = texts(&read_to_string(at.join("out/overlay-deflections.svg")).unwrap());
    for panel in ["crank at 1/2 length", "rod at 1/2 length", "rod at 1/3 length"] {
        assert_eq!(drawn.iter().filter(|text| text.starts_with(panel)).count(), 1, "{panel} in {drawn:?}");
    }
    let drawn = texts(&read_to_string(at.join("out/overlay-angles.svg")).unwrap());
    assert!(["coarse", "three"].iter().all(|name| drawn.iter().any(|text| text == name)), "{drawn:?}");
}

/// A rigid rod has nodes, but no deflections.
#[test]
fn regress_nodes_of_a_rigid_link_lie_at_their_places() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "0.1", "four.mcap", &[]);
    record(at, "crank-slider", "0.1", "rigid.mcap", &["--set", "rod.rigid=true", "--set", "rod.elements=2"]);
    let said = |column: &str| {
        let output = plot(at, &["four.mcap", "rigid.mcap", "--overlay", "--y", column, "-o", "one.svg"]);
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        complaint(&output)
    };
    let places = "rod at 1/2 length: node 2 in four.mcap (4 elements), node 1 in rigid.mcap (2 elements)\n";
    assert_eq!(said("nodes.rod.2.x_m"), places);
    assert_eq!(said("nodes.rod.2.deflection_m"), format!("{places}rigid.mcap: no column `nodes.rod.2.deflection_m`\n"));
}

/// A refusal comes first.
#[test]
fn regress_a_warning_of_several_animations_is_printed_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("tube.toml"), TUBE).unwrap();
    record(at, "tube.toml", "1.2", "short.mcap", &[]);
    record(at, "tube.toml", "1.4", "long.mcap", &[]);
    let overlay = |output: &str| {
        let output = plot(at, &["short.mcap", "long.mcap", "--overlay", "--format", "svg", "-o", output]);
        (output.status.code(), complaint(&output))
    };
    let warning = "warning: short, long: at 0.5 times the real speed, pictures are too rare for the bending of the beam; \
                   --animation=0.025 shows the motion, with --from and --to at most 0.25 s apart\n";
    assert_eq!(overlay("out"), (Some(0), warning.to_owned()));
    let (code, said) = overlay("one.svg");
    assert!(code == Some(2) && said.starts_with("error: one.svg would hold "), "{said}");
}

#[test]
fn regress_a_part_of_a_trade_lies_over_a_whole_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let head = "model,integrator,discretization,failure,step_s,error,error_is_bound,reference_error,seconds_per_simulated_s";
    let rigid = "rigid,runge-kutta,–,,0.01,0.5,0,0.04,1e-4";
    let modal = ["modal,esdirk,1 mode,,0.01,0.06,0,0.04,1e-3", "modal,esdirk,1 mode,,0.005,0.05,0,0.04,2e-3"];
    std::fs::write(at.join("whole.csv"), [head, rigid, modal[0], modal[1]].join("\n")).unwrap();
    std::fs::write(at.join("part.csv"), format!("{head},interrupted\n{},1\n{},1\n", modal[0], modal[1])).unwrap();
    let output = plot(at, &["part.csv", "whole.csv", "--overlay", "-o", "both.svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let svg = read_to_string(at.join("both.svg")).unwrap();
    let drawn = texts(&svg);
    let panels = ["modal relative error", "rigid relative error"];
    let legend = ["part (interrupted study)", "whole", "reference not ten times better", "uncertainty of the reference"];
    for text in ["part, whole"].iter().chain(&panels).chain(&legend) {
        assert_eq!(drawn.iter().filter(|other| other == text).count(), 1, "{text} in {drawn:?}");
    }
    let labels = drawn.iter().filter(|text| text.ends_with("relative error")).count();
    assert_eq!(labels, panels.len(), "no panel for the uncertainty of the reference: {drawn:?}");
    for (colour, lines) in [("#0072b2", 1), ("#d55e00", 2)] {
        let dashed = format!("stroke=\"{colour}\" stroke-width=\"1.9\" stroke-dasharray=\"6 4\"");
        assert_eq!(svg.matches(&dashed).count(), lines, "the uncertainty in each panel of the file in {colour}: {svg}");
    }
    // Columns that are chosen have a legend, too.
    let output = plot(at, &["part.csv", "whole.csv", "--overlay", "--y", "error", "-o", "columns.svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let drawn = texts(&read_to_string(at.join("columns.svg")).unwrap());
    assert!(drawn.iter().any(|text| text == legend[0]), "{drawn:?}");
}

/// A table's node is that of the first recording: beside 4 elements the middle, beside 8 the quarter.
#[test]
fn regress_a_table_without_a_mesh_lies_at_the_place_of_the_first_recordings_node() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_meshes(at);
    write(at.join("lab.csv"), "time_s,rod.2.deflection_m\n0,0\n0.02,1e-6\n").unwrap();
    for (files, place, meshes) in [
        (["lab.csv", "coarse.mcap", "fine.mcap"], "1/2", ["coarse (rod: 4 elements)", "fine (rod: 8 elements)"]),
        (["fine.mcap", "coarse.mcap", "lab.csv"], "1/4", ["fine (rod: 8 elements)", "coarse (rod: 4 elements)"]),
    ] {
        let columns = ["--overlay", "--y", "rod.2.deflection_m", "-o", "one.svg"];
        let output = plot(at, &[files.as_slice(), &columns].concat());
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        let drawn = texts(&read_to_string(at.join("one.svg")).unwrap());
        let axis = format!("rod at {place} length: deflection (m)");
        for text in meshes.into_iter().chain(["lab", axis.as_str()]) {
            assert_eq!(drawn.iter().filter(|other| *other == text).count(), 1, "{text} in {drawn:?}");
        }
    }
}

/// The title named all files, also those without a curve in the figure.
#[test]
fn regress_the_title_of_tables_names_the_files_that_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    for (name, columns) in [("one", "t_s,torque_nm,force_n"), ("two", "t_s,torque_nm,speed_rad_per_s")] {
        write(folder.path().join(format!("{name}.csv")), format!("{columns}\n0,1,2\n1,3,4\n2,0,1\n")).unwrap();
    }
    let output = plot(folder.path(), &["one.csv", "two.csv", "--overlay", "-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    for (figure, title) in [("torque_nm", "one, two"), ("force_n", "one"), ("speed_rad_per_s", "two")] {
        let drawn = texts(&read_to_string(folder.path().join(format!("out/overlay-{figure}.svg"))).unwrap());
        assert!(drawn.iter().any(|text| text == title), "{figure}: {drawn:?}");
        assert!(title == "one, two" || !drawn.iter().any(|text| text == "one, two"), "{figure}: {drawn:?}");
    }
}
