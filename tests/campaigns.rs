//! Campaigns from the command line: what is not whole makes no table and no indices, and is not passed over.

use std::fs;
use std::path::Path;
use std::process::Command;

type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// Six runs, a chunk each.
const SPEC: &str = "scene = \"thesis-crank-slider\"\nset = [\"solver.model=rigid\", \"solver.integrator=runge-kutta\"]\n\
    until_s = 2\nmethod = \"sobol\"\nsamples = 2\n[[vary]]\nkey = \"rod.length_m\"\nmin = 1.2\nmax = 1.8\n";

/// The program in `folder`, without a share of a scheduler.
fn flexcrank(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(words).current_dir(folder).env_remove("SLURM_ARRAY_TASK_ID").env_remove("JOB_COMPLETION_INDEX");
    command
}

/// Runs a command; returns exit code and standard error.
fn ended(mut command: Command) -> Outcome<(Option<i32>, String)> {
    let output = command.output()?;
    Ok((output.status.code(), String::from_utf8(output.stderr)?))
}

#[test]
fn regress_indices_of_a_part_name_the_rows_that_are_missing() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("s.toml"), SPEC)?;
    let run = |words: &[&str]| ended(flexcrank(at, &[&["sweep", "s.toml"][..], words].concat()));
    assert_eq!(run(&["--shard", "1/2"])?.0, Some(0));
    let missing = "error: no scalar has indices: 3 of 6 rows are missing: 1, 3, 5; compute them first: run the sweep\n";
    assert_eq!(run(&["--indices"])?, (Some(1), missing.to_owned()));
    assert!(!at.join("s.sweep/indices.csv").exists(), "an empty table is no result");
    assert_eq!(run(&[])?.0, Some(0));
    assert_eq!(run(&["--indices"])?.0, Some(0));
    assert!(at.join("s.sweep/indices.csv").is_file());
    Ok(())
}

/// A list was unknown without its name, and a range a wrong time of the day.
#[test]
fn regress_a_wrong_list_of_a_campaign_is_refused_with_what_to_write() -> Outcome {
    let folder = tempfile::tempdir()?;
    let values = SPEC.replace("min = 1.2", "values = 1.2:1.8:0.1");
    for (spec, said) in [
        (SPEC.replace("vary", "vray"), "s.toml:6: [[vray]]: unknown key; did you mean `vary`? (known here"),
        (SPEC.replace("[[vary]]", "[vray]"), "s.toml:6: [vray]: unknown key; did you mean `vary`? (known here"),
        (values.clone(), "s.toml:8: not TOML: `1.2:1.8:0.1` is no number; a list has each of its values, in brackets"),
        (values.replace("1.2:1.8:0.1", "12:18:10"), "s.toml:8: values = 12:18:10: must be a list"),
        (values.replace("1.2:1.8:0.1", "1.2"), "s.toml:8: values = 1.2: must be a list, such as [1.2]"),
        (values.replace("1.2:1.8:0.1", "\"1, 2\""), "s.toml:8: values = \"1, 2\": must be a list\n"),
        (SPEC.replace("[[vary]]", "[[vray]] # it"), "s.toml:6: [[vray]]: unknown key; did you mean `vary`? (known here"),
        (
            SPEC.replace("sobol", "grid"),
            "s.toml: samples: a grid has as many as its values make; give each [[vary]] a count instead",
        ),
        (
            SPEC.replace("set = [", "set = \"rod.modes=1\" # ["),
            "s.toml:2: set = \"rod.modes=1\": must be a list, such as [\"rod.modes=1\"]",
        ),
    ] {
        fs::write(folder.path().join("s.toml"), &spec)?;
        let (code, refused) = ended(flexcrank(folder.path(), &["sweep", "s.toml"]))?;
        assert!(code == Some(2) && refused.starts_with(&format!("error: {said}")), "{spec}: {refused}");
    }
    Ok(())
}

/// The table was accepted, and never written.
#[test]
fn regress_a_table_is_refused_where_none_is_written() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("s.toml"), SPEC)?;
    let table = |words: &[&str]| flexcrank(at, &[&["sweep", "s.toml", "--table", "runs.csv"][..], words].concat());
    let scalars = ["--scalars", "peak_kinetic_j"];
    // Usage lines had named `--table FILE --scalars SCALAR --plot DIR`, which was refused.
    for (words, why) in [
        (&["--shard", "1/2"][..], "cannot be used with"),
        (&["--indices"], "give one command for each"),
        (&[&["--plot", "plots"][..], &scalars].concat(), "give one command for each"),
        (&["--plot", "plots"], "give one command for each"),
        (&scalars, "has all scalars"),
    ] {
        let (code, said) = ended(table(words))?;
        assert!(code == Some(2) && said.contains(why) && said.contains("--table"), "{words:?}: {said}");
    }
    let (code, said) = ended(flexcrank(at, &["sweep", "s.toml", "--plot", "plots"]))?;
    assert!(code == Some(2) && said.starts_with("error: --plot draws what --scalars names"), "{said}");
    let mut of_array = table(&[]);
    of_array.envs([("SLURM_ARRAY_TASK_ID", "1"), ("SLURM_ARRAY_TASK_MIN", "1"), ("SLURM_ARRAY_TASK_COUNT", "2")]);
    let (code, said) = ended(of_array)?;
    assert!(code == Some(2) && said.starts_with("error: --table runs.csv: the scheduler gives this worker a share"), "{said}");
    assert_eq!(fs::read_dir(at)?.count(), 1, "refused before any work");
    Ok(())
}

/// A campaign was "not an MCAP file" to readers of recordings, and a CSV table with an error to `plot`.
#[test]
fn regress_a_campaign_in_place_of_another_file_is_told_its_command() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("s.toml"), SPEC)?;
    let hint = ", but a campaign: `flexcrank sweep s.toml` runs it\n";
    for words in [
        &["info", "s.toml"][..],
        &["verify", "s.toml"],
        &["recover", "s.toml", "-o", "whole.mcap"],
        &["export", "s.toml", "--csv", "tables"],
        &["what-if", "s.toml", "--set", "slider.mass_kg=2", "--record", "changed.mcap"],
        &["replay", "s.toml", "--listen", "tcp/127.0.0.1:0"],
        &["run", "--no-bus", "--no-record", "--resume", "s.toml"],
    ] {
        let refusal = format!("error: s.toml: not an MCAP file{hint}");
        assert_eq!(ended(flexcrank(at, words))?, (Some(1), refusal), "{words:?}");
    }
    let refusal = format!("error: s.toml: neither a recording nor a table{hint}");
    assert_eq!(ended(flexcrank(at, &["plot", "s.toml"]))?, (Some(1), refusal));
    let refusal = format!("error: s.toml: not a service{hint}");
    assert_eq!(ended(flexcrank(at, &["watch", "s.toml", "--connect", "tcp/127.0.0.1:9"]))?, (Some(2), refusal));
    Ok(())
}

/// It was said to be larger than a specification may be, or not to be text.
#[test]
fn regress_a_recording_in_place_of_a_campaign_is_told_its_commands() -> Outcome {
    let folder = tempfile::tempdir()?;
    fs::copy("recordings/sample-three-pulses.mcap", folder.path().join("take.mcap"))?;
    let refusal = "error: take.mcap: is a recording, not a campaign: `flexcrank replay take.mcap` plays it; \
        `flexcrank files sweep.toml` prints a campaign\n";
    assert_eq!(ended(flexcrank(folder.path(), &["sweep", "take.mcap"]))?, (Some(2), refusal.to_owned()));
    Ok(())
}

/// A folder in place of a file of rows stands for a disk that is full.
#[test]
fn regress_a_worker_that_cannot_write_a_row_says_that_the_others_are_kept() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("s.toml"), SPEC)?;
    let sweep = || ended(flexcrank(at, &["sweep", "s.toml", "--jobs", "1"]));
    let (rows, kept) = (at.join("s.sweep/chunks-of-1"), "; the rows so far are kept: the same command goes on\n");
    fs::create_dir_all(rows.join("0000000.tsv"))?;
    let (code, said) = sweep()?;
    assert!(code == Some(1) && said.contains("0000000.tsv: ") && !said.contains("kept"), "nothing is kept: {said}");
    fs::rename(rows.join("0000000.tsv"), rows.join("0000003.tsv"))?;
    let (code, said) = sweep()?;
    assert!(code == Some(1) && said.contains("0000003.tsv: ") && said.ends_with(kept), "{said}");
    fs::remove_dir(rows.join("0000003.tsv"))?;
    assert_eq!(sweep()?.0, Some(0));
    Ok(())
}

/// A fixed number of one was warned of, and one that varies was not: its runs had no deflection between the pins.
#[test]
fn regress_sweep_warns_of_one_element_where_elements_varies() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    let said =
        "warning: runs with rod.elements = 1: the peaks of rod's deflection, moment and stress are those at its pins alone";
    for (values, is_said) in [("[1, 2]", true), ("[2, 4]", false)] {
        let vary = format!("[[vary]]\nkey = \"rod.elements\"\nvalues = {values}\n");
        fs::write(at.join("s.toml"), format!("scene = \"crank-slider\"\nuntil_s = 0.01\nmethod = \"grid\"\n{vary}"))?;
        let (code, stderr) = ended(flexcrank(at, &["sweep", "s.toml", "-o", values]))?;
        assert_eq!((code, stderr.contains(said)), (Some(0), is_said), "{values}: {stderr}");
    }
    Ok(())
}
