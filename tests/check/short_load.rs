//! Steps that are too long for a short load of the slider.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::Tried;

/// A rigid press under a force that is 0.015 rad wide at half its height, driven at 10 rad/s. The ram's pin carries 80 kN, and what
/// mass and weight add.
const PRESS: &str = r#"
[crank]
length_m = 0.04
rigid = true
mass_kg = 12.0
[rod]
length_m = 0.3
rigid = true
mass_kg = 7.0
[slider]
mass_kg = 25.0
resistance_table = [[0, 0], [6.20, 0], [6.215, 80000], [6.23, 0]]
[drive]
ramp = { to_rad_per_s = 10, over_s = 0.5 }
[solver]
model = "rigid"
integrator = "runge-kutta"
step_s = 0.01
"#;

fn flexcrank(at: &Path, arguments: &[&str]) -> Tried<Output> {
    Ok(Command::new(env!("CARGO_BIN_EXE_flexcrank")).current_dir(at).args(arguments).output()?)
}

fn said(output: &Output) -> Tried<String> {
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    Ok(String::from_utf8(output.stderr.clone())?)
}

/// Every command that takes the scene's step warns, and none once it is short enough.
#[test]
fn regress_a_step_that_jumps_over_a_load_is_warned_of() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("press.toml"), PRESS)?;
    let campaign = "method = 'grid'\nscene = 'press.toml'\nuntil_s = 1.5\n[[vary]]\nkey = 'slider.mass_kg'\nvalues = [20, 25]\n";
    let warning =
        "a step of 0.01 s passes the shortest load of slider.resistance_table, 0.015 rad wide at half its height, in 0.2 steps";
    for (step, warns) in [("0.01", true), ("0.0003", false)] {
        let key = format!("solver.step_s={step}");
        fs::write(at.join(format!("{step}.toml")), format!("set = ['{key}']\n{campaign}"))?;
        let run = ["run", "press.toml", "--set", &key, "--no-bus", "--no-record", "--pace", "max", "--until", "1.5"];
        let sweep = ["sweep", &format!("{step}.toml"), "-o", step];
        for command in [&["check", "press.toml", "--set", &key][..], &run, &sweep] {
            let said = said(&flexcrank(at, command)?)?;
            assert_eq!(said.contains(warning), warns, "{command:?}: {said}");
            assert_eq!(said.contains("the shortest load of"), warns, "{command:?}: {said}");
        }
    }
    Ok(())
}

/// A tenth of the time in which the load is passed: 0.015 rad at 10 rad/s.
#[test]
fn val_the_suggested_step_shows_a_short_load() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("press.toml"), PRESS)?;
    let checked = flexcrank(at, &["check", "press.toml", "--json"])?;
    let checked: serde_json::Value = serde_json::from_slice(&checked.stdout)?;
    assert_eq!(checked["suggested_step_s"], 1e-4);
    let reason = checked["reason"].as_str().unwrap_or_default();
    assert!(reason.starts_with("at least 10 steps in the shortest load of slider.resistance_table (0.0015"), "{reason}");
    Ok(())
}

/// The run of a campaign that is too coarse, by its step and speed together, is named; a base that no run keeps is not looked at.
#[test]
fn regress_the_run_of_a_campaign_that_jumps_over_a_load_is_named() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("press.toml"), PRESS)?;
    let axis = |key: &str, values: &str| format!("[[vary]]\nkey = '{key}'\nvalues = {values}\n");
    let speeds = axis("drive.ramp.to_rad_per_s", "[10, 30]");
    for (name, steps, run) in [("fine", "[5e-5, 1e-4]", None), ("coarse", "[1e-4, 3e-4]", Some(3))] {
        let campaign =
            ["method = 'grid'\nscene = 'press.toml'\nuntil_s = 0.6\n", &axis("solver.step_s", steps), &speeds].concat();
        fs::write(at.join(format!("{name}.toml")), campaign)?;
        let said = said(&flexcrank(at, &["sweep", &format!("{name}.toml")])?)?;
        let named = run.is_some_and(|run| said.contains(&format!("warning: run {run}: a step of 0.0003 s passes")));
        assert_eq!((named, said.contains("the shortest load")), (run.is_some(), run.is_some()), "{said}");
    }
    Ok(())
}

/// A crank that a torque turns from rest has no speed at its start: `check` takes that of its run. One that swings beside the load is not
/// warned of.
#[test]
fn regress_the_speed_is_that_at_which_the_load_is_passed() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    let undriven = PRESS.replace("[drive]\nramp = { to_rad_per_s = 10, over_s = 0.5 }\n", "");
    let turned = undriven.replace("mass_kg = 12.0", "mass_kg = 12.0\ninertia_kg_m2 = 30.0") + "[torque]\nconstant_nm = 200\n";
    let swung = undriven + "[drive]\ntable = [[0, 0.5], [0.5, 1.0], [1.0, 0.5], [1.5, 1.0]]\n";
    for (name, scene, warns) in [("turned", turned, true), ("swung", swung, false)] {
        let file = format!("{name}.toml");
        fs::write(at.join(&file), scene)?;
        let said = said(&flexcrank(at, &["check", &file, "--until", "2"])?)?;
        assert_eq!(said.contains("the shortest load"), warns, "{name}: {said}");
    }
    Ok(())
}

/// How fast a torque turns the crank is known behind the run. One that swings where no load is has none to warn of, however fast.
#[test]
fn regress_a_load_that_a_crank_from_rest_jumped_over_is_warned_of() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    let turning = "[torque]\nconstant_nm = 0.1";
    // It swings about 3.14 rad, to either side by 2 rad at the first.
    let swinging = "[start]\nangle_rad = 5.06\n[gravity]\nx_m_per_s2 = -9.81\ny_m_per_s2 = 0";
    let scene = PRESS.replace("80000", "1000");
    for (name, drive) in [("turning", turning), ("swinging", swinging)] {
        let scene = scene.replace("[drive]\nramp = { to_rad_per_s = 10, over_s = 0.5 }", drive);
        fs::write(at.join(format!("{name}.toml")), scene)?;
    }
    let run = |scenes: &[&str], step: &str| -> Tried<String> {
        let key = format!("solver.step_s={step}");
        let usual = ["--set", &key, "--no-bus", "--no-record", "--pace", "max", "--until", "3"];
        said(&flexcrank(at, &[&["run"], scenes, &usual].concat())?)
    };
    let warning = "warning: the crank passed a load of slider.resistance_table, 0.015 rad wide at half its height, in 0.";
    let said = run(&["turning.toml"], "0.01")?;
    assert!(said.contains(warning), "{said}");
    for (scene, step) in [("turning.toml", "0.0001"), ("swinging.toml", "0.001")] {
        let said = run(&[scene], step)?;
        assert!(!said.contains("slider.resistance_table"), "{scene}: {said}");
    }
    Ok(())
}

/// `run` and `check` name the level whose step is too long, and no level where it is the scene's own; `sweep` runs no levels.
#[test]
fn regress_the_level_whose_step_jumps_over_a_load_is_named() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    let campaign = "method = 'grid'\nscene = 'press.toml'\nuntil_s = 0.6\n[[vary]]\nkey = 'slider.mass_kg'\nvalues = [20, 25]\n";
    fs::write(at.join("sweep.toml"), campaign)?;
    let levels =
        |step: &str| format!("[[level]]\nname = 'fine'\n[[level]]\nname = 'cheap'\nchanges = ['solver.step_s={step}']\n");
    let run = ["run", "press.toml", "--no-bus", "--no-record", "--pace", "max", "--until", "0.6"];
    let missed = "passes the shortest load of slider.resistance_table";
    for (own, cheap, warning) in [
        ("0.0001", "0.0002", None),
        ("0.0001", "0.002", Some(format!("level `cheap`: a step of 0.002 s {missed}"))),
        ("0.002", "0.002", Some(format!(" a step of 0.002 s {missed}"))),
        ("0.002", "0.001", Some(format!(" a step of 0.002 s {missed}"))),
    ] {
        let scene = PRESS.replace("step_s = 0.01", &format!("step_s = {own}")) + &levels(cheap);
        fs::write(at.join("press.toml"), scene)?;
        for command in [&run[..], &["check", "press.toml", "--until", "1.5"]] {
            let said = said(&flexcrank(at, command)?)?;
            let named = warning.as_ref().is_some_and(|warning| said.contains(&warning[..]));
            assert_eq!((named, said.contains(missed)), (warning.is_some(), warning.is_some()), "{own}, {cheap}: {said}");
            assert_eq!(said.contains("level `"), own == "0.0001" && cheap == "0.002", "{own}, {cheap}: {said}");
        }
        let said = said(&flexcrank(at, &["sweep", "sweep.toml", "-o", &[own, cheap].join("-")])?)?;
        assert_eq!((said.contains(missed), said.contains("level `")), (own == "0.002", false), "{own}, {cheap}: {said}");
    }
    Ok(())
}

/// Errors are compared between steps, where a load that all jump over is not seen.
#[test]
fn regress_a_chosen_step_that_jumps_over_a_load_is_warned_of() -> Tried<()> {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("press.toml"), PRESS)?;
    // The levels of the scene are not chosen.
    let levels = "[[level]]\nname = 'fine'\n[[level]]\nname = 'cheap'\nchanges = ['solver.step_s=0.02']\n";
    fs::write(at.join("press.toml"), PRESS.to_owned() + levels)?;
    for (step, warns) in [("5e-3", true), ("2e-4", false)] {
        let rigid = ["--models", "rigid", "--integrators", "runge-kutta", "--tolerance", "0.5", "--until", "1", "--budget", "10"];
        let said = said(&flexcrank(at, &[&["trade", "press.toml", "--steps", step], &rigid[..]].concat())?)?;
        let warning = "a step of 0.005 s passes the shortest load of slider.resistance_table";
        assert_eq!((said.contains(warning), said.contains("the shortest load")), (warns, warns), "{step}: {said}");
        assert!(!said.contains("level `"), "{step}: {said}");
    }
    Ok(())
}
