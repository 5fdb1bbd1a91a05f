//! `linearise`, `response` and `modes` as their users run them: files that are whole, refusals that help, modes that keep their names.

mod response;

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

type Outcome = Result<(), Box<dyn Error>>;

/// Exit code, standard output and standard error.
fn flexcrank(folder: &Path, line: &str) -> Result<(Option<i32>, String, String), Box<dyn Error>> {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(line.split(' ')).current_dir(folder).output()?;
    Ok((output.status.code(), String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?))
}

#[test]
fn prop_files_hold_matrices_that_fit_their_names() -> Outcome {
    let folder = tempfile::tempdir()?;
    let elements = "--set solver.model=finite-element --set solver.integrator=generalized-alpha --set rod.elements=2";
    for line in [
        "crank-slider --angle 57".to_owned(),
        "crank-slider --crank held".to_owned(),
        "crank-slider --step 1ms".to_owned(),
        "crank-slider --scheme".to_owned(),
        format!("crank-slider --scheme {elements}"),
        "thesis-two-masses".to_owned(),
    ] {
        let (code, _, said) = flexcrank(folder.path(), &format!("linearise {line} -o all.json"))?;
        assert_eq!(code, Some(0), "{line}: {said}");
        let read: Value = serde_json::from_slice(&std::fs::read(folder.path().join("all.json"))?)?;
        let list = |name: &str| read[name].as_array().map_or(0, Vec::len);
        let (states, inputs, outputs) = (list("states"), list("inputs"), list("outputs"));
        for (name, rows, columns) in
            [("A", states, states), ("B", states, inputs), ("C", outputs, states), ("D", outputs, inputs)]
        {
            let matrix = read[name].as_array().ok_or("no matrix")?;
            assert_eq!(matrix.len(), rows, "{line}: rows of {name}");
            assert!(matrix.iter().all(|row| row.as_array().is_some_and(|row| row.len() == columns)), "{line}: columns of {name}");
        }
        assert_eq!(list("at"), outputs, "{line}");
        let mut names: Vec<String> = read["states"].as_array().ok_or("none")?.iter().map(Value::to_string).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), states, "{line}: two states have one name");
        assert_eq!(read["dt"].is_null(), !line.contains("--s"), "{line}: {}", read["dt"]);
    }
    Ok(())
}

#[test]
fn regress_a_model_without_linearisation_is_refused_with_one_that_has_it() -> Outcome {
    let folder = tempfile::tempdir()?;
    let way = "--set solver.model=modal";
    for scene in ["thesis-beam", "thesis-beam-tip", "thesis-crank-slider"] {
        let (code, _, said) = flexcrank(folder.path(), &format!("modes {scene}"))?;
        assert!(code == Some(2) && said.ends_with(&format!(" have: add {way}\n")), "{said}");
        let (code, _, said) = flexcrank(folder.path(), &format!("modes {scene} {way}"))?;
        assert_eq!(code, Some(0), "{scene}: {said}");
    }
    Ok(())
}

#[test]
fn prop_what_cannot_be_linearised_is_refused() -> Outcome {
    let folder = tempfile::tempdir()?;
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/sample-three-pulses.mcap");
    let many = "--set solver.model=finite-element --set solver.integrator=generalized-alpha --set rod.elements=400";
    for (line, why) in [
        ("linearise -o crank.txt".to_owned(), ".json, .m (MATLAB, Octave), .py or .npz"),
        ("linearise nosuch -o crank.py".to_owned(), "nosuch"),
        ("linearise thesis-crank-slider --set solver.model=incremental -o crank.py".to_owned(), "no linearisation"),
        (format!("linearise {many} -o crank.py"), "more than 2000"),
        (
            "linearise crank-slider --speed 3 -o crank.py".to_owned(),
            "only one link without weight turns steadily; others turn periodically: \
             `flexcrank modes crank-slider --periodic --speed 3`",
        ),
        (format!("linearise {recording} -o crank.py"), "is a recording: name an instant of it"),
        ("modes crank-slider --angle 10:0:1".to_owned(), "TO not below FROM and STEP above 0"),
        ("linearise thesis-two-masses --angle 3 -o crank.py".to_owned(), "no crank"),
        (
            "linearise --set solver.model=rigid --set solver.integrator=esdirk --crank held -o crank.py".to_owned(),
            "nothing can move: the links are rigid, and the crank is held; `--crank free` lets it turn",
        ),
        (
            format!("modes {recording}@1 --periodic --speed 3"),
            "`modes --periodic` are of a scene: an instant of a recording has its own angle and speed",
        ),
        ("response --output nosuch".to_owned(), "there are crank_angle_rad"),
        ("response --input nosuch".to_owned(), "there are torque_nm, slider_force_n"),
        ("response --from 3 --to 2".to_owned(), "--from 3 must be less than --to 2"),
    ] {
        let (code, _, said) = flexcrank(folder.path(), &line)?;
        assert_eq!(code, Some(2), "{line}: {said}");
        assert!(said.contains(why), "{line}: {said}");
    }
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 0, "a refusal writes nothing");
    Ok(())
}

#[test]
fn regress_a_mode_that_is_another_kind_only_between_is_told() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (code, told, said) = flexcrank(folder.path(), "modes crank-slider --angle 0:360:20 --csv all.csv")?;
    assert_eq!((code, said.as_str()), (Some(0), ""));
    let between = "crank bending 2 (99 %) from 20° to 160°, from 200° to 340°";
    assert!(told.contains(&format!("  the branch that begins as rod stretching 1 is {between}\n")), "{told}");
    let rows = std::fs::read_to_string(folder.path().join("all.csv"))?.lines().count() - 1;
    assert!(told.ends_with(&format!("all.csv ({rows} rows)\n")), "{told}");
    Ok(())
}

#[test]
fn regress_a_picture_of_a_sweep_names_the_other_kinds_of_a_branch() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (code, told, said) = flexcrank(folder.path(), "modes crank-slider --angle 0:360:20 --plot drawn")?;
    assert_eq!(code, Some(0), "{said}");
    let svg = std::fs::read_to_string(folder.path().join("drawn/frequencies.svg"))?;
    for label in [">rod bending 1<", ">rod stretching 1, in places crank bending 2 (99 %)<"] {
        assert!(svg.contains(label), "{label} in {svg}");
    }
    assert!(told.contains("most damping"), "{told}");
    Ok(())
}

/// Frequency of every mode of a sweep at an angle of it, by name.
fn frequencies(folder: &Path, line: &str, angle_deg: f64) -> Result<BTreeMap<String, f64>, Box<dyn Error>> {
    let (code, found, said) = flexcrank(folder, &format!("modes crank-slider --set pulse=[] --json {line}"))?;
    assert_eq!((code, said.as_str()), (Some(0), ""), "{line}");
    let rows = found.lines().map(serde_json::from_str).collect::<Result<Vec<Value>, _>>()?;
    let here = rows.iter().filter(|row| row["angle_deg"] == angle_deg);
    let named = |row: &Value| Some((row["mode"].as_str()?.to_owned(), row["frequency_hz"].as_f64()?));
    here.map(|row| named(row).ok_or_else(|| format!("{row}").into())).collect()
}

/// A free crank with a damper keeps its angle, and loses its speed.
#[test]
fn regress_no_two_modes_have_the_same_name() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (code, found, said) = flexcrank(folder.path(), "modes crank-slider --set base.damper_nm_s_per_rad=0.1 --json")?;
    assert_eq!((code, said.as_str()), (Some(0), ""));
    let rows = found.lines().map(serde_json::from_str).collect::<Result<Vec<Value>, _>>()?;
    let names: BTreeSet<&str> = rows.iter().filter_map(|row| row["mode"].as_str()).collect();
    assert!(names.len() == rows.len() && names.contains("chain rotation 2"), "{names:?}");
    Ok(())
}

#[test]
fn regress_a_mode_keeps_its_name_in_a_coarse_sweep() -> Outcome {
    let folder = tempfile::tempdir()?;
    let fine = frequencies(folder.path(), "--angle 0:90:1", 90.0)?;
    assert_eq!(fine.get("chain rotation"), Some(&0.0), "{fine:?}");
    for step in [5, 15, 30, 45, 90] {
        let coarse = frequencies(folder.path(), &format!("--angle 0:90:{step}"), 90.0)?;
        for (name, hertz) in &fine {
            let other = coarse.get(name).ok_or_else(|| format!("{name} is not in {coarse:?}, of step {step}"))?;
            assert!((hertz - other).abs() <= 1e-6 * hertz, "{name}, step {step}: {other} Hz instead of {hertz}");
        }
    }
    Ok(())
}

/// The command that is named had lost the changes of the scene.
#[test]
fn regress_a_named_command_keeps_the_changes_of_the_scene() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (code, _, said) = flexcrank(folder.path(), "linearise ref-r3 --set rod.elements=8 --speed 30 -o x.npz")?;
    let command = "`flexcrank modes ref-r3 --set 'rod.elements=8' --periodic --speed 30`";
    assert!(code == Some(2) && said.contains(command), "{said}");
    Ok(())
}

/// The speed was neither in the heading nor in the rows.
#[test]
fn regress_modes_at_an_angle_and_a_speed_name_both() -> Outcome {
    let folder = tempfile::tempdir()?;
    let beam = "modes thesis-beam --set solver.model=modal";
    for (line, heading, speeds) in [
        ("--angle 10 --speed 500", "modal, crank free at 10°, turning at 500 rad/s\n", &[Some(500.0)][..]),
        ("--angle 10", "modal, crank free at 10°\n", &[None]),
        ("--angle 10 --speed 0:20:10", "3 points from 0 rad/s to 20 rad/s, at 10°\n", &[Some(0.0), Some(10.0), Some(20.0)]),
        ("--angle 0:10:10 --speed 500", "2 points from 0° to 10°, turning at 500 rad/s\n", &[Some(500.0)]),
    ] {
        let (code, told, said) = flexcrank(folder.path(), &format!("{beam} {line}"))?;
        assert!(code == Some(0) && told.starts_with(&format!("thesis-beam: {heading}")), "{line}: {told} {said}");
        let (code, rows, said) = flexcrank(folder.path(), &format!("{beam} {line} --json"))?;
        assert_eq!(code, Some(0), "{line}: {said}");
        let rows = rows.lines().map(serde_json::from_str).collect::<Result<Vec<Value>, _>>()?;
        let all_at_10 = rows.iter().all(|row| row["angle_deg"].as_f64() == Some(10.0));
        assert!(!rows.is_empty() && (all_at_10 || line.contains("0:10:10")), "{line}: {rows:?}");
        let found: Vec<Option<f64>> = rows.iter().map(|row| row["speed_rad_per_s"].as_f64()).collect();
        assert!(
            found.iter().all(|speed| speeds.contains(speed)) && speeds.iter().all(|speed| found.contains(speed)),
            "{found:?}"
        );
    }
    Ok(())
}

/// Both tables went to one file, so that the frequency response was lost.
#[test]
fn regress_two_tables_in_one_file_are_refused() -> Outcome {
    let folder = tempfile::tempdir()?;
    std::fs::create_dir(folder.path().join("sub"))?;
    for other in ["x.csv", "./x.csv", "sub/../x.csv"] {
        let (code, _, said) = flexcrank(folder.path(), &format!("response --csv x.csv --step-csv {other}"))?;
        assert!(code == Some(2) && said.contains("--csv and --step-csv name one file, x.csv"), "{other}: {said}");
        assert!(!folder.path().join("x.csv").exists(), "{other}");
    }
    let (code, _, said) = flexcrank(folder.path(), "response --csv x.csv --step-csv sub/x.csv")?;
    assert_eq!(code, Some(0), "{said}");
    Ok(())
}

/// The refusal blamed an option that was not given.
#[test]
fn regress_an_end_of_the_frequencies_beyond_the_default_of_the_other_asks_for_that() -> Outcome {
    let folder = tempfile::tempdir()?;
    for (line, other, above) in [("--from 1e5", "--to", "above"), ("--to 1e-5", "--from", "below")] {
        let (code, _, said) = flexcrank(folder.path(), &format!("response {line}"))?;
        let asked = format!(" is {above} the default of {other}, ");
        assert!(code == Some(2) && said.contains(&asked) && said.ends_with(&format!(" Hz: give {other} as well\n")), "{said}");
    }
    Ok(())
}

#[test]
fn regress_a_held_crank_with_rigid_links_is_refused_with_the_option_that_frees_it() -> Outcome {
    let folder = tempfile::tempdir()?;
    let why = "error: nothing can move: the links are rigid, and the crank is held; `--crank free` lets it turn\n";
    for line in ["modes thesis-compressor", "modes thesis-compressor --angle 0:90:30", "response thesis-compressor"] {
        let (code, _, said) = flexcrank(folder.path(), line)?;
        assert_eq!((code, said.as_str()), (Some(2), why), "{line}");
    }
    let (code, told, said) = flexcrank(folder.path(), "modes thesis-compressor --crank free")?;
    assert!(code == Some(0) && told.contains("chain rotation"), "{told} {said}");
    Ok(())
}

/// clap asks for no option that conflicts with one that is given.
#[test]
fn regress_a_time_to_wait_without_a_service_is_refused() -> Outcome {
    let folder = tempfile::tempdir()?;
    for (line, named) in [("", "--live <NAME>"), (" --csv x.csv", "--csv <FILE>"), (" --periodic --speed 3", "--periodic")] {
        let (code, _, said) = flexcrank(folder.path(), &format!("modes crank-slider --wait=1s{line}"))?;
        assert!(code == Some(2) && said.contains(named), "{line}: {said}");
    }
    Ok(())
}

/// A table took the place of the scene or the recording that it was computed from.
#[test]
fn regress_no_command_replaces_what_it_reads_or_a_recording() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    let (_, scene, _) = flexcrank(folder.path(), "scenes crank-slider")?;
    let recording = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/sample-three-pulses.mcap"))?;
    ["s.toml", "s.json", "s.svg"].into_iter().try_for_each(|name| std::fs::write(at(name), &scene))?;
    std::fs::write(at("b.mcap"), &recording)?;
    let recorded = "b.mcap: is a recording, and recordings are never overwritten";
    for (line, why) in [
        ("modes b.mcap@1.5 --csv b.mcap", "--csv names b.mcap, which is read"),
        ("modes s.toml --csv b.mcap", recorded),
        ("modes s.toml --csv ./s.toml", "--csv names ./s.toml, which is read"),
        ("modes s.toml --periodic --speed 3 --csv s.toml", "--csv names s.toml, which is read"),
        ("modes s.toml --periodic --speed 3 --csv b.mcap", recorded),
        ("response s.toml --csv s.toml", "--csv names s.toml, which is read"),
        ("response s.toml --step-csv b.mcap", recorded),
        ("linearise s.json -o s.json", "--output names s.json, which is read"),
        ("cycle s.toml --csv s.toml", "--csv names s.toml, which is read"),
        ("cycle --csv b.mcap", recorded),
        ("trade s.svg --plot s.svg", "--plot names s.svg, which is read"),
        ("trade s.toml --csv b.mcap", recorded),
        ("trade s.toml --csv x.svg --plot ./x.svg", "--csv and --plot name one file, x.svg: each needs its own"),
        ("trade s.toml --tolerance 1e-2 --write x.toml --csv x.toml", "--write and --csv name one file, x.toml"),
    ] {
        let (code, out, said) = flexcrank(folder.path(), line)?;
        assert!(code == Some(2) && said.contains(why) && out.is_empty(), "{line}: {code:?} {said}");
    }
    assert_eq!(std::fs::read(at("b.mcap"))?, recording);
    for name in ["s.toml", "s.json", "s.svg"] {
        assert_eq!(std::fs::read_to_string(at(name))?, scene, "{name}");
    }
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 4, "a refusal writes nothing");
    Ok(())
}
