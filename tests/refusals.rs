//! Refusals: each names the problem and a remedy, and its exit code shows whose fault it is.

use std::error::Error;
use std::process::Command;

const SAMPLE: &str = "recordings/sample-three-pulses.mcap";
/// An endpoint apart from the local services.
const ALONE: &str = "tcp/127.0.0.1:0";

/// Runs the program in the project's folder; returns exit code, standard output and standard error.
fn flexcrank(words: &[&str]) -> Result<(Option<i32>, String, String), Box<dyn Error>> {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(env!("CARGO_MANIFEST_DIR")).output()?;
    Ok((output.status.code(), String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?))
}

fn refused(words: &[&str], code: i32, why: &[&str]) -> Result<(), Box<dyn Error>> {
    let (ended, _, said) = flexcrank(words)?;
    assert_eq!(ended, Some(code), "{words:?}: {said}");
    for part in why {
        assert!(said.contains(part), "{words:?}: {part} in {said}");
    }
    Ok(())
}

#[test]
fn regress_invalid_addresses() -> Result<(), Box<dyn Error>> {
    let usual = "tcp/127.0.0.1:7447";
    refused(&["run", "--listen", "nonsense"], 2, &["'nonsense' for '--listen", usual])?;
    refused(&["watch", "--connect", "foo"], 2, &["'foo' for '--connect", usual])?;
    refused(&["run", "--listen", "tcp/127.0.0.1:99999"], 2, &["99999 is not a port", usual])?;
    refused(&["run", "--listen", "pigeon/loft:1"], 2, &["the protocol pigeon is not supported", usual])?;
    refused(&["run", "--zenoh-config", "nosuch.json5"], 2, &["--zenoh-config nosuch.json5: No such file"])?;
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("zenoh.json5");
    let path = file.to_str().ok_or("a path that is no text")?;
    for (text, why) in [
        ("{\n listen: { endpoints: ['nonsense'] } }", ": line 2: Endpoints must be"),
        ("{ lisen: 3 }", ": line 1: unknown field `lisen`"),
    ] {
        std::fs::write(&file, text)?;
        refused(&["run", "--zenoh-config", path], 2, &[path, why])?;
    }
    Ok(())
}

#[test]
fn regress_names_that_nothing_has() -> Result<(), Box<dyn Error>> {
    refused(&["stability", "crank-slider", "--only", "nosuch"], 2, &["`nosuch`", "stiffness-modal", "revolutions"])?;
    refused(&["stability", "crank-slider", "--only", "stifness-modal"], 2, &["did you mean `stiffness-modal`?"])?;
    refused(&["guide", "buss"], 2, &["did you mean `bus`?"])?;
    refused(
        &["replay", SAMPLE, "--remap", "nosuch:=other", "--listen", ALONE],
        2,
        &["no topic `nosuch`", "flexcrank/crank/angles"],
    )
}

#[test]
fn prop_an_unstable_weight_is_warned_of() -> Result<(), Box<dyn Error>> {
    let run = |weight: &str| {
        let given =
            ["run", "thesis-two-masses", "--set", weight, "--until", "0.01", "--pace", "max", "--no-record", "--listen", ALONE];
        flexcrank(&given).map(|(_, _, said)| said)
    };
    assert!(run("solver.weight=0.3")?.contains("two-point is unstable below 0.5"));
    assert!(!run("solver.weight=0.5")?.contains("unstable"));
    Ok(())
}

#[test]
fn regress_files_for_folders_and_folders_for_files() -> Result<(), Box<dyn Error>> {
    refused(&["verify", "src"], 1, &["src: is a folder"])?;
    refused(&["replay", "src"], 1, &["src: is a folder"])?;
    refused(&["export", SAMPLE, "--csv", "README.md"], 1, &["README.md: is a file"])?;
    refused(&["stability", "--csv", "README.md"], 1, &["README.md: is a file"])?;
    refused(&["trade", "--tolerance", "1e-2", "--write", "README.md"], 1, &["README.md: exists already"])?;
    let (code, _, said) = flexcrank(&["run", "src"])?;
    assert!(code == Some(2) && said.starts_with("error: src: cannot be read: ") && !said.contains("did you mean"), "{said}");
    Ok(())
}

#[test]
fn regress_a_file_that_is_no_recording_is_said_to_be_none() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("whole.mcap");
    let out = out.to_str().ok_or("a path that is no text")?;
    let none = &["README.md: not an MCAP file"];
    refused(&["verify", "README.md"], 1, none)?;
    refused(&["info", "README.md"], 1, none)?;
    refused(&["replay", "README.md"], 1, none)?;
    refused(&["export", "README.md", "--csv", "tables"], 1, none)?;
    refused(&["recover", "README.md", "-o", out], 1, none)?;
    refused(&["what-if", "README.md", "--add-pulse", "1:1:1", "--record", out], 1, none)?;
    refused(&["run", "--resume", "README.md", "--no-record"], 1, none)
}

#[test]
fn regress_a_scene_in_place_of_a_recording_is_told_its_commands() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let [scene, out] = ["mine.toml", "out"].map(|name| folder.path().join(name).display().to_string());
    std::fs::write(&scene, flexcrank(&["scenes", "crank-slider"])?.1.replace("[crank]", "[crank] # steel"))?;
    let hint = format!(", but a scene: `flexcrank check {scene}` checks it, `flexcrank run {scene}` runs it");
    for command in ["info", "verify", "replay", "plot"] {
        refused(&[command, &scene], 1, &[&hint])?;
    }
    refused(&["recover", &scene, "-o", &out], 1, &[&hint])?;
    refused(&["run", "--no-record", "--resume", &scene], 1, &[&hint])?;
    refused(&["export", &scene, "--csv", &out], 1, &["mine.toml: not an MCAP file", &hint])
}

#[test]
fn regress_decimal_commas_and_units_of_angles_are_refused_with_a_remedy() -> Result<(), Box<dyn Error>> {
    let point = "a number has a decimal point, not a comma: ";
    refused(&["run", "--until", "1,5"], 2, &[&format!("tip: {point}1.5")])?;
    refused(&["run", "--set", "crank.length_m=0,15"], 2, &[&format!("{point}0.15")])?;
    refused(&["modes", &format!("{SAMPLE}@0,5")], 2, &[&format!("{point}0.5")])?;
    refused(&["linearise", "--angle", "57deg"], 2, &["a number of degrees without its unit, such as 57"])?;
    refused(&["modes", "--angle", "57deg"], 2, &["degrees without their unit: a number, or FROM:TO:STEP"])
}

#[test]
fn regress_incomplete_arguments() -> Result<(), Box<dyn Error>> {
    refused(&["run", "--set", "pulse=[{"], 2, &["--set pulse=[{: not TOML: "])?;
    refused(&["run", "--set", "rod.length_m=1.2m"], 2, &["--set rod.length_m=1.2m: not TOML: "])?;
    refused(&["run", "--set", "solver.model=modla"], 2, &["did you mean \"modal\"?"])?;
    refused(&["pulse", "crank"], 2, &["--torque <NM>|--from <FILE>", "--torque <NM> --duration <TIME> [NAME]"])?;
    refused(&["pulse", "crank", "--torque", "1"], 2, &["--duration <TIME>"])?;
    refused(&["watch", "crank", "--plain", "--torque", "1"], 2, &["cannot be used with", "--torque"])?;
    refused(&["watch", "crank", "--json", "--torque", "1"], 2, &["cannot be used with", "--torque"])?;
    refused(&["what-if", SAMPLE], 2, &["--add-pulse <START:TORQUE:DURATION>|--set <KEY=VALUE>"])?;
    refused(&["what-if", SAMPLE, "--add-pulse", "1:1"], 2, &["three numbers START:TORQUE:DURATION"])
}

#[test]
fn regress_a_word_in_the_wrong_place_is_told_from_a_right_one() -> Result<(), Box<dyn Error>> {
    refused(&["control", "crank", "bogus"], 2, &["the commands are pause, resume, step, reset, stop, start-recording,"])?;
    refused(&["bogus"], 2, &["the commands are run, replay, what-if,"])?;
    refused(&["help", "bogus"], 2, &["the commands are run, replay,"])?;
    refused(&["mine.toml"], 2, &["flexcrank run mine.toml"])?;
    refused(&["--until", "1"], 2, &["flexcrank run --until"])?;
    refused(&["run", "--set", "solver.step_s=1ms"], 2, &["`1ms`: write the number alone, as its key names the unit"])?;
    refused(&["run", "--set", "rod.length_m="], 2, &["--set rod.length_m=: expected KEY=VALUE: the value is missing"])?;
    refused(&["run", "--set", "pulse.1={start_s=1}"], 2, &["`pulse` has entries 0 to 0, and none numbered 1"])?;
    refused(&["cycle", "--csv", "none/cycle.csv"], 1, &["none/cycle.csv: the folder none does not exist"])?;
    refused(&["cycle", "--csv", "src"], 1, &["src: is a folder, not a file"])?;
    refused(&["cycle", "--csv", "README.md/cycle.csv"], 1, &["README.md is a file, not a folder"])?;
    refused(&["check", "src"], 2, &["src: cannot be read: is a folder, not a file"])?;
    refused(&["what-if", SAMPLE, "--add-pulse", "99:5:0.1"], 2, &["which ends at", "choose an earlier instant"])?;
    refused(&["what-if", SAMPLE, "--set", "solver.integrator=runge-kutta"], 2, &["beyond the stability limit"])?;
    refused(&["modes", &format!("{SAMPLE}@99")], 2, &["which ends at", "choose an earlier instant"])?;
    refused(&["control", "crank", "set", "slider.mass_kg"], 2, &["KEY=VALUE, such as slider.mass_kg=0.3"])?;
    refused(&["control", "crank", "set", "slider.mass_kg="], 2, &["KEY=VALUE, such as slider.mass_kg=0.3"])?;
    refused(&["control", "crank", "paus"], 2, &["a similar subcommand exists: 'pause'"])?;
    refused(&["modes", &format!("{SAMPLE}@abc")], 2, &["`abc` after the @ is not a time from 0", "200ms"])?;
    let folder = tempfile::tempdir()?;
    let scene = folder.path().join("mine.toml");
    std::fs::write(&scene, flexcrank(&["scenes", "crank-slider"])?.1)?;
    refused(&["sweep", scene.to_str().ok_or("a path that is no text")?], 2, &["mine.toml: is a scene, not a campaign"])
}

#[test]
fn regress_output_that_cannot_be_printed_is_a_failure_of_standard_output() -> Result<(), Box<dyn Error>> {
    for words in [["trade", "--help"].as_slice(), &["--version"], &["scenes"], &["info", SAMPLE], &["verify", SAMPLE]] {
        let full = std::fs::File::options().write(true).open("/dev/full")?;
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        let output = command.args(words).stdout(full).output()?;
        let said = String::from_utf8(output.stderr)?;
        let named = said.starts_with("error: standard output: No space left");
        assert!(output.status.code() == Some(1) && named, "{words:?}: {said}");
    }
    Ok(())
}

#[test]
fn prop_a_step_that_resolves_nothing_is_warned_of() -> Result<(), Box<dyn Error>> {
    let check = |step: &str| flexcrank(&["check", "crank-slider", "--set", step]).map(|(code, _, said)| (code, said));
    let (code, said) = check("solver.step_s=0.05")?;
    assert!(code == Some(6) && said.contains(" s: a vibration of that frequency comes out wrong"), "{code:?} {said}");
    assert_eq!(check("solver.step_s=0.005")?, (Some(0), String::new()));
    Ok(())
}

#[test]
fn regress_a_what_if_with_a_step_that_is_too_long_is_not_trusted() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("coarse.mcap");
    let path = file.to_str().ok_or("a path that is no text")?;
    let (code, out, said) = flexcrank(&["what-if", SAMPLE, "--set", "solver.step_s=0.1", "--record", path])?;
    assert!(code == Some(6) && said.contains("warning: not to be trusted: the energy balance"), "{code:?} {out} {said}");
    let (code, out, _) = flexcrank(&["check", "crank-slider", "--set", "solver.step_s=0.5"])?;
    assert_eq!(code == Some(4), out.starts_with("crank-slider: valid, but it diverges"), "{code:?} {out}");
    Ok(())
}

#[test]
fn prop_responses_are_drawn_by_unit() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let plots = folder.path().join("plots");
    let path = plots.to_str().ok_or("a path that is no text")?;
    let (code, _, said) = flexcrank(&["response", "crank-slider", "--angle", "57", "--plot", path])?;
    assert_eq!(code, Some(0), "{said}");
    for (name, wanted) in [
        ("frequency", ["angle (rad per N·m)", "magnitude (m per N·m)", "phase (°)", ">slider<"]),
        ("step", ["(rad)", "(m)", "time (s)", "by 1 N·m"]),
    ] {
        let svg = std::fs::read_to_string(plots.join(format!("{name}-response.svg")))?;
        wanted.iter().for_each(|wanted| assert!(svg.contains(wanted), "{name}: {wanted}"));
    }
    Ok(())
}

#[test]
fn regress_a_quantity_that_a_change_leaves_alone_is_the_same() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let record = folder.path().join("same.mcap");
    let path = record.to_str().ok_or("a path that is no text")?;
    let (code, out, _) = flexcrank(&["what-if", SAMPLE, "--set", "slider.mass_kg=2", "--record", path])?;
    let told = |quantity: &str| out.lines().find(|line| line.trim_start().starts_with(quantity)).unwrap_or_default();
    assert!(code == Some(0) && told("crank angle, rad").contains("differs by at most"), "{out}");
    assert!(told("driving torque, N·m").ends_with("is the same"), "{out}");
    Ok(())
}

#[test]
fn regress_numbers_and_times_are_refused_in_words() -> Result<(), Box<dyn Error>> {
    let time = "in seconds or with a unit: 10, 0.5, 200ms, 10min";
    refused(&["run", "--until", "nan"], 2, &["a time from 1ns to 1e9 s", time])?;
    refused(&["run", "--flush", "2h"], 2, &["a time from 1ms to 1h", time])?;
    refused(&["replay", SAMPLE, "--delay", "soon"], 2, &["a time from 0 to 1e9 s", time])?;
    refused(&["pulse", "--torque", "5Nm", "--duration", "1"], 2, &["a number in N·m without its unit"])?;
    refused(&["control", "crank", "step", "-5"], 2, &["a whole number from 1"])?;
    refused(&["stability", "crank-slider", "--jobs", "0"], 2, &["a whole number from 1"])?;
    refused(&["run", "--count", "many"], 2, &["a whole number from 1 to 999"])?;
    refused(&["replay", SAMPLE, "--wait-for", "x"], 2, &["a whole number"])?;
    refused(&["run", "--set", "rod.length_m=\"80 mm\""], 2, &["rod.length_m = \"80 mm\": must be a number without its unit"])?;
    refused(&["run", "--shadow", "modl"], 2, &["error: --shadow modl: must be one of rigid", "did you mean `modal`?"])?;
    refused(&["run", "--shadow", "best"], 2, &["--shadow best needs a scene with [[level]] tables"])?;
    let (_, _, said) = flexcrank(&["run", "--shadow", "foo"])?;
    assert!(!said.contains("--set"), "{said}");
    Ok(())
}

#[test]
fn regress_a_wrong_column_lists_the_columns_of_each_topic() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let into = folder.path().to_str().ok_or("a path that is no text")?;
    for words in [&["export", SAMPLE, "--csv", into, "--columns", "xyz"][..], &["plot", SAMPLE, "--y", "xyz", "-o", into]] {
        refused(words, 2, &["no column `xyz`; there are", ", links.crank.chord_rad, ", "\n  loads: driving_torque_nm"])?;
        let (_, _, said) = flexcrank(words)?;
        assert!(said.len() < 4000 && !said.contains("log_time"), "{} characters: {said}", said.len());
    }
    refused(&["plot", SAMPLE, "--y", "links.crank.turn", "-o", into], 2, &["no column `links.crank.turn`; there are\n"])?;
    refused(&["plot", SAMPLE, "--y", "driving_torque", "-o", into], 2, &["did you mean `driving_torque_nm`?"])
}

#[test]
fn regress_a_port_in_use_and_tls_without_tls_name_the_remedy() -> Result<(), Box<dyn Error>> {
    let taken = std::net::TcpListener::bind("127.0.0.1:0")?;
    let endpoint = format!("tcp/{}", taken.local_addr()?);
    let run = ["run", "--no-record", "--until", "0.1", "--listen", &endpoint];
    refused(&run, 1, &[&format!("cannot listen on {endpoint}: another program has the port"), "or port 0 for any free one"])?;
    if cfg!(feature = "tls") {
        return Ok(());
    }
    for command in [&["run", "--no-record"][..], &["list"]] {
        let words =
            [command, &["--zenoh-config", if command.len() > 1 { "src/files/gate.json5" } else { "src/files/member.json5" }]];
        refused(&words.concat(), 2, &["this build has no TLS", "`--features tls`"])?;
    }
    Ok(())
}

#[test]
fn regress_places_that_cannot_be_written_are_refused_before_the_work() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let absent = folder.path().join("absent/x.mcap");
    let path = absent.to_str().ok_or("a path that is no text")?;
    refused(&["run", "--no-bus", "--until", "1", "--record", path], 1, &["absent does not exist"])?;
    refused(&["what-if", SAMPLE, "--add-pulse", "1:1:1", "--record", path], 1, &["absent does not exist"])?;
    refused(&["trade", "--csv", path], 1, &["absent does not exist"])?;
    refused(&["trade", "--plot", &path.replace(".mcap", ".svg")], 1, &["absent does not exist"])?;
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 0, "nothing is created");
    Ok(())
}

#[test]
fn regress_a_scene_that_cannot_start_names_file_line_and_key() -> Result<(), Box<dyn Error>> {
    let step = ["run", "--set", "solver.integrator=runge-kutta", "--set", "solver.step_s=0.1"];
    refused(&step, 2, &["crank-slider:", "solver.step_s = 0.1: the modal model cannot compute this scene"])
}

#[test]
fn regress_one_picture_of_several_files_needs_overlay() -> Result<(), Box<dyn Error>> {
    let words = ["plot", SAMPLE, SAMPLE, "--y", "driving_torque_nm", "-o", "two.svg"];
    refused(&["setpoint", "crank", "--torque", "1", "--hold", "1h"], 2, &["a time from 1us to 60s"])?;
    refused(&words, 2, &["would hold 2 figures", "lay the files over one another with --overlay"])
}

#[test]
fn regress_a_spare_needs_levels_deadlines_and_one_service() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("levels.toml");
    let (_, text, _) = flexcrank(&["scenes", "crank-slider"])?;
    std::fs::write(&file, text + "\n[[level]]\nname = \"good\"\n[[level]]\nname = \"rough\"\nchanges = [\"rod.rigid=true\"]\n")?;
    let scene = file.to_str().ok_or("a path that is no text")?;
    let run = |scene: &str, more: &[&str], why: &str| {
        refused(&[&["run", scene, "--spare", "--no-bus", "--no-record", "--until", "0.1"], more].concat(), 2, &[why])
    };
    run(scene, &[], "it needs --overrun degrade")?;
    run(scene, &["--overrun", "degrade", "--pace", "max"], "--pace max has none")?;
    refused(&["run", scene, "--overrun", "degrade", "--pace", "lockstep", "--listen", ALONE], 2, &["--pace lockstep has none"])?;
    run(scene, &["--overrun", "degrade", "--count", "2"], "run one service")?;
    run("crank-slider", &["--overrun", "degrade"], "needs a scene with [[level]] tables")
}

#[test]
fn regress_a_session_that_is_past_its_end_is_not_resumed() -> Result<(), Box<dyn Error>> {
    let words = ["run", "--no-bus", "--no-record", "--resume", SAMPLE, "--until", "5"];
    refused(&words, 2, &["--until 5 is over already: the session goes on from t = 6 s"])
}

#[test]
fn regress_a_run_shorter_than_one_step_is_refused() -> Result<(), Box<dyn Error>> {
    let until = |until| ["run", "--set", "solver.step_s=10", "--until", until, "--pace", "max", "--no-bus", "--no-record"];
    refused(&until("1"), 2, &["--until 1: the run would last 1 s, less than one step of 10 s"])?;
    let (code, _, said) = flexcrank(&until("10"))?;
    assert!(code != Some(2) && !said.contains("would last"), "one step is enough: {said}");
    let resumed = ["run", "--resume", SAMPLE, "--until", "6.001", "--no-bus", "--no-record"];
    refused(&resumed, 2, &["--until 6.001: the run would last 0.001 s, less than one step of 0.002 s"])
}

#[test]
fn val_exit_codes_of_runs_that_end_badly() -> Result<(), Box<dyn Error>> {
    let run = ["run", "--no-bus", "--no-record", "--no-realtime"];
    let run = |more: &[&str], code, why: &str| refused(&[&run, more].concat(), code, &[why]);
    run(&["--pace", "max", "--until", "5", "--set", "pulse.0.torque_nm=1e9"], 4, "error: diverged in step")?;
    run(&["--pace", "1e6", "--until", "100", "--overrun", "stop"], 5, "missed its deadline")?;
    run(&["--pace", "max", "--until", "100", "--set", "solver.step_s=0.1"], 6, "warning: not to be trusted")
}

/// A recording of a run that is not to be trusted is what that run computed, and says so.
#[test]
fn regress_a_recording_of_an_unbalanced_run_says_so() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let within = |words: &[&str]| Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(folder.path()).output();
    let run = ["run", "--no-bus", "--no-realtime", "--record", "off.mcap", "--pace", "max", "--until", "100"];
    let ended = within(&[&run[..], &["--set", "solver.step_s=0.1"]].concat())?;
    assert_eq!(ended.status.code(), Some(6), "{}", String::from_utf8_lossy(&ended.stderr));
    let verified = within(&["verify", "off.mcap"])?;
    let said = String::from_utf8(verified.stdout)?;
    assert!(verified.status.code() == Some(0) && said.contains("not to be trusted"), "{said}");
    Ok(())
}

#[test]
fn regress_recordings_that_cannot_be_written_name_the_options() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("recordings"), "a file")?;
    let run = ["run", "--no-bus", "--pace", "max", "--until", "0.1"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(run).current_dir(folder.path()).output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert!(ended.status.code() == Some(1) && said.contains("--record, or not at all with --no-record"), "{said}");
    Ok(())
}

#[test]
fn regress_completions_know_scenes_and_recordings() -> Result<(), Box<dyn Error>> {
    let (code, script, _) = flexcrank(&["completions", "bash"])?;
    assert!(code == Some(0) && script.contains("FLEXCRANK_COMPLETE"), "{script}");
    let complete = |words: &[&str]| -> Result<String, Box<dyn Error>> {
        let output = Command::new(env!("CARGO_BIN_EXE_flexcrank"))
            .args(["--", "flexcrank"])
            .args(words)
            .envs([("FLEXCRANK_COMPLETE", "bash"), ("_CLAP_IFS", "\n"), ("_CLAP_COMPLETE_INDEX", &words.len().to_string())])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()?;
        Ok(String::from_utf8(output.stdout)?)
    };
    assert!(complete(&["check", "ref-"])?.lines().any(|line| line == "ref-r2s"), "{}", complete(&["check", "ref-"])?);
    assert!(complete(&["verify", "recordings/sample-tr"])?.contains("recordings/sample-truncated.mcap"));
    assert!(complete(&["run", "--shadow", "fin"])?.contains("finite-element"));
    Ok(())
}

#[test]
fn regress_steps_of_fixed_cost() -> Result<(), Box<dyn Error>> {
    fn run<'a>(words: &[&'a str]) -> Vec<&'a str> {
        [&["run", "--no-bus", "--no-record", "--pace", "max", "--until", "0.1", "--fixed-cost"], words].concat()
    }
    refused(&run(&["--set", "solver.corrections=2"]), 2, &["--fixed-cost: crank-slider: the scene names solver.corrections"])?;
    refused(&run(&["--set", "level=[{ name = \"one\" }]"]), 2, &["--fixed-cost: crank-slider: the scene has [[level]] tables"])?;
    refused(&run(&["--set", "solver.integrator=runge-kutta"]), 2, &["solver.step_s", "beyond the stability limit"])?;
    refused(&["run", "--resume", SAMPLE, "--fixed-cost"], 2, &["--fixed-cost", "--resume"])?;
    let (ended, _, said) = flexcrank(&run(&[]))?;
    assert_eq!(ended, Some(0), "{said}");
    assert!(said.contains("fixed cost: 3 corrections a stage, adds ") && said.contains(" rad to an error of "), "{said}");
    let (ended, _, said) = flexcrank(&run(&["--shadow", "rigid"]))?;
    assert!(ended == Some(0) && said.contains("nobody sees the difference that --shadow computes"), "{said}");
    refused(&run(&["--set", "pulse=[]"]), 2, &["--fixed-cost: crank-slider: nothing moves in this scene within 2 s, which any"])
}
