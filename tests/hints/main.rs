//! Hints to what was meant: numbers that look like mistakes, values in two words, names that are nearly there.

mod absent;
mod ends;
mod refused;

use std::error::Error;
use std::process::Command;

use flexcrank::scene::SceneSource;

const SAMPLE: &str = "recordings/sample-three-pulses.mcap";

/// Runs the program in the project's folder; returns exit code and standard error.
fn flexcrank(words: &[&str]) -> Result<(Option<i32>, String), Box<dyn Error>> {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(env!("CARGO_MANIFEST_DIR")).output()?;
    Ok((output.status.code(), String::from_utf8(output.stderr)?))
}

/// Angles in degrees are legal, so that nothing but the warning tells of them.
#[test]
fn regress_a_run_warns_once_of_numbers_that_look_like_mistakes() -> Result<(), Box<dyn Error>> {
    let run = ["run", "--no-bus", "--no-record", "--pace", "max", "--until", "0.2"];
    let degrees = [&run[..], &["--set", "start.angle_rad=180"]].concat();
    let warning = "warning: start.angle_rad = 180 is 28.6 turns: angles are in radians\n";
    let (code, said) = flexcrank(&degrees)?;
    assert!(code == Some(0) && said.starts_with(warning) && said.matches("radians").count() == 1, "{said}");
    assert_eq!(flexcrank(&[&degrees[..], &["-q"]].concat())?, (Some(0), String::new()));
    let (_, said) = flexcrank(&[&degrees[..], &["--count", "3"]].concat())?;
    assert_eq!(said.matches("radians").count(), 1, "{said}");
    let (_, said) = flexcrank(&[&degrees[..], &["crank-slider", "ref-r2s"]].concat())?;
    let named = ["crank-slider", "ref-r2s"].map(|scene| warning.replace("warning: ", &format!("warning: {scene}: ")));
    assert!(said.starts_with(&named.concat()), "{said}");
    let (_, said) = flexcrank(&[&run[..], &["thesis-crank-slider"]].concat())?;
    assert!(said.starts_with("thesis-crank-slider: ") && !said.contains("slender"), "{said}");
    Ok(())
}

/// Sections in mm are legal, so that nothing but the warning tells of them.
#[test]
fn regress_a_campaign_warns_once_of_numbers_that_look_like_mistakes() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let campaign = |name: &str, levels: &str, pulse: &str| -> Result<String, Box<dyn Error>> {
        let path = folder.path().join(name);
        let text = format!(
            "scene = \"thesis-crank-slider\"\nset = [\"start.angle_rad=-90\", \"solver.model=rigid\"]\nuntil_s = 0.2\n\
             method = \"grid\"\n[[vary]]\nkey = \"rod.second_moment_m4\"\n{levels}\n{pulse}"
        );
        std::fs::write(&path, text)?;
        Ok(path.to_str().ok_or("a path that is no text")?.to_owned())
    };
    let angle = "warning: start.angle_rad = -90 is 14.3 turns: angles are in radians\n";
    let section = "warning: the rod is no slender bar: its section is some 34.641 m thick, and it is 1.5 m long: area_m2 is in m², second_moment_m4 in m⁴\n";
    let listed = campaign("listed.toml", "values = [1e-5, 1e-2, 1e-6, 1e-1, 1]", "")?;
    let (code, said) = flexcrank(&["sweep", &listed])?;
    let more = "warning: likewise 2 more values of rod.second_moment_m4\n";
    assert!(code == Some(0) && said.starts_with(&[angle, section, more].concat()), "{said}");
    assert_eq!(flexcrank(&["-q", "sweep", &listed])?, (Some(0), String::new()));
    // The bounds of a range.
    let (code, said) = flexcrank(&["sweep", &campaign("range.toml", "min = 1e-5\nmax = 1e-2\ncount = 2", "")?])?;
    assert!(code == Some(0) && said.starts_with(&[angle, section].concat()), "{said}");
    // A built-in scene with pulses of the campaign is as it was meant.
    let pulse = "[[pulse]]\nstart_s = 0\ntorque_nm = 1\nduration_s = 0.1\n";
    let (_, said) = flexcrank(&["sweep", &campaign("pulse.toml", "values = [1e-5, 1e-6]", pulse)?])?;
    assert!(said.starts_with(angle) && !said.contains("slender"), "{said}");
    Ok(())
}

/// With a scene, which excludes `--resume`, as without one.
#[test]
fn regress_a_time_to_resume_at_without_a_session_is_refused() -> Result<(), Box<dyn Error>> {
    let run = ["run", "--at", "5", "--no-bus", "--no-record", "--pace", "max", "--until", "0.1"];
    let why = "error: --at 5: only a recorded session resumes at a time, with --resume FILE; a scene begins at 0 and ends at \
               --until 5\n";
    for more in [&[][..], &["crank-slider"], &["--count", "2"]] {
        assert_eq!(flexcrank(&[&run[..], more].concat())?, (Some(2), why.to_owned()), "{more:?}");
    }
    Ok(())
}

#[test]
fn regress_a_change_of_the_scene_in_two_words_is_refused_with_its_form() -> Result<(), Box<dyn Error>> {
    let refusal = "error: --set rod.length_m: expected KEY=VALUE, such as slider.mass_kg=0.3\n";
    for command in ["run", "check", "trade", "cycle"] {
        assert_eq!(flexcrank(&[command, "--set", "rod.length_m", "0.3"])?, (Some(2), refusal.to_owned()), "{command}");
    }
    Ok(())
}

#[test]
fn regress_a_misspelt_model_or_integrator_of_trade_has_the_nearest_named() -> Result<(), Box<dyn Error>> {
    for (option, given, nearest) in [
        ("--models", "modl", "modal"),
        ("--models", "fem", "finite-element"),
        ("--integrators", "esdirk,esdrk", "esdirk"),
        ("--integrators", "rk4", "runge-kutta"),
    ] {
        let (code, said) = flexcrank(&["trade", option, given])?;
        assert!(code == Some(2) && said.contains(&format!("; did you mean `{nearest}`?\n")), "{said}");
    }
    Ok(())
}

/// A path is no name of a service; a file beside the program might be.
#[test]
fn regress_a_file_in_place_of_a_service_is_told_its_commands() -> Result<(), Box<dyn Error>> {
    let tip = format!("tip: {SAMPLE} is a recording: `flexcrank replay {SAMPLE}` plays it on the bus, ");
    let (code, said) = flexcrank(&["watch", SAMPLE])?;
    assert!(code == Some(2) && said.contains(&tip), "{said}");
    let folder = tempfile::tempdir()?;
    std::fs::copy(SAMPLE, folder.path().join("take.mcap"))?;
    std::fs::write(folder.path().join("arm.toml"), "[crank]\n")?;
    for (file, hint) in [
        ("take.mcap", "a recording: `flexcrank replay take.mcap` plays it on the bus, `flexcrank plot take.mcap` draws it"),
        ("arm.toml", "a scene: `flexcrank check arm.toml` checks it, `flexcrank run arm.toml` runs it"),
    ] {
        let watch = ["watch", file, "--connect", "tcp/127.0.0.1:9"];
        let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(watch).current_dir(folder.path()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert_eq!((ended.status.code(), said), (Some(2), format!("error: {file}: not a service, but {hint}\n")));
    }
    Ok(())
}

#[test]
fn regress_a_time_to_wait_after_a_space_is_no_name() -> Result<(), Box<dyn Error>> {
    let (code, said) = flexcrank(&["watch", "--wait", "3s", "--connect", "tcp/127.0.0.1:9"])?;
    let hint = "error: `3s` is read as the name of a service: --wait=3s waits that long; ";
    assert!(code == Some(2) && said.starts_with(hint), "{said}");
    Ok(())
}

/// 100 is meant in ms.
#[test]
fn regress_an_added_pulse_that_lasts_long_without_a_unit_is_warned_of() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let warned = "warning: --add-pulse: DURATION 100 has no unit: that is 100 s\n\
                  warning: the pulse added at t = 1 s lasts until t = 101 s, and the recording ends at t = 6 s\n";
    for (pulse, warned) in [("1:0.001:100", warned), ("1:0.001:100ms", ""), ("5.9:0.001:0.1", "")] {
        let path = folder.path().join(format!("{pulse}.mcap"));
        let record = path.to_str().ok_or("a path that is no text")?;
        let ended = flexcrank(&["what-if", SAMPLE, "--add-pulse", pulse, "--record", record])?;
        assert_eq!(ended, (Some(0), warned.to_owned()), "{pulse}");
    }
    Ok(())
}

#[test]
fn regress_a_recording_named_as_another_kind_of_file_is_refused() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let run = ["run", "--no-bus", "--pace", "max", "--until", "0.1", "--record"];
    for words in [&run[..], &["what-if", SAMPLE, "--set", "slider.mass_kg=2", "--record"], &["recover", SAMPLE, "-o"]] {
        for name in ["o1.csv", "o1.PNG"] {
            let path = folder.path().join(name).display().to_string();
            let (code, said) = flexcrank(&[words, &[path.as_str()]].concat())?;
            let refusal = format!("error: {path}: a recording is an MCAP file, named *.mcap; `flexcrank export` ");
            assert!(code == Some(2) && said.starts_with(&refusal), "{words:?}: {said}");
        }
    }
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 0, "no file");
    for name in ["take", "take.1"] {
        let path = folder.path().join(name).display().to_string();
        let (code, said) = flexcrank(&[&run[..], &[path.as_str()]].concat())?;
        assert_eq!(code, Some(0), "{said}");
    }
    Ok(())
}

#[test]
fn regress_a_deflection_without_its_node_is_that_of_the_middle() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let into = folder.path().to_str().ok_or("a path that is no text")?;
    for words in [&["plot", SAMPLE, "-o", into, "--y"][..], &["export", SAMPLE, "--csv", into, "--columns"]] {
        for column in ["links.rod.deflection", "rod.deflection"] {
            let (code, said) = flexcrank(&[words, &[column]].concat())?;
            let refusal = format!("no column `{column}`; did you mean `nodes.rod.2.deflection_m`?\n");
            assert!(code == Some(2) && said.ends_with(&refusal), "{words:?}: {said}");
        }
    }
    Ok(())
}

/// Commands and checkpoints have fields of torque, and columns of text.
#[test]
fn regress_a_wrong_column_has_one_of_samples_named() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let [take, tables, picture] = ["take.mcap", "tables", "y.svg"].map(|name| folder.path().join(name).display().to_string());
    let (code, said) = flexcrank(&["what-if", SAMPLE, "--add-pulse", "1:0.001:100ms", "--record", &take])?;
    assert_eq!(code, Some(0), "{said}");
    let refused = |words: &[&str], refusal: &str| -> Result<(), Box<dyn Error>> {
        let (code, said) = flexcrank(words)?;
        assert!(code == Some(2) && said.ends_with(&format!(": {refusal}\n")), "{words:?}: {said}");
        Ok(())
    };
    let near = |given: &str, column: &str| format!("no column `{given}`; did you mean `{column}`?");
    for (given, column) in [
        ("torque", "driving_torque_nm"),
        ("torque_nm", "driving_torque_nm"),
        ("slider_pin.fx_n", "joints.slider-pin.fx_n"),
        ("slider-pin.fx_N", "joints.slider-pin.fx_n"),
    ] {
        for file in [SAMPLE, take.as_str()] {
            refused(&["plot", file, "--y", given, "-o", &picture], &near(given, column))?;
        }
        // Tables of checkpoints are exported, by the names of their columns.
        if given != "torque_nm" {
            refused(&["export", SAMPLE, "--csv", &tables, "--columns", given], &near(given, column))?;
        }
    }
    for column in ["level", "torque.id", "reply.reason", "reply.accepted"] {
        let refusal = format!("column `{column}` has no numbers to draw");
        refused(&["plot", &take, "--y", column, "-o", &picture], &refusal)?;
    }
    let (_, said) = flexcrank(&["plot", &take, "--y", "xyz", "-o", &picture])?;
    assert!(said.contains("\n  angles: links.") && !said.contains("torque.id"), "{said}");
    Ok(())
}

#[test]
fn regress_a_table_in_brackets_of_a_list_is_refused_as_that() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("scene.toml");
    let file = path.to_str().ok_or("no name")?;
    let text = "[crank]\nlength_m = 0.1\n[rod]\nlength_m = 0.3\n[slider]\n[start]\n[solver]\nmodel = \"rigid\"\n";
    for (line, name) in [(5, "slider"), (6, "start"), (7, "solver"), (3, "rod")] {
        std::fs::write(&path, text.replace(&format!("[{name}]"), &format!("[[{name}]]")))?;
        let (code, said) = flexcrank(&["check", file])?;
        let refusal = format!("scene.toml:{line}: {name}: must be a single table [{name}]\n");
        assert!(code == Some(2) && said.contains(&refusal), "{said}");
    }
    Ok(())
}

/// The scene is sound without the override, and no override removes a table.
#[test]
fn regress_an_override_in_a_table_of_another_mechanism_is_refused_itself() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("boom.toml");
    std::fs::write(
        &path,
        "[beam]\nlength_m = 1.0\nsection = { shape = \"round\", diameter_m = 0.01 }\ndensity_kg_per_m3 = 2700.0\n\
         youngs_modulus_pa = 7e10\n[tip]\nmass_kg = 1.0\n",
    )?;
    let boom = path.to_str().ok_or("no name")?;
    for (scene, given, problem) in [
        (boom, "crank.density_kg_per_m3=7800", "[beam] instead of [crank]; did you mean `beam.density_kg_per_m3`?"),
        (boom, "rod.section.width_m=0.1", "[beam] instead of [rod]; did you mean `beam.section.width_m`?"),
        (boom, "slider.mass_kg=0.3", "[tip] instead of [slider]; did you mean `tip.mass_kg`?"),
        (boom, "slider.resistance_n=3", "[tip] instead of [slider]"),
        (boom, "oscillator.masses_kg=[1]", "[beam] instead of [oscillator]"),
        ("crank-slider", "beam.modes=3", "[crank] and [rod] instead of [beam]; did you mean `crank.modes` or `rod.modes`?"),
        ("crank-slider", "tip.mass_kg=0.3", "[slider] instead of [tip]; did you mean `slider.mass_kg`?"),
        ("crank-slider", "oscillator.masses_kg=[1]", "[crank] instead of [oscillator]"),
        ("thesis-oscillator", "crank.modes=3", "[oscillator] instead of [crank]"),
    ] {
        let said = refusal_of_override(given, &format!("this scene has {problem}"));
        assert_eq!(flexcrank(&["check", scene, "--set", given])?, said);
    }
    for command in [&["run", "--no-bus", "--no-record"][..], &["trade"], &["modes"]] {
        let (_, said) = flexcrank(&[command, &[boom, "--set", "slider.resistance_n=3"]].concat())?;
        assert!(said.contains("--set slider.resistance_n=3: ") && !said.contains("boom.toml"), "{said}");
    }
    Ok(())
}

/// Exit code and message of a command that refuses an override.
fn refusal_of_override(given: &str, problem: &str) -> (Option<i32>, String) {
    (Some(2), format!("error: --set {given}: {}: {problem}\n", given.replacen('=', " = ", 1)))
}

#[test]
fn regress_an_override_that_excludes_a_key_of_the_scene_is_refused_itself() -> Result<(), Box<dyn Error>> {
    let torque = "prescribed motion leaves no room for torque: drop [drive], or [[pulse]] and [torque]";
    let dropped = &format!("{torque}; to drop the torque, set pulse=[] as well");
    let one = "give exactly one of speed_rad_per_s, ramp, table; to replace the motion that the scene has, set drive={…}";
    for (scene, given, problem) in [
        ("thesis-compressor", "torque.constant_nm=2", torque),
        ("thesis-compressor", "drive.ramp.over_s=4", one),
        ("crank-slider", "drive.speed_rad_per_s=3", dropped),
        ("thesis-compressor", "crank.density_kg_per_m3=7800", "give mass_kg, or section and density_kg_per_m3, not both"),
        ("crank-slider", "rod.area_m2=1e-4", "give section, or area_m2 and second_moment_m4, not both"),
    ] {
        assert_eq!(flexcrank(&["check", scene, "--set", given])?, refusal_of_override(given, problem));
    }
    Ok(())
}

#[test]
fn prop_an_override_may_give_an_open_chain_its_end() -> Result<(), Box<dyn Error>> {
    let links = "[crank]\nlength_m = 0.1\nmass_kg = 1.0\n[rod]\nlength_m = 0.3\nmass_kg = 1.0\n[solver]\nmodel = \"rigid\"\n";
    for given in ["slider.mass_kg=0.3", "tip.mass_kg=0.3"] {
        SceneSource::parse("chain.toml", links, &[given.to_owned()])?;
    }
    Ok(())
}

/// A drive that leaves no room for torque, or contradicts the start, is looked at all the same.
#[test]
fn regress_a_contradiction_of_the_drive_hides_no_other_mistake() -> Result<(), Box<dyn Error>> {
    for (given, mistakes) in [
        (
            ["torque.constant_nm=1", "drive={ ramp = { to_rad_per_s = 28.0 } }"],
            ["leaves no room for torque", "missing key `over_s`"],
        ),
        (["pulse.0.torque_nm=1e99", "drive.speed_rad_per_s=3"], ["leaves no room for torque", "pulse.0.torque_nm = 1e99"]),
        (
            ["start.rate_rad_per_s=3", "drive.speed_rad_per_s=1e9"],
            ["contradicts drive.speed_rad_per_s", "a number from -1e6 to 1e6"],
        ),
    ] {
        let (code, said) = flexcrank(&["check", "--set", given[0], "--set", given[1]])?;
        assert!(code == Some(2) && mistakes.iter().all(|mistake| said.contains(mistake)), "{said}");
        // Torque that the command itself gives is not to be dropped by one more change.
        assert_eq!(said.contains("to drop the torque"), given[0].starts_with("start."), "{said}");
    }
    Ok(())
}

/// Bounds were tried in the runs alone.
#[test]
fn regress_a_bound_that_its_key_never_allows_is_warned_of_before() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("bound.toml");
    let axes =
        "[[vary]]\nkey = \"slider.mass_kg\"\nmin = -0.4\nmax = 0.8\n[[vary]]\nkey = \"rod.length_m\"\nmin = 1.0\nmax = 2.0\n";
    let text = format!(
        "scene = \"crank-slider\"\nset = [\"solver.model=rigid\"]\nuntil_s = 0.01\nmethod = \"sobol\"\nsamples = 4\n{axes}"
    );
    std::fs::write(&path, text)?;
    let (code, said) = flexcrank(&["sweep", path.to_str().ok_or("a path that is no text")?])?;
    let warning = "warning: slider.mass_kg = -0.4: must be a number from 0 to 1e9; runs with values that it does not allow will be \
                   refused\n";
    assert!(code == Some(0) && said.starts_with(warning) && said.matches("will be refused").count() == 1, "{said}");
    Ok(())
}

/// An instant is a range, too.
#[test]
fn regress_a_range_that_ends_before_it_begins_is_refused_as_that() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let tables = folder.path().to_str().ok_or("a path that is no text")?;
    let export = |from: &str, to: &str| flexcrank(&["export", SAMPLE, "--csv", tables, "--from", from, "--to", to]);
    assert_eq!(export("5", "2")?, (Some(2), "error: --from 5 must not be after --to 2\n".to_owned()));
    assert_eq!(export("2", "2")?.0, Some(0));
    Ok(())
}

/// The change alone is refused with other mistakes before that.
#[test]
fn prop_a_campaign_names_the_change_that_its_scene_refuses() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("model.toml");
    let set = "set = [\"solver.model=incremental\", \"crank.elements=1\", \"rod.elements=1\"]";
    let axis = "method = \"grid\"\n[[vary]]\nkey = \"slider.mass_kg\"\nvalues = [0.1, 0.2]\n";
    std::fs::write(&path, format!("scene = \"crank-slider\"\n{set}\nuntil_s = 0.01\n{axis}"))?;
    let (code, said) = flexcrank(&["sweep", path.to_str().ok_or("a path that is no text")?])?;
    let refusal = "set \"solver.model=incremental\": solver.integrator = \"esdirk\": incremental goes with two-point only\n";
    assert!(code == Some(2) && said.ends_with(refusal), "{said}");
    Ok(())
}

#[test]
fn regress_an_oscillator_without_levels_is_not_sent_to_trade_which_takes_none() -> Result<(), Box<dyn Error>> {
    for option in [["--overrun", "degrade"], ["--shadow", "best"]] {
        let (code, said) = flexcrank(&[&["run", "thesis-oscillator", "--no-bus", "--no-record"][..], &option].concat())?;
        let way = "needs a scene with [[level]] tables: those of an oscillator are written by hand (`flexcrank guide scenes`)\n";
        assert_eq!((code, said), (Some(2), format!("error: thesis-oscillator: {} {way}", option.join(" "))));
    }
    Ok(())
}

/// The model of oscillators computes no chain.
#[test]
fn regress_models_are_listed_where_they_can_compute_the_scene() -> Result<(), Box<dyn Error>> {
    let models = "one of rigid, incremental, modal, finite-element";
    for given in ["mass-spring", "modl"] {
        let (code, said) = flexcrank(&["trade", "crank-slider", "--models", given])?;
        assert!(code == Some(2) && said.contains(models) && !said.contains("finite-element, mass-spring"), "{said}");
        let (code, said) = flexcrank(&["run", "crank-slider", "--no-bus", "--no-record", "--shadow", given])?;
        assert!(code == Some(2) && said.contains(&format!("--shadow {given}: must be {models}, or best")), "{said}");
    }
    Ok(())
}

#[test]
fn regress_a_scene_in_place_of_a_recording_is_to_be_run_first() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let export = ["export", "--csv", folder.path().to_str().ok_or("a path that is no text")?];
    let resume = ["run", "--no-bus", "--no-record", "--resume"];
    let what_if = ["what-if", "--set", "slider.mass_kg=2"];
    for words in [&["info"][..], &["verify"], &export, &resume, &what_if, &["replay", "--listen", "tcp/127.0.0.1:0"], &["plot"]] {
        let kind = if words[0] == "plot" { "neither a recording nor a table" } else { "not a recording" };
        let hint = format!("error: crank-slider: {kind}, but a built-in scene: run it first, `flexcrank run crank-slider`\n");
        assert_eq!(flexcrank(&[words, &["crank-slider"]].concat())?, (Some(1), hint), "{words:?}");
        let (code, said) = flexcrank(&[words, &["absent.toml"]].concat())?;
        let hint = format!("error: absent.toml: {kind}, but the name of a scene, and there is no such file: ");
        assert!(code == Some(1) && said.starts_with(&hint), "{said}");
    }
    Ok(())
}
