//! Commands that fail leave nothing under the final name.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::Outcome;
use crate::{flexcrank, sample};

/// Exit code and standard error of the program in a folder.
fn ended(folder: &Path, words: &[&str]) -> Outcome<(Option<i32>, String)> {
    let output = flexcrank(words).current_dir(folder).stdin(Stdio::null()).output()?;
    Ok((output.status.code(), String::from_utf8(output.stderr)?))
}

fn files(folder: &Path) -> Outcome<Vec<String>> {
    let names = std::fs::read_dir(folder)?.map(|file| Ok(file?.file_name().to_string_lossy().into_owned()));
    names.collect()
}

#[test]
fn regress_a_what_if_that_is_refused_leaves_nothing() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = sample("sample-three-pulses.mcap");
    for (pulse, why) in
        [("300:5:0.1", "t = 300 s is not in the recording"), ("3:1e9:0.1", "the pulse added at t = 3 s is refused")]
    {
        for record in [&["--record", "w.mcap"][..], &[]] {
            let words = [&["what-if", &sample, "--add-pulse", pulse][..], record].concat();
            let (code, said) = ended(folder.path(), &words)?;
            assert!(code == Some(2) && said.contains(why) && !said.contains("recorded pulse"), "{words:?}: {code:?} {said}");
            assert!(files(folder.path())?.is_empty(), "{words:?}: {:?}", files(folder.path())?);
        }
    }
    let (code, said) = ended(folder.path(), &["what-if", &sample, "--add-pulse", "3:5:0.1", "--record", "w.mcap"])?;
    assert_eq!((code, files(folder.path())?), (Some(0), vec!["w.mcap".to_owned()]), "{said}");
    let (code, said) = ended(folder.path(), &["what-if", &sample, "--add-pulse", "3:5:0.1", "--record", "w.mcap"])?;
    assert!(code == Some(1) && said.contains("exists already"), "{said}");
    assert_eq!(ended(folder.path(), &["verify", "w.mcap"])?.0, Some(0));
    assert_eq!(ended(folder.path(), &["what-if", &sample, "--add-pulse", "3:5:0.1"])?.0, Some(0));
    assert_eq!(files(&folder.path().join("recordings"))?.len(), 1, "in the default folder, which is made");
    Ok(())
}

#[test]
fn regress_a_what_if_of_a_broken_recording_says_so() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    let mut bytes = std::fs::read(sample("sample-three-pulses.mcap"))?;
    std::fs::write(at.join("cut.mcap"), &bytes[..bytes.len() / 2])?;
    let middle = bytes.len() / 2;
    bytes[middle..middle + 3].fill(0xff);
    std::fs::write(at.join("damaged.mcap"), &bytes)?;
    for (file, why) in [
        ("cut.mcap", "warning: the recording ends early (still being recorded, or cut off); its whole chunks, up to t = "),
        ("damaged.mcap", "warning: the recording is damaged in 1 place, and the result lacks what is lost there: byte "),
    ] {
        let words = ["what-if", file, "--set", "rod.density_kg_per_m3=2700", "--record", &format!("other-{file}")];
        let (code, said) = ended(at, &words)?;
        assert!(code == Some(3) && said.starts_with(why), "{file}: {code:?} {said}");
        assert!(at.join(format!("other-{file}")).exists(), "{file}: what could be done is done");
    }
    assert_eq!(ended(at, &["verify", "other-cut.mcap"])?.0, Some(0));
    let described = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(["info", "damaged.mcap"]).current_dir(at).output()?;
    let said = String::from_utf8(described.stdout)?;
    assert!(described.status.code() == Some(3) && said.contains("in 1 place, first at byte"), "{said}");
    assert!(said.contains(", 6 s"), "what comes after the damage is listed: {said}");
    let verified =
        Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(["verify", "other-damaged.mcap"]).current_dir(at).output()?;
    let said = String::from_utf8(verified.stdout)?;
    assert!(verified.status.code() == Some(3) && said.contains("the recording that it was computed from lacks them"), "{said}");
    Ok(())
}

/// Exit code and standard error where files may have at most this many blocks of 512 bytes, as on a full disk.
fn on_a_full_disk(folder: &Path, blocks: u32, words: &[&str]) -> Outcome<(Option<i32>, String)> {
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_flexcrank")]).args(words).current_dir(folder);
    let output = command.stdin(Stdio::null()).output()?;
    Ok((output.status.code(), String::from_utf8(output.stderr)?))
}

#[test]
fn regress_a_full_disk_is_named_and_leaves_nothing() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = sample("sample-three-pulses.mcap");
    for (blocks, words) in [
        (20, &["recover", &sample, "-o", "whole.mcap"][..]),
        (20, &["what-if", &sample, "--add-pulse", "3:5:0.1", "--record", "w.mcap"]),
        (0, &["run", "--no-bus", "--until", "1", "--pace", "max", "--record", "run.mcap"]),
    ] {
        let (code, said) = on_a_full_disk(folder.path(), blocks, words)?;
        assert!(code == Some(1) && said.contains(".mcap: File too large"), "{words:?}: {code:?} {said}");
        assert!(files(folder.path())?.is_empty(), "{words:?}: {:?}", files(folder.path())?);
    }
    Ok(())
}

/// Tables and pictures were given up as their summary could not be printed.
#[test]
fn regress_files_are_written_although_standard_output_is_full() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    for (line, tables, pictures) in [
        ("modes crank-slider --count 2 --csv m.csv --plot shapes", &["m.csv"][..], Some(("shapes", 4))),
        ("modes crank-slider --angle 0:10:10 --json --csv a.csv", &["a.csv"], None),
        ("response crank-slider --csv r.csv --step-csv t.csv --plot drawn", &["r.csv", "t.csv"], Some(("drawn", 4))),
        ("cycle --csv c.csv", &["c.csv"], None),
        (
            "trade ref-r1 --models rigid --until 0.2 --steps 1e-3 --budget 4 --outputs angle --csv w.csv --plot w.svg",
            &["w.csv", "w.svg"],
            None,
        ),
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full")?;
        let mut command = flexcrank(&line.split(' ').collect::<Vec<_>>());
        let output = command.current_dir(folder.path()).stdin(Stdio::null()).stdout(full).output()?;
        let said = String::from_utf8(output.stderr)?;
        let named = said.contains("error: standard output: No space left");
        assert!(output.status.code() == Some(1) && named, "{line}: {said}");
        assert!(tables.iter().all(|table| at(table).is_file()), "{line}: {:?}", files(folder.path())?);
        if let Some((drawn, count)) = pictures {
            assert_eq!(files(&at(drawn))?.len(), count, "{line}");
        }
    }
    Ok(())
}

/// The name of the unfinished file was longer than a name may be.
#[test]
fn regress_recordings_may_have_the_longest_names() -> Outcome {
    let folder = tempfile::tempdir()?;
    let [recovered, computed] = ["r", "w"].map(|letter| format!("{}.mcap", letter.repeat(250)));
    let (code, said) = ended(folder.path(), &["recover", &sample("sample-truncated.mcap"), "-o", &recovered])?;
    assert!(matches!(code, Some(0 | 3)), "{code:?} {said}");
    let whole = sample("sample-three-pulses.mcap");
    let (code, said) = ended(folder.path(), &["what-if", &whole, "--add-pulse", "3:5:0.1", "--record", &computed])?;
    assert_eq!(code, Some(0), "{said}");
    let mut names = files(folder.path())?;
    names.sort();
    assert_eq!(names, [recovered, computed]);
    Ok(())
}

#[test]
fn prop_recover_replaces_nothing_and_creates_no_folder() -> Outcome {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("there.mcap"), "mine")?;
    let sample = sample("sample-truncated.mcap");
    let (code, said) = ended(folder.path(), &["recover", &sample, "-o", "there.mcap"])?;
    assert!(code == Some(1) && said.contains("exists already"), "{said}");
    assert_eq!(std::fs::read(folder.path().join("there.mcap"))?, b"mine");
    let (code, said) = ended(folder.path(), &["recover", &sample, "-o", "nosuch/whole.mcap"])?;
    assert!(code == Some(1) && said.contains("nosuch/whole.mcap: the folder nosuch does not exist"), "{said}");
    assert_eq!(files(folder.path())?, ["there.mcap"]);
    Ok(())
}

#[test]
fn regress_an_export_of_times_alone_has_tables() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = sample("sample-three-pulses.mcap");
    let (code, said) = ended(folder.path(), &["export", &sample, "--csv", "t", "--columns", "log_time"])?;
    assert_eq!(code, Some(0), "{said}");
    let angles = std::fs::read_to_string(folder.path().join("t/flexcrank.crank.angles.csv"))?;
    assert_eq!(angles.lines().next(), Some("log_time,publish_time,stamp.sim_time_s"));
    Ok(())
}

#[test]
fn regress_an_export_says_how_many_tables_it_replaced() -> Outcome {
    let folder = tempfile::tempdir()?;
    let sample = sample("sample-three-pulses.mcap");
    let words = ["export", &sample, "--csv", "t", "--parquet", "t", "--to", "0.1"];
    let tables = |folder: &Path| files(&folder.join("t")).map(|files| files.len());
    assert_eq!(ended(folder.path(), &words)?, (Some(0), String::new()));
    let count = tables(folder.path())?;
    let angles = folder.path().join("t/flexcrank.crank.angles.csv");
    std::fs::write(&angles, "of another recording")?;
    assert_eq!(ended(folder.path(), &words)?, (Some(0), format!("replaced {count} tables of the same names\n")));
    assert_eq!(tables(folder.path())?, count);
    assert!(std::fs::read_to_string(angles)?.starts_with("log_time,publish_time,"));
    Ok(())
}

#[test]
fn regress_a_recording_without_protobuf_is_named_so() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut writer = mcap::Writer::new(std::fs::File::create(folder.path().join("robot.mcap"))?)?;
    let channel_id = writer.add_channel(0, "/log", "json", &Default::default())?;
    writer
        .write_to_known_channel(&mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 }, b"{}")?;
    writer.finish()?;
    for words in [&["export", "robot.mcap", "--csv", "t"][..], &["plot", "robot.mcap", "-o", "p"]] {
        let (code, said) = ended(folder.path(), words)?;
        assert!(code == Some(1) && said.contains("no topic is protobuf, so none can be decoded: /log"), "{words:?}: {said}");
    }
    Ok(())
}
