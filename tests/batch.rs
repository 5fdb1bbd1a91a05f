//! The program in scripts: many runs at once, runs without a bus, interruptions, readers that go away, files cut off anywhere.

use std::error::Error;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use flexcrank::recording::Messages;
use rustix::process::{Pid, Signal, kill_process};

type Tried = Result<(), Box<dyn Error>>;

const WHOLE: &str = "recordings/sample-three-pulses.mcap";
const TRUNCATED: &str = "recordings/sample-truncated.mcap";

fn flexcrank(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Starts runs at the same instant, and checks that all succeed.
fn together(runs: impl Iterator<Item = Vec<String>>) -> Tried {
    let start = |arguments: Vec<String>| flexcrank(&arguments.iter().map(String::as_str).collect::<Vec<_>>()).spawn();
    let children: Vec<Child> = runs.map(start).collect::<Result<_, _>>()?;
    for child in children {
        let ended = child.wait_with_output()?;
        assert!(ended.status.success(), "{:?}: {}", ended.status, String::from_utf8_lossy(&ended.stderr));
    }
    Ok(())
}

const SHORT: [&str; 6] = ["run", "--pace", "max", "--until", "0.5", "--no-record"];

#[test]
fn prop_services_that_start_together_find_ports() -> Tried {
    let named = |n: i32| SHORT.into_iter().map(str::to_owned).chain(["--name".to_owned(), format!("together-{n}")]).collect();
    together((0..12).map(named))
}

/// Recordings without a name given, all begun in one folder at the same instant: each has a file of its own. What-ifs likewise.
#[test]
fn regress_recordings_that_start_together_have_names_of_their_own() -> Tried {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    let run = ["run", "--no-bus", "--pace", "max", "--until", "0.5"];
    let what_if = ["what-if", "take.mcap", "--add-pulse", "0.2:5:0.1"];
    std::fs::copy(WHOLE, at.join("take.mcap"))?;
    for words in [&run[..], &what_if] {
        let start = |_| flexcrank(words).current_dir(at).spawn();
        let children: Vec<Child> = (0..12).map(start).collect::<Result<_, _>>()?;
        for child in children {
            let ended = child.wait_with_output()?;
            assert!(ended.status.success(), "{words:?}: {}", String::from_utf8_lossy(&ended.stderr));
        }
    }
    assert_eq!(std::fs::read_dir(at.join("recordings"))?.count(), 24);
    Ok(())
}

/// Runs of one service without a name given, all started at the same instant, three times six of them.
#[test]
fn regress_runs_that_start_together_number_the_default_name() -> Tried {
    for _ in 0..3 {
        let start = |_| flexcrank(&["run", "--pace", "20", "--until", "20", "--no-record"]).spawn();
        let children: Vec<Child> = (0..6).map(start).collect::<Result<_, _>>()?;
        let mut names = Vec::new();
        for child in children {
            let ended = child.wait_with_output()?;
            let said = String::from_utf8(ended.stderr)?;
            // A busy machine may lose samples of six runs at twenty times real time, which is said, and is not asked here.
            let is_told = ended.status.code() == Some(3) && said.contains("dropped because bus or disk could not keep up");
            assert!(ended.status.success() || is_told, "{:?}: {said}", ended.status);
            let named = said.split_once("on the bus as flexcrank/").and_then(|(_, rest)| rest.split_once(" at tcp/127.0.0.1:"));
            let (name, rest) = named.ok_or_else(|| format!("no name and endpoint in {said}"))?;
            let port = rest.split(';').next().unwrap_or_default();
            assert!(name.starts_with("crank") && port.parse::<u16>().is_ok(), "{said}");
            names.push(name.to_owned());
        }
        names.sort();
        names.dedup();
        assert_eq!(names.len(), 6, "{names:?}");
    }
    Ok(())
}

#[test]
fn regress_a_given_name_that_is_taken_is_refused() -> Tried {
    let arguments = ["run", "--no-record", "--name", "taken-once"];
    let mut first = flexcrank(&arguments).spawn()?;
    let lines = std::io::BufReader::new(first.stderr.take().ok_or("no standard error")?);
    let line = std::io::BufRead::lines(lines).map_while(Result::ok).find(|line| line.contains("on the bus")).unwrap_or_default();
    let second = flexcrank(&arguments).output()?;
    kill_process(Pid::from_raw(i32::try_from(first.id())?).ok_or("no process id")?, Signal::INT)?;
    first.wait()?;
    let said = String::from_utf8(second.stderr)?;
    assert!(line.contains("flexcrank/taken-once at tcp/"), "{line}");
    assert!(second.status.code() == Some(1) && said.contains("a service named `taken-once` is running already"), "{said}");
    Ok(())
}

#[test]
fn prop_a_replay_names_its_endpoint() -> Tried {
    let replay = ["replay", WHOLE, "--rate", "1000", "--name", "shown-at", "--listen", "tcp/127.0.0.1:0"];
    let ended = flexcrank(&replay).output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert!(said.contains(&format!("replaying {WHOLE} on the bus as flexcrank/shown-at at tcp/127.0.0.1:")), "{said}");
    assert!(ended.status.success() && !said.contains("127.0.0.1:0\n"), "{said}");
    Ok(())
}

#[test]
fn regress_lines_on_standard_error_are_json_if_the_log_is() -> Tried {
    let json = |arguments: &[&str]| -> Result<Vec<serde_json::Value>, Box<dyn Error>> {
        let ended = flexcrank(&[&["--log-format", "json"], arguments].concat()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        said.lines().map(|line| serde_json::from_str(line).map_err(|error| format!("{line}: {error}").into())).collect()
    };
    let lines = json(&["run", "--no-bus", "--no-record", "--pace", "max", "--until", "0.1"])?;
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(lines[0]["fields"]["message"].as_str().is_some_and(|text| text.starts_with("crank-slider: modal model")));
    assert!(lines.iter().all(|line| line["level"] == "INFO" && line["timestamp"].is_string()), "{lines:?}");
    let lines = json(&["run", "nosuch"])?;
    assert!(lines.len() == 1 && lines[0]["level"] == "ERROR", "{lines:?}");
    assert!(lines[0]["fields"]["message"].as_str().is_some_and(|text| text.starts_with("nosuch")), "{lines:?}");
    Ok(())
}

#[test]
fn regress_a_run_that_ends_badly_names_a_remedy_and_says_nothing_twice() -> Tried {
    let run = ["run", "--no-bus", "--no-record", "--no-realtime", "--pace", "max"];
    let [untrusted, both, of_first_order] = [
        "\nnot to be trusted: `flexcrank check SCENE --until TIME` suggests a step; `flexcrank trade SCENE --tolerance ERROR --until TIME` chooses one\n",
        "\n`flexcrank check SCENE --until TIME` suggests a step; `flexcrank trade SCENE --tolerance ERROR --until TIME` chooses one\n",
        "\n`flexcrank trade SCENE --tolerance ERROR --until TIME` chooses model and step\n",
    ];
    for (more, code, what, remedy) in [
        (["crank-slider", "--until", "1", "--set", "solver.step_s=0.1"], 6, "the energy balance was off", untrusted),
        (["crank-slider", "--until", "1", "--set", "pulse.0.torque_nm=1e9"], 4, "diverged in step", both),
        (["thesis-crank-slider", "--until", "22", "--set", "solver.weight=0.48"], 4, "diverged in step", of_first_order),
    ] {
        let ended = flexcrank(&[&run[..], &more].concat()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert_eq!((ended.status.code(), said.matches(what).count()), (Some(code), 1), "{said}");
        assert!(said.ends_with(remedy), "{said}");
    }
    Ok(())
}

/// The step that `check` suggests keeps the balance that the scene's own does not.
#[test]
fn regress_check_judges_the_balance_and_suggests_a_step_that_keeps_it() -> Tried {
    for scene in ["solver.step_s=0.1", "solver.step_s=0.02", "solver.integrator=generalized-alpha"] {
        let checked = flexcrank(&["check", "crank-slider", "--set", scene, "--json"]).output()?;
        let found: serde_json::Value = serde_json::from_slice(&checked.stdout)?;
        let run = |more: &[&str]| {
            let run = ["run", "crank-slider", "--set", scene, "--no-bus", "--no-record", "--pace", "max", "--until", "2"];
            flexcrank(&[&run[..], more].concat()).output()
        };
        assert_eq!(run(&[])?.status.code(), checked.status.code(), "{scene}: {found}");
        let step = format!("solver.step_s={}", found["suggested_step_s"]);
        assert_eq!(run(&["--set", &step])?.status.code(), Some(0), "{scene}: {found}");
    }
    Ok(())
}

#[test]
fn prop_a_step_that_does_not_resolve_a_turn_is_warned_of_as_wrong_motion() -> Tried {
    let checked = flexcrank(&["check", "thesis-compressor", "--set", "solver.step_s=0.05"]).output()?;
    let said = String::from_utf8(checked.stderr)?;
    assert!(said.contains("does not resolve the turn, 0.04 s: expect wrong motion"), "{said}");
    Ok(())
}

/// A modulus in a wrong unit: the rod is as soft as rubber.
#[test]
fn regress_a_link_that_bends_too_far_is_told_by_check_and_at_the_end_of_a_run() -> Tried {
    let soft = ["crank-slider", "--set", "rod.youngs_modulus_pa=2.1e8"];
    let checked = flexcrank(&[&["check"][..], &soft].concat()).output()?;
    let out = String::from_utf8(checked.stdout)?;
    assert!(out.starts_with("crank-slider: valid, but a link bends out of the model's range"), "{out}");
    let run =
        flexcrank(&[&["run", "--no-bus", "--no-record", "--pace", "max", "--until", "0.45"][..], &soft].concat()).output()?;
    let said = String::from_utf8(run.stderr)?;
    assert_eq!((run.status.code(), said.matches("warning: out of the model's range").count()), (Some(0), 1), "{said}");
    // With its balance off, or diverged, too: then only a step was named.
    for (modulus, code) in [("1e8", 6), ("3e7", 4)] {
        let modulus = format!("rod.youngs_modulus_pa={modulus}");
        let long_step = ["--set", &modulus, "--set", "solver.integrator=generalized-alpha", "--set", "solver.step_s=0.02"];
        let run = ["run", "crank-slider", "--no-bus", "--no-record", "--pace", "max", "--until", "2"];
        let run = flexcrank(&[&run[..], &long_step].concat()).output()?;
        let said = String::from_utf8(run.stderr)?;
        assert!(run.status.code() == Some(code) && said.contains("warning: out of the model's range"), "{modulus}: {said}");
    }
    let loaded = [&["check"][..], &soft, &["--set", "slider.resistance_n=20", "--set", "start.angle_rad=0.5"]].concat();
    let out = String::from_utf8(flexcrank(&loaded).output()?.stdout)?;
    assert!(out.contains("frequencies  not computed: the position is singular") && out.contains("does it buckle?"), "{out}");
    let refused =
        ["--set", "rod.youngs_modulus_pa=210", "--set", "gravity.y_m_per_s2=-9.81", "--set", "start.static_equilibrium=true"];
    let checked = flexcrank(&[&["check"][..], &refused].concat()).output()?;
    let said = String::from_utf8(checked.stderr)?;
    assert!(checked.status.code() == Some(2) && said.starts_with("warning: rod.youngs_modulus_pa = 210 is softer"), "{said}");
    Ok(())
}

#[test]
fn regress_refusals_of_one_of_several_runs_name_its_scene() -> Tried {
    for (more, why) in [
        (&["thesis-crank-slider", "--until", "0.05"][..], "error: thesis-crank-slider: --until 0.05: the run would last"),
        (&["ref-r2s", "--overrun", "degrade"], "error: crank-slider: --overrun degrade needs a scene with [[level]] tables"),
        (&["thesis-two-masses", "--shadow", "rigid"], "error: --shadow rigid: thesis-two-masses: solver.model"),
    ] {
        let ended = flexcrank(&[&["run", "crank-slider"][..], more, &["--no-bus", "--no-record"]].concat()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert!(ended.status.code() == Some(2) && said.contains(why), "{said}");
    }
    Ok(())
}

#[test]
fn regress_a_table_that_replaces_another_says_so() -> Tried {
    let folder = tempfile::tempdir()?;
    for words in [&["cycle"][..], &["modes", "--count", "1"], &["response"]] {
        for beginning in ["t.csv (", "replaced t.csv ("] {
            let ended = flexcrank(&[words, &["--csv", "t.csv"]].concat()).current_dir(folder.path()).output()?;
            let out = String::from_utf8(ended.stdout)?;
            assert!(ended.status.success() && out.lines().any(|line| line.starts_with(beginning)), "{words:?}: {out}");
        }
        std::fs::remove_file(folder.path().join("t.csv"))?;
    }
    Ok(())
}

#[test]
fn prop_a_service_open_to_the_network_without_passwords_warns() -> Tried {
    let warned = |listen: &str, name: &str| -> Result<bool, Box<dyn Error>> {
        let ended = flexcrank(&[&SHORT, &["--name", name, "--listen", listen][..]].concat()).output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert_eq!(ended.status.code(), Some(0), "{said}");
        Ok(said.contains("can command the mechanism: no passwords are set; see `flexcrank guide security`"))
    };
    assert!(warned("tcp/0.0.0.0:0", "open-to-all")? && !warned("tcp/127.0.0.1:0", "open-to-none")?);
    Ok(())
}

#[test]
fn prop_runs_without_a_bus_share_a_name() -> Tried {
    let alike = |_| SHORT.into_iter().chain(["--no-bus", "--name", "alike"]).map(str::to_owned).collect();
    together((0..8).map(alike))
}

/// Interrupts a run as soon as it has recorded something; returns its exit code, and whether the recording was closed.
fn interrupted(arguments: &[&str]) -> Result<(Option<i32>, bool), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("run.mcap");
    let path = file.to_str().ok_or("a path that is no text")?;
    let mut child = flexcrank(&[&["run", "--no-bus", "--record", path], arguments].concat()).stderr(Stdio::null()).spawn()?;
    let patience = Instant::now() + Duration::from_secs(20);
    while !Messages::open(&file).is_ok_and(|mut messages| messages.any(|message| message.is_ok())) {
        assert!(Instant::now() < patience && child.try_wait()?.is_none(), "the run records");
        std::thread::yield_now();
    }
    kill_process(Pid::from_raw(i32::try_from(child.id())?).ok_or("no process id")?, Signal::INT)?;
    let code = child.wait()?.code();
    Ok((code, Messages::open(&file)?.all(|message| message.is_ok())))
}

#[test]
fn prop_an_interrupted_run_does_not_look_finished() -> Tried {
    assert_eq!(interrupted(&["--until", "1000"])?, (Some(130), true));
    assert_eq!(interrupted(&[])?, (Some(0), true), "a run without an end is ended by Ctrl-C");
    Ok(())
}

/// Exit code of a command whose reader goes away at once.
fn unread(arguments: &[&str]) -> Result<Option<i32>, Box<dyn Error>> {
    let mut child = flexcrank(arguments).stderr(Stdio::null()).spawn()?;
    drop(child.stdout.take());
    Ok(child.wait()?.code())
}

#[test]
fn regress_a_reader_that_goes_away_changes_neither_work_nor_exit_code() -> Tried {
    assert_eq!(unread(&["verify", TRUNCATED])?, Some(3));
    assert_eq!(unread(&["verify", WHOLE, TRUNCATED])?, Some(3));
    let folder = tempfile::tempdir()?;
    let path = folder.path().to_str().ok_or("a path that is no text")?;
    assert_eq!(unread(&["plot", WHOLE, "--to", "0.5", "--format", "svg", "-o", path])?, Some(0));
    assert!(folder.path().join("index.html").exists());
    Ok(())
}

fn described(file: &str) -> Result<(Option<i32>, serde_json::Value), Box<dyn Error>> {
    let ended = flexcrank(&["info", "--json", file]).output()?;
    Ok((ended.status.code(), serde_json::from_slice(&ended.stdout)?))
}

#[test]
fn val_info_counts_as_the_reader_does() -> Tried {
    let (code, info) = described(WHOLE)?;
    let messages = Messages::open(Path::new(WHOLE))?.collect::<Result<Vec<_>, _>>()?;
    assert_eq!(code, Some(0));
    assert_eq!(info["messages"], messages.len());
    let topic = info["topics"].as_array().ok_or("no topics")?.iter().find(|topic| topic["topic"] == "flexcrank/crank/angles");
    let topic = topic.ok_or("no angles")?;
    let angles = messages.iter().filter(|message| message.channel.topic == "flexcrank/crank/angles");
    assert_eq!(topic["bytes"], angles.clone().map(|message| message.data.len()).sum::<usize>());
    assert_eq!((&topic["messages"], &topic["schema"]), (&angles.count().into(), &"flexcrank.v1.Angles".into()));
    assert_eq!((&info["session"]["state"], &info["damage"]), (&"finished".into(), &serde_json::Value::Null));
    assert_eq!(info["session"]["scene"]["integrator"], "esdirk");
    let (code, info) = described(TRUNCATED)?;
    assert!(code == Some(3) && info["damage"].is_string(), "{info}");
    Ok(())
}

/// Ends of the records of a file outside of chunks, bytes.
fn record_ends(bytes: &[u8]) -> Vec<usize> {
    let mut ends = vec![8];
    while let Some(length) = ends.last().and_then(|at| bytes.get(at + 1..at + 9)).and_then(|length| length.first_chunk::<8>()) {
        ends.push(ends[ends.len() - 1] + 9 + u64::from_le_bytes(*length) as usize);
    }
    ends
}

#[test]
fn regress_a_file_cut_off_between_two_records_is_said_to_be_cut_off() -> Tried {
    let bytes = std::fs::read(WHOLE)?;
    let ends: Vec<usize> =
        record_ends(&bytes).into_iter().filter(|end| (bytes.len() / 3..bytes.len() / 2).contains(end)).collect();
    let folder = tempfile::tempdir()?;
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &bytes[..*ends.first().ok_or("no record ends there")?])?;
    let file = cut.to_str().ok_or("a path that is no text")?;
    let tables = folder.path().join("tables");
    let tables = tables.to_str().ok_or("a path that is no text")?;
    for arguments in [&["info", file][..], &["export", file, "--csv", tables], &["plot", file, "--format", "svg", "-o", tables]] {
        let ended = flexcrank(arguments).output()?;
        let said = [ended.stdout, ended.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(ended.status.code(), Some(3), "{arguments:?}: {said}");
        assert!(said.contains("early"), "{arguments:?}: {said}");
    }
    Ok(())
}

#[test]
fn regress_an_interrupted_sweep_keeps_the_cells_so_far() -> Tried {
    let folder = tempfile::tempdir()?;
    let maps = folder.path().join("maps");
    let path = maps.to_str().ok_or("a path that is no text")?;
    let mut sweep = flexcrank(&["stability", "crank-slider", "--jobs", "1", "--csv", path]).stdout(Stdio::null()).spawn()?;
    let patience = Instant::now() + Duration::from_secs(20);
    while !maps.exists() {
        assert!(Instant::now() < patience && sweep.try_wait()?.is_none(), "the sweep begins");
        std::thread::yield_now();
    }
    kill_process(Pid::from_raw(i32::try_from(sweep.id())?).ok_or("no process id")?, Signal::INT)?;
    let ended = sweep.wait_with_output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("warning: interrupted: ") && said.contains("cells were not run"), "{said}");
    assert!(said.contains("press Ctrl-C again to stop at once, which loses what was computed\n"), "{said}");
    let cells = std::fs::read_to_string(maps.join("cells.csv"))?;
    assert!(cells.contains("not run"), "{} lines", cells.lines().count());
    Ok(())
}

#[test]
fn regress_an_interrupted_campaign_does_not_threaten_to_lose_its_rows() -> Tried {
    let folder = tempfile::tempdir()?;
    let spec = "scene = \"thesis-crank-slider\"\nset = [\"solver.model=rigid\"]\nuntil_s = 20\nmethod = \"random\"\nsamples = 20000\n\
        chunk = 4\n[[vary]]\nkey = \"rod.length_m\"\nmin = 1.2\nmax = 1.8\n";
    std::fs::write(folder.path().join("s.toml"), spec)?;
    let mut sweep = flexcrank(&["sweep", "s.toml", "--jobs", "1"]).current_dir(folder.path()).spawn()?;
    let rows = folder.path().join("s.sweep/chunks-of-4/0000000.tsv");
    let patience = Instant::now() + Duration::from_secs(20);
    while !std::fs::metadata(&rows).is_ok_and(|file| file.len() > 0) {
        assert!(Instant::now() < patience && sweep.try_wait()?.is_none(), "the campaign begins");
        std::thread::yield_now();
    }
    kill_process(Pid::from_raw(i32::try_from(sweep.id())?).ok_or("no process id")?, Signal::INT)?;
    let ended = sweep.wait_with_output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("press Ctrl-C again to stop at once\n") && !said.contains("loses"), "{said}");
    Ok(())
}

/// Only `--fixed-cost` rates steps; here the user named the number.
#[test]
fn regress_steps_of_a_named_cost_that_leave_too_much_name_a_way_on() -> Tried {
    let run = ["run", "--no-bus", "--no-record", "--pace", "max", "--until", "0.2", "--set", "solver.corrections=1"];
    let said = String::from_utf8(flexcrank(&run).output()?.stderr)?;
    let way = " left more than solver.tolerance: more solver.corrections, or a shorter solver.step_s, leave less\n";
    assert!(said.contains(way) && !said.contains("rated"), "{said}");
    Ok(())
}
