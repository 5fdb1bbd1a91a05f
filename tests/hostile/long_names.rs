//! Recordings of other programs with names that zenoh cannot carry.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;

use mcap::records::MessageHeader;
use zenoh::Wait as _;

use crate::common::Outcome;
use crate::{connect, endpoint, flexcrank};

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
    assert!(said.contains(r"t\x1b[31m") && !said.contains('\u{1b}'), "{said}");
    Ok(())
}
