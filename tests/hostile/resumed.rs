//! Re-simulation steps no further than a recording proves.

use std::path::Path;
use std::process::Command;

use flexcrank::recording::RecordingFile;
use flexcrank::wire::{Angles, Checkpoint, Stamp};
use prost::Message as _;

use crate::common::Outcome;
use crate::common::rewritten::{Contents, Entry, as_is};
use crate::{flexcrank, sample};

/// The step that the forged stamp states.
const FORGED: u64 = 1_000_000_000_000;
/// Step of the sample's scene, s.
const STEP_S: f64 = 0.002;

/// Writes the sample with a forged stamp on a message, whose log time fits. What comes after it is left out if the file `ends` there.
fn forge(path: &Path, which: impl Fn(&Entry) -> bool, ends: bool) -> Outcome {
    let whole = sample("sample-three-pulses.mcap");
    let begin_ns = RecordingFile::open(Path::new(&whole))?.begin_ns();
    let mut all = Contents::read(Path::new(&whole), &as_is)?;
    let at = all.messages.iter().position(which).ok_or("no such message")?;
    let sim_time_s = FORGED as f64 * STEP_S;
    let forged = |stamp: Option<Stamp>| stamp.map(|stamp| Stamp { step: FORGED, sim_time_s, ..stamp });
    let entry = &mut all.messages[at];
    entry.log_time = begin_ns + (sim_time_s * 1e9) as u64 + if entry.chunk() == "angles" { 1_000_000_000 } else { 0 };
    entry.data = if entry.chunk() == "angles" {
        let angles = Angles::decode(entry.data.as_slice())?;
        Angles { stamp: forged(angles.stamp), ..angles }.encode_to_vec()
    } else {
        let checkpoint = Checkpoint::decode(entry.data.as_slice())?;
        Checkpoint { stamp: forged(checkpoint.stamp), ..checkpoint }.encode_to_vec()
    };
    if ends {
        all.messages.truncate(at + 1);
    }
    all.recount();
    all.write(path)
}

#[test]
fn regress_a_forged_stamp_leads_nowhere() -> Outcome {
    let folder = tempfile::tempdir()?;
    let forged = folder.path().join("forged.mcap");
    let step = |entry: &Entry| Angles::decode(entry.data.as_slice()).ok()?.stamp.map(|stamp| stamp.step);
    forge(&forged, |entry| entry.chunk() == "angles" && step(entry) == Some(1000), true)?;
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

/// The first checkpoint, and the one at the end, in a file that goes on after it and in one that ends there.
#[test]
fn regress_a_forged_stamp_of_a_checkpoint_leads_nowhere() -> Outcome {
    let folder = tempfile::tempdir()?;
    let forged = folder.path().join("forged.mcap");
    let ended = |words: &[&str]| -> Outcome<(Option<i32>, String)> {
        let command = ["60", env!("CARGO_BIN_EXE_flexcrank")];
        let output = Command::new("timeout").args(command).args(words).arg(&forged).current_dir(folder.path()).output()?;
        Ok((output.status.code(), format!("{}{}", String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?)))
    };
    let step = |entry: &Entry| Checkpoint::decode(entry.data.as_slice()).ok()?.stamp.map(|stamp| stamp.step);
    let (begins_late, absent) = ("needs the session's start, and the recording begins later", "t = 5 s is not in the recording");
    let unproved = format!("no message or checkpoint comes between steps 3000 and {FORGED} of epoch 0");
    let over = format!("it is out of order, after step {FORGED} of epoch 0");
    let cases = [
        (0, false, "the log time falls at step 0 of epoch 0", [(1, begins_late), (2, absent)]),
        (0, true, "the last status does not say so", [(1, begins_late), (2, absent)]),
        (3000, false, over.as_str(), [(1, &unproved), (1, &unproved)]),
        (3000, true, "1 messages could not be re-simulated", [(1, &unproved), (1, &unproved)]),
    ];
    for (of, ends, finding, refused) in cases {
        forge(&forged, |entry| entry.chunk() == "checkpoint" && step(entry) == Some(of), ends)?;
        let (code, found) = ended(&["verify"])?;
        assert!(code == Some(1) && found.contains(finding), "of step {of}: {code:?} {found}");
        for (change, (expected, why)) in [["--set", "rod.density_kg_per_m3=2700"], ["--add-pulse", "5:1:0.1"]].iter().zip(refused)
        {
            let (code, said) = ended(&[&["what-if"][..], change].concat())?;
            assert!(code == Some(expected) && said.contains(why), "of step {of}, {change:?}: {code:?} {said}");
        }
    }
    Ok(())
}
