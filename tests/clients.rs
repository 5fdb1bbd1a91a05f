//! Clients of a running service: listing, waiting, commands, and their output as JSON.

mod common;

use std::error::Error;
use std::io::{BufRead as _, BufReader};
use std::net::TcpListener;
use std::process::{Child, Command, Output, Stdio};

use flexcrank::wire::{Angles, AppliedCommand, Energies, Stamp, Status};
use serde_json::Value;

type Tried<T = ()> = Result<T, Box<dyn Error>>;

fn flexcrank(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// An endpoint that nobody listens on yet.
fn free_endpoint() -> Tried<String> {
    Ok(format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?))
}

/// A service with an endpoint of its own, ended with the test.
struct Service {
    child: Child,
    endpoint: String,
}

impl Service {
    /// Starts a service, and waits until it is on the bus.
    fn start(name: &str, more: &[&str]) -> Tried<Self> {
        let endpoint = free_endpoint()?;
        let run = ["run", "--name", name, "--listen", &endpoint, "--until", "100"];
        let mut child = flexcrank(&[&run, more].concat()).spawn()?;
        let lines = BufReader::new(child.stderr.take().ok_or("no standard error")?).lines();
        let started = lines.map_while(Result::ok).find(|line| line.contains(&format!("flexcrank/{name} at {endpoint};")));
        let service = Service { child, endpoint };
        started.map(|_| service).ok_or_else(|| "no start line with name and endpoint".into())
    }

    fn ask(&self, arguments: &[&str]) -> Tried<Output> {
        Ok(flexcrank(&[arguments, &["--connect", &self.endpoint]].concat()).output()?)
    }

    /// Asks for JSON, one object per line.
    fn json(&self, arguments: &[&str]) -> Tried<Vec<Value>> {
        json(&self.ask(&[arguments, &["--json"]].concat())?)
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn json(ended: &Output) -> Tried<Vec<Value>> {
    let text = String::from_utf8(ended.stdout.clone())?;
    text.lines().map(|line| serde_json::from_str(line).map_err(|error| format!("{line}: {error}").into())).collect()
}

#[test]
fn regress_list_describes_a_service() -> Tried {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("a-recording-with-a-long-name-that-does-not-fit.mcap");
    let path = file.to_str().ok_or("a path that is no text")?;
    let service = Service::start("listed", &["--record", path])?;
    let listed = service.json(&["list"])?;
    let [listed] = listed.as_slice() else { return Err(format!("{listed:?}").into()) };
    assert_eq!(listed["name"], "listed");
    assert_eq!([&listed["kind"], &listed["state"], &listed["scene"]], ["live", "running", "crank-slider"]);
    assert_eq!(listed["endpoints"], Value::from(vec![service.endpoint.clone()]));
    assert_eq!([&listed["recording"], &listed["version"]], [path, env!("CARGO_PKG_VERSION")]);
    assert!(listed["sim_time_s"].as_f64().is_some_and(|time_s| time_s >= 0.0), "{listed}");
    let table = String::from_utf8(service.ask(&["list"])?.stdout)?;
    assert!(table.lines().count() == 2 && table.lines().all(|line| line.chars().count() <= 80), "{table}");
    for part in ["listed", "live", "running", "crank-slider", &service.endpoint, "fit.mcap"] {
        assert!(table.contains(part), "{part} in {table}");
    }
    Ok(())
}

#[test]
fn regress_replies_are_printed_as_json() -> Tried {
    let service = Service::start("replies", &["--no-record"])?;
    let pulse = service.json(&["pulse", "replies", "--torque", "1", "--duration", "100ms", "--id", "one"])?;
    assert_eq!([&pulse[0]["id"], &pulse[0]["reason"]], ["one", ""]);
    assert!(pulse[0]["accepted"] == true && pulse[0]["effective_step"].is_u64() && pulse[0]["effective_sim_time_s"].is_f64());
    let refused = service.ask(&["pulse", "replies", "--torque", "1e9", "--duration", "1", "--json"])?;
    let [reply] = &json(&refused)?[..] else { return Err("not one line".into()) };
    assert!(refused.status.code() == Some(1) && reply["accepted"] == false && reply["effective_step"].is_null(), "{reply}");
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("pulses.csv");
    std::fs::write(&file, "torque_nm,duration_s\n1,0.1\n1e9,0.1\n1,0.1\n")?;
    let replies = service.json(&["pulse", "replies", "--from", file.to_str().ok_or("a path that is no text")?])?;
    let lines: Vec<_> = replies.iter().map(|reply| (reply["line"].as_u64(), reply["accepted"].as_bool())).collect();
    assert_eq!(lines, [(Some(2), Some(true)), (Some(3), Some(false))], "a refused pulse ends the sequence");
    let paused = service.json(&["control", "replies", "pause"])?;
    assert!(paused[0]["accepted"] == true && paused[0]["reason"] == "", "{paused:?}");
    Ok(())
}

#[test]
fn regress_a_change_of_a_running_scene_warns_of_what_looks_like_a_mistake_and_waits_for_a_long_step() -> Tried {
    let service = Service::start("suspected", &["--no-record", "--set", "pulse=[]"])?;
    let density = "warning: rod.density_kg_per_m3 = 7.85 is lighter than any stiff material: densities are in kg/m³, and \
                   7.85 g/cm³ is 7850\n";
    for (change, code, warning) in [
        ("rod.density_kg_per_m3=7.85", 0, density),
        ("slider.mass_kg=0.3", 0, ""), // as the running scene has it
        ("rod.length_m=420", 1, ""),
        ("solver.step_s=10", 0, "no reply yet: steps of 10 s begin at an instant that both steps reach, at t = "),
    ] {
        let ended = service.ask(&["control", "suspected", "set", change])?;
        let (printed, said) = (String::from_utf8(ended.stdout)?, String::from_utf8(ended.stderr)?);
        let is_said = said == warning || change == "solver.step_s=10" && said.starts_with(warning);
        assert!(ended.status.code() == Some(code) && is_said, "{change}: {printed}{said}");
    }
    Ok(())
}

/// Lines before a refused one stay in effect, as the help says; lines after it are not sent.
#[test]
fn prop_a_refused_line_ends_a_sequence_of_pulses() -> Tried {
    let folder = tempfile::tempdir()?;
    let (file, pulses) = (folder.path().join("run.mcap"), folder.path().join("pulses.csv"));
    let text = |path: &std::path::Path| path.to_str().map(str::to_owned).ok_or("a path that is no text");
    let mut service = Service::start("sequence", &["--record", &text(&file)?, "--set", "pulse=[]"])?;
    std::fs::write(&pulses, "torque_nm,duration_s,id\n1e-3,60,before\n1e9,60,refused\n1e-3,60,after\n")?;
    let sent = service.ask(&["pulse", "sequence", "--from", &text(&pulses)?])?;
    let said = String::from_utf8(sent.stdout)?;
    let lines: Vec<&str> = said.lines().map(|line| line.split(':').next().unwrap_or_default()).collect();
    assert!(sent.status.code() == Some(1) && lines == ["line 2", "line 3"], "{said}");
    assert!(service.ask(&["control", "sequence", "stop"])?.status.success());
    assert!(service.child.wait()?.success());
    let commands = common::decoded::<AppliedCommand>(&file, "commands")?;
    let ids: Vec<String> = commands.into_iter().filter_map(|command| command.reply).map(|reply| reply.id).collect();
    assert!(ids.len() == 2 && ids[0] == "before", "one pulse and the stop: {ids:?}");
    let last = common::decoded::<Status>(&file, "status")?.pop().ok_or("no status")?;
    assert_eq!((last.commands_rejected, last.pulses_pending), (1, 1), "the first line still acts; the third never came");
    Ok(())
}

/// The modes of a service that is paused at its start are those of its scene there.
#[test]
fn prop_a_running_service_tells_its_modes() -> Tried {
    let service = Service::start("modal", &["--no-record", "--set", "pulse=[]"])?;
    let told = service.json(&["modes", "--live", "modal", "--count", "4"])?;
    let own = json(&flexcrank(&["modes", "crank-slider", "--count", "4", "--json"]).output()?)?;
    assert_eq!([told.len(), own.len()], [4; 2]);
    for (told, own) in told.iter().zip(&own) {
        assert_eq!(told["name"], own["mode"]);
        let [told, own] = [told, own].map(|mode| mode["frequency_hz"].as_f64().unwrap_or(f64::NAN));
        assert!((told - own).abs() <= 1e-6 * own, "{told} for {own}");
    }
    service.json(&["control", "modal", "pause"])?;
    let shown = String::from_utf8(service.ask(&["modes", "--live", "modal"])?.stdout)?;
    assert!(shown.lines().count() == 2 + 8 + 1 && shown.contains("crank bending 2: beyond the 1 bending shape"), "{shown}");
    for (asked, why) in [
        (&["modes", "--live", "modal", "--count", "1000"][..], "a whole number from 1 to 100"),
        (&["control", "modal", "seek", "1"], "`modal` is a simulation"),
    ] {
        let Output { status, stderr, .. } = service.ask(asked)?;
        assert!(status.code() == Some(1) && String::from_utf8_lossy(&stderr).contains(why), "{asked:?}");
    }
    Ok(())
}

#[test]
fn regress_watched_values_are_printed_as_json() -> Tried {
    let service = Service::start("watched", &["--no-record"])?;
    let watch = ["watch", "watched", "--plain", "--json", "--connect", &service.endpoint];
    let mut watch = flexcrank(&watch).spawn()?;
    let mut lines = BufReader::new(watch.stdout.take().ok_or("no standard output")?).lines();
    let first: Value = serde_json::from_str(&lines.next().ok_or("no line")??)?;
    assert!(first["state"] == "running" && first["ended"] == false && first["sim_time_s"].is_f64(), "{first}");
    let signals = loop {
        let next: Value = serde_json::from_str(&lines.next().ok_or("no line with signals")??)?;
        if next["signals"]["crank.chord_rad"].is_f64() {
            break next["signals"].clone();
        }
    };
    assert!(signals["driving_torque_nm"].is_f64(), "{signals}");
    service.ask(&["control", "watched", "stop"])?;
    let last = lines.map_while(Result::ok).last().ok_or("no last line")?;
    assert!(serde_json::from_str::<Value>(&last)?["ended"] == true, "{last}");
    assert_eq!(watch.wait()?.code(), Some(0));
    Ok(())
}

#[test]
fn regress_only_the_chosen_signals_are_watched_in_lines_and_a_wrong_name_is_refused() -> Tried {
    let service = Service::start("chosen", &["--no-record"])?;
    let first_two = |more: &[&str]| -> Tried<Vec<String>> {
        let names = "links.crank.chord_rad,kinetic_j";
        let watch = ["watch", "chosen", "--connect", &service.endpoint, "--plain", "--signals", names];
        let mut watch = flexcrank(&[&watch, more].concat()).spawn()?;
        let lines = BufReader::new(watch.stdout.take().ok_or("no standard output")?).lines().take(2);
        let lines = lines.collect::<std::io::Result<Vec<String>>>();
        watch.kill()?;
        watch.wait()?;
        Ok(lines?)
    };
    for line in first_two(&[])? {
        let words: Vec<&str> = line.split_whitespace().collect();
        let names = [words.first(), words.get(4), words.get(6)].map(|word| word.copied().unwrap_or_default());
        assert!(words.len() == 8 && names == ["RUNNING", "links.crank.chord_rad", "kinetic_j"], "{line}");
    }
    let lines = first_two(&["--json"])?;
    assert!(lines.last().is_some_and(|line| line.contains("\"links.crank.chord_rad\":")), "{lines:?}");
    for line in lines {
        let line: Value = serde_json::from_str(&line)?;
        let signals = line["signals"].as_object().ok_or("no signals")?;
        assert!(signals.keys().all(|name| ["links.crank.chord_rad", "kinetic_j"].contains(&name.as_str())), "{line}");
        assert!(line["sim_time_s"].is_f64(), "{line}");
    }
    let wrong = service.ask(&["watch", "chosen", "--plain", "--signals", "kinetic_j,crank.rate_rad_per_z"])?;
    let said = String::from_utf8(wrong.stderr)?;
    let refusal = "error: no signal `crank.rate_rad_per_z`; did you mean `crank.rate_rad_per_s`?\n";
    assert!(wrong.status.code() == Some(2) && said.ends_with(refusal) && wrong.stdout.is_empty(), "{said}");
    Ok(())
}

/// Energies are published at every tenth sample of the angles, and statuses at other instants.
#[test]
fn regress_watched_values_are_those_recorded_at_the_printed_time() -> Tried {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("run.mcap");
    let path = file.to_str().ok_or("a path that is no text")?;
    let mut service = Service::start("timed", &["--record", path, "--publish-hz", "200,energies=20"])?;
    let mut watch = flexcrank(&["watch", "timed", "--plain", "--json", "--connect", &service.endpoint]).spawn()?;
    let lines = BufReader::new(watch.stdout.take().ok_or("no standard output")?).lines();
    let parsed = |line: std::io::Result<String>| -> Tried<Value> { Ok(serde_json::from_str(&line?)?) };
    // The first comes as soon as there is a status, perhaps before the first energies.
    let printed: Vec<Value> = lines.skip(1).take(3).map(parsed).collect::<Tried<_>>()?;
    assert!(service.ask(&["control", "timed", "stop"])?.status.success());
    watch.wait()?;
    assert!(service.child.wait()?.success());
    let (angles, energies) = (common::decoded::<Angles>(&file, "angles")?, common::decoded::<Energies>(&file, "energies")?);
    for block in &printed {
        let at_s = block["sim_time_s"].as_f64().ok_or("no time")?;
        let is_then = |stamp: &Option<Stamp>| (common::time_s(stamp) - at_s).abs() < 1e-9;
        let angles = angles.iter().find(|angles| is_then(&angles.stamp)).ok_or("no angles at that time")?;
        let energies = energies.iter().find(|energies| is_then(&energies.stamp)).ok_or("no energies at that time")?;
        let recorded = [("crank.rate_rad_per_s", Some(angles.links[0].rate_rad_per_s)), ("kinetic_j", energies.kinetic_j)];
        for (name, value) in recorded {
            let (shown, value) = (block["signals"][name].as_f64().ok_or(name)?, value.ok_or(name)?);
            assert!((shown - value).abs() <= 1e-12 * value.abs(), "{name} at {at_s} s: {shown} for {value}");
        }
    }
    Ok(())
}

#[test]
fn regress_a_misspelt_name_of_a_service_is_told_the_one_that_runs() -> Tried {
    let service = Service::start("arm", &["--no-record"])?;
    for (name, said) in [
        ("amr", "(running: arm); did you mean `arm`? `flexcrank run --name amr` starts another\n"),
        ("leg", "(running: arm): start it with `flexcrank run --name leg`\n"),
    ] {
        let ended = service.ask(&["watch", name, "--plain"])?;
        let told = String::from_utf8(ended.stderr)?;
        let expected = format!("error: no service named `{name}` answers {said}");
        assert_eq!((ended.status.code(), told), (Some(1), expected));
    }
    Ok(())
}

#[test]
fn regress_clients_wait_for_a_service() -> Tried {
    let absent = free_endpoint()?;
    let pause = ["control", "waited-for", "pause", "--connect", &absent];
    let ended = flexcrank(&[&pause[..], &["--wait=200ms"]].concat()).output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert!(ended.status.code() == Some(1) && said.contains("`waited-for` did not appear in 0.2 s"), "{said}");
    let ended = flexcrank(&["list", "--connect", &absent, "--wait=200ms"]).output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert!(ended.status.code() == Some(1) && said.contains("a service did not appear in 0.2 s"), "{said}");
    let early = flexcrank(&[&pause[..], &["--wait=60"]].concat()).spawn()?;
    let list = flexcrank(&["list", "--json", "--connect", &absent, "--wait"]).spawn()?;
    let run = ["run", "--name", "waited-for", "--listen", &absent, "--until", "100", "--no-record"];
    let mut service = flexcrank(&run).stderr(Stdio::null()).spawn()?;
    let (ended, listed) = (early.wait_with_output(), list.wait_with_output());
    service.kill()?;
    service.wait()?;
    let (ended, listed) = (ended?, listed?);
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    let listed = String::from_utf8(listed.stdout)?;
    assert!(listed.contains("\"name\":\"waited-for\""), "{listed}");
    Ok(())
}

#[test]
fn regress_an_interrupted_client_that_sends_something_says_that_nothing_was_sent() -> Tried {
    let pulse = ["pulse", "nobody", "--torque", "1", "--duration", "1"];
    let setpoint = ["setpoint", "nobody", "--torque", "1", "--hold", "1"];
    for (words, left) in [
        (&pulse[..], "interrupted: nothing was sent\n"),
        (&setpoint, "interrupted: nothing was sent\n"),
        (&["control", "nobody", "pause"], "interrupted: nothing was sent\n"),
        (&["list"], "interrupted\n"),
        (&["watch", "nobody", "--plain"], "interrupted\n"),
    ] {
        // It accepts a connection, and never answers.
        let silent = TcpListener::bind("127.0.0.1:0")?;
        let endpoint = format!("tcp/{}", silent.local_addr()?);
        let client = flexcrank(&[words, &["--wait=60", "--connect", &endpoint]].concat()).spawn()?;
        let _connection = silent.accept()?;
        let process = rustix::process::Pid::from_raw(i32::try_from(client.id())?).ok_or("no process id")?;
        rustix::process::kill_process(process, rustix::process::Signal::INT)?;
        let ended = client.wait_with_output()?;
        let said = String::from_utf8(ended.stderr)?;
        assert_eq!((ended.status.code(), said.as_str()), (Some(130), left), "{words:?}");
    }
    Ok(())
}

#[test]
fn regress_a_watch_in_lines_is_ended_by_an_interruption() -> Tried {
    let service = Service::start("interrupted", &["--no-record"])?;
    let mut watch = flexcrank(&["watch", "interrupted", "--plain", "--connect", &service.endpoint]).spawn()?;
    let mut lines = BufReader::new(watch.stdout.take().ok_or("no standard output")?).lines();
    lines.next().ok_or("no line")??;
    let process = rustix::process::Pid::from_raw(i32::try_from(watch.id())?).ok_or("no process id")?;
    rustix::process::kill_process(process, rustix::process::Signal::INT)?;
    assert!(lines.map_while(Result::ok).all(|line| !line.contains("has ended")), "the service has not ended");
    assert_eq!(watch.wait()?.code(), Some(0));
    Ok(())
}

#[test]
fn regress_an_interrupted_replay_ends_with_130_unless_it_has_no_end() -> Tried {
    for (looped, code) in [(None, 130), (Some("--loop"), 0)] {
        let words = ["replay", "recordings/sample-three-pulses.mcap", "--rate", "0.1", "--listen", "tcp/127.0.0.1:0", "--name"];
        let name = format!("ghost-{code}");
        let arguments: Vec<&str> = words.into_iter().chain([name.as_str()]).chain(looped).collect();
        let mut replay = flexcrank(&arguments).spawn()?;
        let mut lines = BufReader::new(replay.stderr.take().ok_or("no standard error")?).lines();
        let started = lines.by_ref().map_while(Result::ok).find(|line| line.starts_with("replaying "));
        started.ok_or("the replay does not begin")?;
        let process = rustix::process::Pid::from_raw(i32::try_from(replay.id())?).ok_or("no process id")?;
        rustix::process::kill_process(process, rustix::process::Signal::INT)?;
        let said: Vec<String> = lines.map_while(Result::ok).collect();
        assert_eq!(replay.wait()?.code(), Some(code), "{said:?}");
    }
    Ok(())
}

/// Paused, a service publishes its status alone; the values come from the snapshot.
#[test]
fn regress_a_paused_service_is_watched_with_its_values_and_a_reset_is_no_alarm() -> Tried {
    let service = Service::start("paused", &["--no-record"])?;
    let first = || -> Tried<Value> {
        let watch = ["watch", "paused", "--plain", "--json", "--connect", &service.endpoint];
        let mut watch = flexcrank(&watch).spawn()?;
        let line = BufReader::new(watch.stdout.take().ok_or("no standard output")?).lines().next().ok_or("no line")??;
        watch.kill()?;
        watch.wait()?;
        Ok(serde_json::from_str(&line)?)
    };
    service.ask(&["control", "paused", "reset"])?;
    let snapshot = first()?;
    assert_eq!(snapshot["message"], Value::Null, "{snapshot}");
    service.ask(&["control", "paused", "pause"])?;
    let paused = first()?;
    assert!(paused["state"] == "paused" && paused["signals"]["crank.chord_rad"].is_f64(), "{paused}");
    Ok(())
}

/// Asks a replay that is paused from its start.
fn ask_a_paused_replay(name: &str, arguments: &[&str]) -> Tried<Output> {
    let endpoint = free_endpoint()?;
    let replay = ["replay", "recordings/sample-three-pulses.mcap", "--name", name, "--start-paused", "--listen", &endpoint];
    let mut replay = flexcrank(&replay).spawn()?;
    let asked = flexcrank(&[arguments, &["--connect", &endpoint, "--wait=20s"]].concat()).output();
    replay.kill()?;
    replay.wait()?;
    Ok(asked?)
}

#[test]
fn regress_a_replay_that_is_paused_says_so() -> Tried {
    let listed = json(&ask_a_paused_replay("still", &["list", "--json"])?)?;
    assert!(listed.len() == 1 && listed[0]["kind"] == "replay" && listed[0]["state"] == "paused", "{listed:?}");
    Ok(())
}

#[test]
fn regress_a_replay_that_is_asked_for_modes_leads_to_its_recording() -> Tried {
    let asked = ask_a_paused_replay("mute", &["modes", "--live", "mute"])?;
    let said = String::from_utf8(asked.stderr)?;
    let way = "error: `mute` is a replay, and computes no modes: `flexcrank modes FILE@TIME` finds ";
    assert!(asked.status.code() == Some(1) && said.starts_with(way), "{said}");
    Ok(())
}
