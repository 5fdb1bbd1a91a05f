//! Re-simulation steps no further than a recording proves.

use std::path::Path;
use std::process::Command;

use flexcrank::recording::RecordingFile;
use flexcrank::wire::{Angles, Stamp};
use prost::Message as _;

use crate::common::Outcome;
use crate::{flexcrank, sample};

/// The step that the forged stamp states.
const FORGED: u64 = 1_000_000_000_000;
/// Step of the sample's scene, s.
const STEP_S: f64 = 0.002;

/// Writes the sample up to its sample of angles in step 1000, whose stamp is forged, with a log time that fits.
fn forge(path: &Path) -> Outcome {
    let whole = sample("sample-three-pulses.mcap");
    let (bytes, begin_ns) = (std::fs::read(&whole)?, RecordingFile::open(Path::new(&whole))?.begin_ns());
    let summary = mcap::Summary::read(&bytes)?.ok_or("no summary")?;
    let mut writer = mcap::Writer::new(std::fs::File::create(path)?)?;
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(&bytes, index)?)?;
    }
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(&bytes, index)?)?;
    }
    for message in mcap::MessageStream::new(&bytes)? {
        let mut message = message?;
        let angles = Angles::decode(message.data.as_ref()).ok().filter(|_| message.channel.topic.ends_with("angles"));
        let Some((angles, stamp)) =
            angles.and_then(|angles| angles.stamp.map(|stamp| (angles, stamp))).filter(|(_, stamp)| stamp.step == 1000)
        else {
            writer.write(&message)?;
            continue;
        };
        let sim_time_s = FORGED as f64 * STEP_S;
        message.log_time = begin_ns + (sim_time_s * 1e9) as u64 + 1_000_000_000;
        let stamp = Some(Stamp { step: FORGED, sim_time_s, ..stamp });
        message.data = Angles { stamp, ..angles }.encode_to_vec().into();
        writer.write(&message)?;
        break;
    }
    writer.finish()?;
    Ok(())
}

#[test]
fn regress_a_forged_stamp_leads_nowhere() -> Outcome {
    let folder = tempfile::tempdir()?;
    let forged = folder.path().join("forged.mcap");
    forge(&forged)?;
    let output = flexcrank(&["run", "--no-bus", "--no-record", "--until", "1", "--resume"]).arg(&forged).output()?;
    let said = String::from_utf8(output.stderr)?;
    let why = format!("it states step {FORGED}, but its last checkpoint is of step 0");
    assert!(output.status.code() == Some(1) && said.contains(&why), "{said}");
    let binary = env!("CARGO_BIN_EXE_flexcrank");
    let within_a_minute = |words: &[&str]| {
        Command::new("timeout").args(["60", binary]).args(words).arg(&forged).current_dir(folder.path()).output()
    };
    let output = within_a_minute(&["what-if", "--set", "rod.density_kg_per_m3=2700"])?;
    let said = String::from_utf8(output.stderr)?;
    assert!(output.status.code() == Some(1) && said.contains("no message or checkpoint comes between steps"), "{said}");
    let output = within_a_minute(&["verify", "--json"])?;
    let found = String::from_utf8(output.stdout)?;
    assert!(output.status.code() == Some(1) && found.contains("\"skipped_messages\":1"), "{found}");
    Ok(())
}
