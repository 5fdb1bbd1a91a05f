//! CSV tables.

use flexcrank::plot::{Mark, Named, figure, overview, work_precision};
use flexcrank::study::Table;

use super::{complaint, plot, png_size, texts};

const TURN: &str = "ratio,crank_angle_rad,rod_angle_rad,driving_torque_nm\n0.1,0,0,1\n0.1,3,0.1,2\n0.5,0,0,3\n0.5,3,0.2,4\n";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("turn.csv"), TURN).unwrap();
    folder
}

#[test]
fn prop_a_table_gives_a_figure_for_each_unit_and_a_curve_for_each_ratio() {
    let folder = folder();
    let output = plot(folder.path(), &["turn.csv", "-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    for name in ["turn-rod_angle_rad", "turn-driving_torque_nm"] {
        let file = |ending: &str| folder.path().join("out").join(format!("{name}.{ending}"));
        let texts = texts(&std::fs::read_to_string(file("svg")).unwrap());
        assert!(["turn", "λ = 0.1", "λ = 0.5"].iter().all(|text| texts.iter().any(|other| other == text)), "{texts:?}");
        assert_eq!(png_size(&std::fs::read(file("png")).unwrap())[0], 1520);
    }
}

#[test]
fn prop_columns_are_chosen_by_name() {
    let folder = folder();
    let arguments =
        ["turn.csv", "--x", "rod_angle_rad", "--y", "driving_torque_nm,crank_angle_rad", "--title", "Two", "-o", "two.svg"];
    let output = plot(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let texts = texts(&std::fs::read_to_string(folder.path().join("two.svg")).unwrap());
    for expected in ["Two", "driving torque (N·m)", "crank angle (rad)", "λ = 0.1", "λ = 0.5"] {
        assert_eq!(texts.iter().filter(|text| *text == expected).count(), 1, "{expected} in {texts:?}");
    }
}

#[test]
fn regress_a_folder_may_have_a_dot_in_its_name() {
    let folder = folder();
    for name in ["step0.5", "step0.5b", "turn.pdf/"] {
        let output = plot(folder.path(), &["turn.csv", "-o", name]);
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        assert!(folder.path().join(name).join("turn-rod_angle_rad.svg").is_file(), "{name}");
    }
    let output = plot(folder.path(), &["turn.csv", "-o", "other.pdf"]);
    let why = "other.pdf: a picture ends in .svg or .png; for several, name a folder (other.pdf/)";
    assert!(output.status.code() == Some(2) && complaint(&output).contains(why), "{}", complaint(&output));
    assert!(!folder.path().join("other.pdf").exists());
}

/// The only figure of a table: its curves' names, marks and horizontal values.
fn curves(table: &Table) -> Vec<(String, Mark, Vec<f64>)> {
    let mut figures = overview(table).unwrap();
    assert_eq!(figures.len(), 1);
    let series = figures.remove(0).1.panels.into_iter().flat_map(|panel| panel.series);
    series.map(|series| (series.label, series.mark, series.xs)).collect()
}

#[test]
fn regress_several_modes_at_each_angle_are_a_curve_each() {
    let mut table = Table::default();
    let words = |words: [&str; 4]| words.map(str::to_owned).to_vec();
    table.push_words("part", words(["rod", "rod", "rod", "crank"]));
    table.push_words("mode", words(["first", "second", "first", "second"]));
    table.push("angle_deg", vec![0.0, 0.0, 10.0, 10.0]);
    table.push("frequency_hz", vec![1.0, 5.0, 2.0, 6.0]);
    let curve = |name: &str| (name.to_owned(), Mark::Line, vec![0.0, 10.0]);
    assert_eq!(curves(&table), [curve("first"), curve("second")]);
}

#[test]
fn regress_rows_in_no_order_are_points() {
    let drawn = |xs: [f64; 4]| {
        let mut table = Table::default();
        // A name for each row is no curve.
        table.push_words("name", ["a", "b", "c", "d"].map(str::to_owned).to_vec());
        table.push("angle_deg", xs.to_vec());
        table.push("frequency_hz", vec![1.0, 5.0, 2.0, 6.0]);
        curves(&table).into_iter().map(|(_, mark, _)| mark).collect::<Vec<_>>()
    };
    assert_eq!(drawn([0.0, 0.0, 10.0, 10.0]), [Mark::Points]);
    assert_eq!(drawn([0.0, 20.0, 10.0, 30.0]), [Mark::Points]);
    assert_eq!(drawn([0.0, 10.0, f64::NAN, 30.0]), [Mark::Line]);
    assert_eq!(drawn([3.0, 2.0, 1.0, 0.0]), [Mark::Line]);
}

#[test]
fn regress_a_path_over_time_stays_a_line() {
    let mut table = Table::default();
    table.push("time_s", vec![0.0, 1.0, 2.0]);
    table.push("x_m", vec![0.0, 1.0, 0.0]);
    table.push("y_m", vec![0.0, 1.0, 2.0]);
    let path = figure(&[Named { table, ..Named::default() }], Some("x_m"), &["y_m".to_owned()]).unwrap();
    assert_eq!(path.panels[0].series[0].mark, Mark::Line);
}

#[test]
fn regress_tables_with_other_separators_or_without_names_are_refused_in_words() {
    let folder = folder();
    for (text, says) in [
        ("time_s;torque_nm\n0,5;1\n1,0;2\n", "columns are separated by semicolons: separate them by commas"),
        ("time_s\ttorque_nm\n0\t1\n", "columns are separated by tabs: separate them by commas"),
        (
            "t,x\n0,1\n\n1,0,5\n",
            "line 4: 3 values in a table of 2 columns; if a number was meant, it has a decimal point, not a comma",
        ),
        ("0,1\n0.5,2\n", "the first line has numbers: a header with the columns' names is needed"),
    ] {
        std::fs::write(folder.path().join("other.csv"), text).unwrap();
        let output = plot(folder.path(), &["other.csv", "-o", "out"]);
        assert_eq!(output.status.code(), Some(1), "{}", complaint(&output));
        assert!(complaint(&output).contains(&format!("other.csv: {says}")), "{}", complaint(&output));
    }
    assert!(!folder.path().join("out").exists(), "a refusal draws nothing");
}

#[test]
fn prop_a_sweep_is_drawn_over_its_ratio() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sweep.csv"), "ratio,stroke_m,peak_driving_torque_nm\n0.1,0.1,1\n0.2,0.2,3\n0.3,0.3,7\n")
        .unwrap();
    let output = plot(folder.path(), &["sweep.csv", "-o", "sweep.svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let texts = texts(&std::fs::read_to_string(folder.path().join("sweep.svg")).unwrap());
    let wanted = ["crank-to-rod ratio λ", "peak driving torque (N·m)", "stroke (m)"];
    assert!(wanted.iter().all(|text| texts.iter().any(|other| other == text)), "one figure for all: {texts:?}");
}

#[test]
fn regress_a_table_of_an_interrupted_trade_is_a_part() {
    let folder = tempfile::tempdir().unwrap();
    let head = "model,integrator,discretization,failure,step_s,error,seconds_per_simulated_s";
    for (interrupted, is_part) in [(["", ""], false), ([",interrupted", ",1"], true)] {
        let [name, value] = interrupted;
        let rows =
            format!("{head}{name}\nrigid,runge-kutta,–,,0.01,0.1,1e-4{value}\nmodal,esdirk,1 mode,,0.01,0.05,1e-3{value}\n");
        std::fs::write(folder.path().join("trade.csv"), rows).unwrap();
        let output = plot(folder.path(), &["trade.csv", "-o", "trade.svg"]);
        let said = complaint(&output);
        assert_eq!(output.status.code(), Some(0), "{said}");
        assert_eq!(said.contains("trade.csv: a part of the configurations"), is_part, "{said}");
        let drawn = texts(&std::fs::read_to_string(folder.path().join("trade.svg")).unwrap());
        assert_eq!(drawn.iter().any(|text| text == "trade (interrupted study)"), is_part, "{drawn:?}");
        let columns = ["trade.csv", "--x", "seconds_per_simulated_s", "--y", "error", "-o", "columns.svg"];
        let output = plot(folder.path(), &columns);
        let said = complaint(&output);
        assert_eq!(output.status.code(), Some(0), "{said}");
        assert_eq!(said.contains("trade.csv: a part of the configurations"), is_part, "{said}");
        let drawn = texts(&std::fs::read_to_string(folder.path().join("columns.svg")).unwrap());
        assert_eq!(drawn.iter().any(|text| text == "Error: trade (interrupted study)"), is_part, "{drawn:?}");
    }
}

#[test]
fn prop_a_trade_gives_a_work_precision_diagram() {
    let folder = tempfile::tempdir().unwrap();
    let rows = [
        "model,integrator,discretization,failure,step_s,error,seconds_per_simulated_s",
        "rigid,runge-kutta,–,,0.01,0.1,1e-4",
        "modal,generalized-alpha,1 mode,,0.01,0.05,1e-3",
        "modal,generalized-alpha,2 modes,,0.01,0.06,2e-3",
        "modal,generalized-alpha,2 modes,,0.001,0.002,2e-2",
        "modal,two-point,1 mode,it diverged,0.01,,",
    ];
    std::fs::write(folder.path().join("trade.csv"), rows.join("\n")).unwrap();
    let output = plot(folder.path(), &["trade.csv", "-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let texts = texts(&std::fs::read_to_string(folder.path().join("out/trade-work-precision.svg")).unwrap());
    let count = |text: &str| texts.iter().filter(|other| *other == text).count();
    for (text, times) in [
        ("rigid", 1),
        ("modal", 1),
        ("rigid, runge-kutta", 1),
        ("step 10 ms", 1),
        ("modal, generalized-alpha", 2),
        ("2 modes, step 1 ms", 1),
        ("2 modes, step 10 ms", 0),
        ("modal, two-point", 0),
        ("10⁻³", 1),
    ] {
        assert_eq!(count(text), times, "{text} in {texts:?}");
    }
    for number in ["1", "2", "3"] {
        assert_eq!(count(number), 2, "{number} in place and in the list: {texts:?}");
    }
    assert_eq!(count("4"), 0, "only the front is numbered");
}

#[test]
fn regress_errors_that_the_reference_knows_less_well_have_hollow_marks() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("trade.csv");
    let rows = [
        "model,integrator,discretization,failure,step_s,error,error_is_bound,reference_error,seconds_per_simulated_s",
        "rigid,runge-kutta,–,,0.01,1,0,1e-4,1e-4",
        "modal,esdirk,1 mode,,0.01,0.075,1,0.075,1e-3",
        "modal,esdirk,2 modes,,0.01,0.2,0,0.075,2e-3",
    ];
    let explained = [(Mark::Triangles, "below the reference's own uncertainty"), (Mark::Rings, "reference not ten times better")];
    let line = "uncertainty of the reference";
    std::fs::write(&file, rows.join("\n")).unwrap();
    let drawn = work_precision(&Table::read_csv(&file).unwrap()).unwrap();
    let series: Vec<_> = drawn.panels[0].series.iter().map(|one| (one.label.as_str(), one.mark, one.ys.clone())).collect();
    let expected = [
        ("rigid", Mark::Points, vec![1.0]),
        ("modal", Mark::Points, vec![]),
        ("modal", Mark::Rings, vec![0.2]),
        ("modal", Mark::Triangles, vec![0.075]),
        (line, Mark::Limit, vec![0.075; 2]),
    ];
    assert_eq!(series, expected);
    assert_eq!(drawn.explained, explained.map(|(mark, label)| (mark, label.to_owned())));
    assert_eq!(drawn.numbered.iter().map(|point| point.mark).collect::<Vec<_>>(), [Mark::Points, Mark::Triangles]);
    let labels = [explained[0].1, explained[1].1, line, "rigid", "modal"];
    let shown = |name: &str| {
        let output = plot(folder.path(), &["trade.csv", "-o", name]);
        assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
        let texts = texts(&std::fs::read_to_string(folder.path().join(name)).unwrap());
        labels.map(|label| texts.iter().filter(|text| *text == label).count())
    };
    assert_eq!(shown("trade.svg"), [1; 5]);
    // Of an earlier version.
    std::fs::write(&file, rows.join("\n").replace("error_is_bound,reference_error", "a,b")).unwrap();
    assert_eq!(shown("earlier.svg"), [0, 0, 0, 1, 1]);
}

#[test]
fn regress_a_long_entry_of_the_list_ends_within_the_figure() {
    let folder = folder();
    let rows = [
        "model,integrator,discretization,failure,step_s,error,seconds_per_simulated_s",
        "modal,esdirk,\"2 and 6 modes, axial, hinged on a spring\",,0.001,0.002,1e-3",
        "modal,esdirk,1 mode,,0.01,0.1,1e-4",
    ];
    std::fs::write(folder.path().join("long.csv"), rows.join("\n")).unwrap();
    let output = plot(folder.path(), &["long.csv", "-o", "long.svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let drawn = std::fs::read_to_string(folder.path().join("long.svg")).unwrap();
    let entry = drawn.lines().find(|line| line.contains("hinged on a spring")).unwrap();
    let number =
        |name: &str| entry.split(&format!(" {name}=\"")).nth(1).unwrap().split('"').next().unwrap().parse::<f64>().unwrap();
    // A letter is on average some half as wide as its size.
    let end = number("x") + 0.45 * number("font-size") * "2 and 6 modes, axial, hinged on a spring, step 1 ms".len() as f64;
    assert!(end < 760.0, "ends at {end} px: {entry}");
}

#[test]
fn prop_undrawable_input_is_refused() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("words.csv"), "a,b\nx,y\n").unwrap();
    std::fs::write(at.join("one.csv"), "a_m\n1\n2\n").unwrap();
    std::fs::write(at.join("ragged.csv"), "a,b\n1\n").unwrap();
    std::fs::write(at.join("noise.mcap"), "no recording").unwrap();
    std::fs::write(at.join("table.parquet"), b"PAR1\x15\xff\xff").unwrap();
    std::fs::write(at.join("trade.svg"), "<svg>\n<style>a,b\n</style>\n</svg>\n").unwrap();
    std::fs::write(at.join("trade.PNG"), b"\x89PNG\r\n").unwrap();
    for (arguments, code, says) in [
        (vec!["turn.csv", "--y", "driving_torqe_nm"], 2, "did you mean `driving_torque_nm`?"),
        (vec!["turn.csv", "--y", "driving_torque_nm", "--x", "crank_angle"], 2, "did you mean `crank_angle_rad`?"),
        (vec!["turn.csv", "-o", "all.svg"], 2, "would hold 2 figures"),
        (vec!["turn.csv", "--y", "ratio", "-o", "x.pdf"], 2, ".svg or .png"),
        (vec!["turn.csv", "--y", "ratio", "-o", "new/x.svg"], 1, "new/x.svg: the folder new does not exist"),
        (vec!["turn.csv", "-o", "new/plots"], 1, "new/plots: the folder new does not exist"),
        (vec!["words.csv"], 2, "words.csv: nothing to draw"),
        (vec!["one.csv"], 2, "nothing to draw"),
        (vec!["ragged.csv"], 1, "ragged.csv"),
        (vec!["none.csv"], 1, "none.csv"),
        (vec!["noise.mcap"], 1, "noise.mcap"),
        (vec!["table.parquet"], 1, "table.parquet: is a Parquet table, and `plot` reads CSV: `sweep --plot` draws a campaign"),
        (vec!["trade.svg"], 1, "trade.svg: neither a recording nor a table, but a picture: name the file that it shows"),
        (vec!["trade.PNG"], 1, "trade.PNG: neither a recording nor a table, but a picture"),
        (vec!["none.svg"], 1, "none.svg: No such file"),
        (vec!["turn.csv", "--format", "gif"], 2, "svg"),
        (vec!["turn.csv", "--thesis", "t"], 2, "--thesis"),
        (vec!["turn.csv", "--from", "1"], 2, "cut by a column `stamp.sim_time_s`, and there is none"),
        (vec!["turn.csv", "--from", "2", "--to", "2"], 2, "must be less than"),
        (vec!["turn.csv", "--animation"], 2, "no link"),
        (vec!["turn.csv", "--overlay"], 2, "two files"),
        (vec![], 2, "FILE"),
    ] {
        let output = plot(at, &arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", complaint(&output));
        assert!(complaint(&output).contains(says), "{arguments:?}: {}", complaint(&output));
    }
}

#[test]
fn regress_files_of_one_name_are_told_apart_by_their_folders() {
    let folder = folder();
    let at = folder.path();
    for name in ["a", "b"] {
        std::fs::create_dir(at.join(name)).unwrap();
        std::fs::copy(at.join("turn.csv"), at.join(name).join("turn.csv")).unwrap();
    }
    let output = plot(at, &["a/turn.csv", "b/turn.csv", "-o", "out", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    for name in ["a", "b"] {
        let drawn = texts(&std::fs::read_to_string(at.join(format!("out/{name}-turn-rod_angle_rad.svg"))).unwrap());
        assert!(drawn.contains(&format!("{name}/turn")), "{drawn:?}");
    }
    std::fs::copy(at.join("turn.csv"), at.join("a-turn.csv")).unwrap();
    let output = plot(at, &["a/turn.csv", "b/turn.csv", "a-turn.csv", "-o", "out"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("plot these files one by one, into different folders"), "{}", complaint(&output));
}

#[test]
fn regress_a_column_is_found_without_the_name_of_its_list() {
    let mut table = Table::default();
    for name in ["stamp.sim_time_s", "joints.pivot.fx_n", "joints.pivot.fy_n", "nodes.rod.0.turn_rad", "links.rod.0.turn_rad"] {
        table.push(name, vec![0.0, 1.0]);
    }
    let tables = [Named { name: "loads".to_owned(), table, ..Named::default() }];
    let drawn = |name: &str| figure(&tables, Some("stamp.sim_time_s"), &[name.to_owned()]);
    assert_eq!(drawn("pivot.fx_n").unwrap(), drawn("joints.pivot.fx_n").unwrap());
    assert!(drawn("rod.0.turn_rad").is_err(), "either may be meant");
    assert!(drawn("fx_n").is_err(), "of some joint");
}

#[test]
fn regress_the_slider_of_watch_is_refused_with_the_name_of_its_column() {
    let mut table = Table::default();
    for name in ["stamp.sim_time_s", "nodes.rod.0.x_m", "nodes.rod.4.x_m"] {
        table.push(name, vec![0.0, 1.0]);
    }
    let tables = [Named { name: "displacements".to_owned(), table, ..Named::default() }];
    let refused = figure(&tables, None, &["slider.x_m".to_owned()]).unwrap_err().to_string();
    assert!(refused.contains("did you mean `nodes.rod.4.x_m`?"), "{refused}");
}

#[test]
fn val_names_are_read_as_quantities() {
    for (column, label, unit) in [
        ("piston_acceleration_m_per_s2", "piston acceleration", "m/s²"),
        ("driving_torque_nm", "driving torque", "N·m"),
        ("crank_inertia_about_o_kg_m2", "crank inertia about o", "kg·m²"),
        ("links.crank.rate_rad_per_s", "crank rate", "rad/s"),
        ("friction_n_s_per_m", "friction", "N·s/m"),
        ("damper_nm_s_per_rad", "damper", "N·m·s/rad"),
        ("rod.density_kg_per_m3", "rod density", "kg/m³"),
        ("rod.section.second_moment_m4", "rod section second moment", "m⁴"),
        ("nodes.rod.4.vx_m_per_s", "rod node 4 velocity along x", "m/s"),
        ("steps_per_s", "steps per second", ""),
        ("seconds_per_simulated_s", "computing time per simulated second", "s/s"),
        ("slowest_seconds_per_simulated_s", "slowest computing time per simulated second", "s/s"),
        ("growth_per_s", "growth", "1/s"),
        ("eigenvalue_re_per_s", "eigenvalue re", "1/s"),
        ("crank_angle_rad_per_torque_nm", "crank angle per torque", "rad per N·m"),
        ("slider_speed_m_per_s_per_slider_force_n", "slider speed per slider force", "m/s per N"),
        ("relative_error_end_position_m", "relative error end position", ""),
        ("swept_volume_per_size", "swept volume per size", ""),
        ("steps_per_revolution", "steps per revolution", ""),
        ("force_o_x", "force o x", ""),
        ("m", "m", ""),
        ("x_m", "x", "m"),
        ("angle_deg", "angle", "°"),
        ("piston_acceleration_over_l2_omega2", "piston acceleration / (l₂ ω²)", ""),
        ("rod_rate_over_omega", "rod rate / ω", ""),
        ("driving_torque_over_m3_l2_squared_omega2", "driving torque / (m₃ l₂² ω²)", ""),
    ] {
        let mut table = Table::default();
        table.push(column, vec![0.0, 1.0]);
        let drawn = figure(&[Named { table, ..Named::default() }], None, &[column.to_owned()]).unwrap();
        let panel = &drawn.panels[0];
        assert_eq!([&panel.series[0].label, &panel.y.unit], [label, unit], "{column}");
    }
}
