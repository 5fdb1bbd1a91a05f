//! Recordings of other programs with names that zenoh cannot carry.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use flexcrank::wire;
use mcap::records::MessageHeader;
use prost::Message as _;
use zenoh::Wait as _;

use crate::common::Outcome;
use crate::common::rewritten::{Contents, Entry, as_is};
use crate::{connect, endpoint, flexcrank, sample};

/// A topic that can be carried beside one of these names.
fn recording(path: &Path, (topic, encoding, schema): (&str, &str, &str)) -> Outcome {
    let mut writer = mcap::Writer::new(std::fs::File::create(path)?)?;
    let named = writer.add_schema(schema, "jsonschema", b"{}")?;
    let channels = [
        writer.add_channel(0, "sound", "json", &BTreeMap::new())?,
        writer.add_channel(named, topic, encoding, &BTreeMap::new())?,
    ];
    for (sequence, channel_id) in channels.into_iter().cycle().take(10).enumerate() {
        let header = MessageHeader { channel_id, sequence: sequence as u32, log_time: sequence as u64 * 1000, publish_time: 0 };
        writer.write_to_known_channel(&header, b"{}")?;
    }
    writer.finish()?;
    Ok(())
}

#[test]
fn regress_names_that_the_bus_cannot_carry_are_left_out_and_said() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("long.mcap");
    let (long, chunks) = ("n".repeat(70_000), vec!["c"; 20_000].join("/"));
    for ((topic, encoding, schema), said) in [
        (("t", "json", &long[..300]), "255 bytes"),
        (("t", &long[..300], "s"), "255 bytes"),
        (("t", "json", long.as_str()), "255 bytes"),
        ((&long, "json", "s"), "4096 bytes"),
        ((&chunks, "json", "s"), "4096 bytes"),
    ] {
        recording(&file, (topic, encoding, schema))?;
        let endpoint = endpoint()?;
        let arguments = ["replay", "--wait-for", "1", "--listen", &endpoint];
        let replay = flexcrank(&arguments).arg(&file).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
        let client = connect(&endpoint)?;
        let heard = client.declare_subscriber("**").wait().map_err(|error| error.to_string())?;
        let output = replay.wait_with_output()?;
        let says = String::from_utf8(output.stderr)?;
        assert_eq!(output.status.code(), Some(3), "{says}");
        assert!(says.contains("left out") && says.contains(said) && says.len() < 2000, "{says}");
        let sound = heard.drain().filter(|sample| sample.key_expr().as_str() == "sound").count();
        assert_eq!(sound, 5);
        flexcrank::bus::close(&client)?;
    }
    Ok(())
}

#[test]
fn regress_control_characters_of_names_are_escaped() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("red.mcap");
    recording(&file, ("t\u{1b}[31m", "json", "s\u{1b}[0m"))?;
    let output = flexcrank(&["info"]).arg(&file).output()?;
    let said = String::from_utf8(output.stdout)?;
    assert!(said.contains(r"t\u{1b}[31m") && !said.contains('\u{1b}'), "{said}");
    Ok(())
}

#[test]
fn regress_names_of_files_need_not_be_text() -> Outcome {
    let folder = tempfile::tempdir()?;
    let named = |name: &[u8]| PathBuf::from(OsStr::from_bytes(name));
    let (take, other) = (named(b"\xff.mcap"), named(b"\xfe.mcap"));
    let commands: [(&[&str], Vec<&PathBuf>); 6] = [
        (&["run", "--no-bus", "--pace", "max", "--until", "0.5", "--record"], vec![&take]),
        (&["verify"], vec![&take]),
        (&["info"], vec![&take]),
        (&["plot", "-o", "plots", "--format", "svg"], vec![&take]),
        (&["what-if", "--add-pulse", "0.1:5:0.1", "--record"], vec![&other, &take]),
        (&["export", "--csv", "tables"], vec![&other]),
    ];
    for (words, files) in commands {
        let output = flexcrank(words).args(files).current_dir(folder.path()).output()?;
        assert_eq!(output.status.code(), Some(0), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
    Ok(())
}

/// A name with a line break, an escape sequence and 40,000 more characters.
fn forged(name: &str) -> String {
    format!("{name}\n  forged: all is well\u{1b}[31m{}", "n".repeat(40_000))
}

/// The sample of three pulses with forged names: topics, encodings, facts of the session, the id of a command.
fn forgeries() -> Outcome<Vec<(&'static str, Contents)>> {
    let whole = Contents::read(sample("sample-three-pulses.mcap").as_ref(), &as_is)?;
    let with = |change: &dyn Fn(&mut Contents)| {
        let mut forged = whole.clone();
        change(&mut forged);
        forged.recount();
        forged
    };
    let of = |all: &mut Contents, change: &dyn Fn(&mut Entry)| {
        all.messages.iter_mut().filter(|entry| entry.chunk() == "angles").for_each(change);
    };
    let command = |id: String| {
        let pulse = wire::TorquePulse { id, torque_nm: 1e12, duration_s: 0.1, ..wire::TorquePulse::default() };
        let stamp = Some(wire::Stamp { step: 100, sim_time_s: 0.2, ..wire::Stamp::default() });
        let command = Some(wire::applied_command::Command::Torque(pulse));
        wire::AppliedCommand { stamp, command, ..wire::AppliedCommand::default() }.encode_to_vec()
    };
    Ok(vec![
        ("a topic", with(&|all| of(all, &|entry| entry.topic = forged(&entry.topic)))),
        (
            "a chunk",
            with(&|all| of(all, &|entry| entry.topic = forged("flexcrank/crank/angles").replace("/angles", "/x/angles"))),
        ),
        (
            "a topic that is not protobuf",
            with(&|all| {
                of(all, &|entry| (entry.topic, entry.encoding) = (forged(&entry.topic), "json".to_owned()));
            }),
        ),
        ("a schema", with(&|all| of(all, &|entry| entry.schema = forged(&entry.schema)))),
        ("an encoding", with(&|all| of(all, &|entry| entry.encoding = forged("cdr")))),
        (
            "facts",
            with(&|all| {
                for (_, facts) in &mut all.metadata {
                    for key in ["name", "commit", "command_line", "version", "started"] {
                        facts.entry(key.to_owned()).and_modify(|value| *value = forged(value));
                    }
                }
            }),
        ),
        (
            "the id of a command",
            with(&|all| {
                let place =
                    all.messages.iter().position(|entry| entry.log_time > all.messages[0].log_time + 200_000_000).unwrap_or(0);
                let topic = "flexcrank/crank/commands".to_owned();
                let (schema, data) = ("flexcrank.v1.AppliedCommand".to_owned(), command(forged("id")));
                let entry = Entry { topic, schema, data, sequence: 1, ..all.messages[place].clone() };
                all.messages.insert(place, entry);
            }),
        ),
    ])
}

#[test]
fn regress_a_name_makes_one_short_line_wherever_it_is_printed() -> Outcome {
    let folder = tempfile::tempdir()?;
    for (number, (what, contents)) in forgeries()?.into_iter().enumerate() {
        let at = |name: &str| folder.path().join(format!("{number}-{name}")).display().to_string();
        let file = at("take.mcap");
        contents.write(file.as_ref())?;
        for words in [
            &["info"][..],
            &["verify"],
            &["export", "--csv", &at("tables")],
            &["export", "--csv", &at("none"), "--columns", "nosuch"],
            &["plot", "-o", &at("plots")],
            &["plot", "--y", "nosuch", "-o", &at("none.svg")],
            &["recover", "-o", &at("whole.mcap")],
            &["what-if", "--add-pulse", "1:5:0.1", "--record", &at("what-if.mcap")],
            &["run", "--no-bus", "--until", "6.1", "--pace", "max", "--no-record", "--resume"],
            &["modes"],
        ] {
            let output = flexcrank(words).arg(&file).current_dir(folder.path()).output()?;
            let said = String::from_utf8([output.stdout, output.stderr].concat())?;
            let command = words[0];
            assert!(!said.contains('\u{1b}'), "{command}, {what}: {said}");
            for line in said.lines() {
                let (start, length) = (line.trim_start().chars().take(200).collect::<String>(), line.chars().count());
                assert!(!start.starts_with("forged") && length < 2500, "{command}, {what}: {length} characters: {start}");
            }
        }
        let json = String::from_utf8(flexcrank(&["info", "--json"]).arg(&file).output()?.stdout)?;
        let is_listed = ["a topic", "facts", "a schema", "an encoding"].contains(&what);
        assert!(!is_listed || json.contains(&"n".repeat(40_000)), "{what}: JSON has the whole name");
    }
    Ok(())
}
