//! Names of scenes, files and inputs that are not there, and results that are not seen.

use std::error::Error;
use std::process::Command;

use crate::flexcrank;

#[test]
fn regress_a_file_with_a_name_that_is_nearly_there_is_suggested() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    for name in ["shaker.toml", "take.mcap"] {
        std::fs::write(folder.path().join(name), "")?;
    }
    for (words, said) in [
        (["check", "shakr.toml"], "error: shakr.toml: not a built-in scene, nor a file; did you mean `shaker.toml`?\n"),
        (["check", "shaker.tom"], "error: shaker.tom: not a built-in scene, nor a file; did you mean `shaker.toml`?\n"),
        (["check", "shaker"], "error: shaker: not a built-in scene, nor a file; did you mean `shaker.toml`?\n"),
        (["info", "taek.mcap"], "error: taek.mcap: No such file or directory (os error 2); did you mean `take.mcap`?\n"),
    ] {
        let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(folder.path()).output()?;
        assert!(!ended.status.success());
        assert_eq!(String::from_utf8(ended.stderr)?, said);
    }
    Ok(())
}

#[test]
fn regress_a_key_of_the_scene_without_its_option_is_told_it() -> Result<(), Box<dyn Error>> {
    for command in ["run", "modes", "trade"] {
        let (code, said) = flexcrank(&[command, "crank-slider", "rod.elements=16"])?;
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains("is changed with --set rod.elements=16"), "{command}: {said}");
    }
    Ok(())
}

#[test]
fn regress_a_torque_on_a_held_crank_names_the_free_one() -> Result<(), Box<dyn Error>> {
    let by_modes = ["--set", "solver.model=modal", "--set", "solver.integrator=esdirk"];
    let beam = [&["response", "thesis-beam", "--crank", "held"][..], &by_modes].concat();
    let slider = ["response", "crank-slider", "--crank", "held"];
    for (words, said) in [
        (&[&slider[..], &["--input", "torque_nm"]].concat(), "no input \"torque_nm\": the crank is held; --crank free has it"),
        (&[&beam[..], &["--input", "torque_nm"]].concat(), "no input \"torque_nm\": the crank is held; --crank free has it"),
    ] {
        assert_eq!(flexcrank(words)?, (Some(2), format!("error: {said}\n")));
    }
    Ok(())
}

#[test]
fn regress_the_scene_of_a_recording_is_printed() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let run =
        |words: &str| Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words.split(' ')).current_dir(folder.path()).output();
    run("run crank-slider --no-bus --pace max --until 0.01 --record take.mcap")?;
    let [printed, built_in] = [run("scenes take.mcap")?, run("scenes crank-slider")?];
    assert!(printed.status.success() && printed.stdout == built_in.stdout, "{}", String::from_utf8_lossy(&printed.stderr));
    Ok(())
}

/// A rod's stress was a ninth of what eight elements show.
#[test]
fn regress_a_sweep_warns_of_links_of_one_element() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    for (elements, warnings) in [(1, 1), (2, 0)] {
        let set = format!("scene = \"crank-slider\"\nset = [\"rod.elements={elements}\"]\nuntil_s = 0.01\nmethod = \"grid\"\n");
        std::fs::write(folder.path().join("s.toml"), set + "[[vary]]\nkey = \"slider.mass_kg\"\nvalues = [0.2]\n")?;
        let ended =
            Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(["sweep", "s.toml"]).current_dir(folder.path()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert!(ended.status.success() && said.matches("warning: rod.elements = 1: ").count() == warnings, "{said}");
    }
    Ok(())
}
