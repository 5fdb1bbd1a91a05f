//! A recording whose beginning is lost: what is said of it, and what can still be done.

use std::path::Path;
use std::process::Command;

use flexcrank::runtime::Pace;
use flexcrank::simulation::PublishRate;

use crate::common::{Outcome, Service, scene};

/// Exit code, and all that was said.
fn flexcrank(folder: &Path, arguments: &[&str]) -> Result<(Option<i32>, String), std::io::Error> {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).current_dir(folder).args(arguments).output()?;
    let said = [output.stdout, output.stderr].concat();
    Ok((output.status.code(), String::from_utf8_lossy(&said).into_owned()))
}

/// "Not an MCAP file" was all that was said of it, and `recover` said "lost: 0 messages" of what nothing can be computed from.
#[test]
fn regress_what_is_lost_with_the_beginning_is_said() -> Outcome {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(1.0), PublishRate::All)?.finish()?;
    let at = folder.path();
    let bytes = std::fs::read(at.join("run.mcap"))?;
    std::fs::write(at.join("headless.mcap"), &bytes[101..])?;
    std::fs::write(at.join("torso.mcap"), &bytes[101..bytes.len() - 1])?;
    std::fs::write(at.join("cut.mcap"), &bytes[..bytes.len() / 2])?;
    // From a record's beginning on, no byte is left over that belongs to none.
    let summary = mcap::Summary::read(&bytes)?.ok_or("no summary")?;
    let first_chunk = summary.chunk_indexes.iter().map(|chunk| chunk.chunk_start_offset as usize).min().ok_or("no chunk")?;
    std::fs::write(at.join("chunks.mcap"), [mcap::MAGIC, &bytes[first_chunk..]].concat())?;
    std::fs::write(at.join("noise.mcap"), "noise without an end")?;
    let beginning = "not an MCAP file, but it ends like one: its beginning is lost, and `flexcrank recover` saves what follows";
    for command in ["verify", "info", "plot"] {
        let (code, said) = flexcrank(at, &[command, "headless.mcap"])?;
        assert!(code == Some(1) && said.contains(beginning), "{command}: {code:?} {said}");
    }
    for broken in ["noise.mcap", "torso.mcap"] {
        let (_, said) = flexcrank(at, &["verify", broken])?;
        assert!(said.trim_end().ends_with("not an MCAP file"), "{broken}: {said}");
    }
    let lost = "lost: metadata and scene, so that the new file can be plotted, exported and replayed, but not verified, ";
    for (broken, whole, says) in [
        ("headless.mcap", "whole.mcap", true),
        ("chunks.mcap", "chunks-whole.mcap", true),
        ("torso.mcap", "torso-whole.mcap", true),
        ("cut.mcap", "cut-whole.mcap", false),
    ] {
        let (code, said) = flexcrank(at, &["recover", broken, "-o", whole])?;
        assert_eq!((code, said.contains(lost)), (Some(3), says), "{broken}: {said}");
        let (_, said) = flexcrank(at, &["info", whole])?;
        assert_eq!(said.contains("  session       none: metadata and scene are lost\n"), says, "{broken}: {said}");
    }
    for command in [&["plot", "whole.mcap", "-o", "figures"][..], &["export", "whole.mcap", "--csv", "tables"]] {
        let (code, said) = flexcrank(at, command)?;
        assert_eq!(code, Some(0), "{command:?}: {said}");
    }
    Ok(())
}
