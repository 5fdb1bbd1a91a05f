//! Campaigns: the same table whoever computes it, whatever becomes of the workers; every end is a row; specifications are refused by
//! name.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::num::NonZero;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use flexcrank::study::Table;
use flexcrank::study::sweep::{Campaign, Ending, NoIndices, Shard, Spec, SweepError, Worked, merge, points, sensitivity, work};

type Outcome = Result<(), Box<dyn std::error::Error>>;

const SCENE: &str =
    "scene = \"thesis-crank-slider\"\nset = [\"solver.model=rigid\", \"solver.integrator=runge-kutta\"]\nuntil_s = 2\n";
const ROD: &str = "[[vary]]\nkey = \"rod.length_m\"\nmin = 1.2\nmax = 1.8\n";
const PULSE: &str = "[[vary]]\nkey = \"pulse.1.torque_nm\"\nmin = -1\nmax = 1\n\
    [[pulse]]\nstart_s = 0.5\ntorque_nm = 0.0\nduration_s = 0.5\n";

fn campaign(text: &str) -> Result<Campaign, SweepError> {
    Campaign::new("test", Spec::parse("test", text)?)
}

/// Ninety-six runs in chunks of four.
fn sobol() -> Campaign {
    campaign(&format!("{SCENE}method = \"sobol\"\nsamples = 24\nchunk = 4\n{ROD}{PULSE}")).unwrap()
}

fn run(campaign: &Campaign, folder: &Path, shard: Option<&str>) -> Result<Worked, SweepError> {
    let shard = shard.map(|shard| shard.parse::<Shard>().unwrap());
    work(campaign, folder, shard, NonZero::<usize>::MIN, &|_| ControlFlow::Continue(()))
}

fn sha256(campaign: &Campaign, folder: &Path) -> Result<String, SweepError> {
    let merged = merge(campaign, folder, &folder.join("table.parquet"))?;
    assert_eq!((merged.missing, merged.rows), (vec![], campaign.runs()));
    Ok(merged.sha256)
}

fn undisturbed(campaign: &Campaign) -> Result<String, Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    run(campaign, folder.path(), None)?;
    Ok(sha256(campaign, folder.path())?)
}

fn chunk(folder: &Path, number: usize) -> PathBuf {
    folder.join(format!("chunks-of-4/{number:07}.tsv"))
}

#[test]
fn prop_shares_and_one_worker_make_the_same_table() -> Outcome {
    let (campaign, folder) = (sobol(), tempfile::tempdir()?);
    for (shard, missing) in [("3/3", 64), ("1/3", 32), ("2/3", 0)] {
        let worked = run(&campaign, folder.path(), Some(shard))?;
        assert_eq!((worked.rows, worked.computed, worked.left()), (32, 32, 0));
        let merged = merge(&campaign, folder.path(), &folder.path().join("table.parquet"))?;
        assert_eq!(
            merged.missing.iter().map(|range| range.end - range.start).sum::<u64>(),
            missing,
            "{shard}: {:?}",
            merged.missing
        );
    }
    assert_eq!(sha256(&campaign, folder.path())?, undisturbed(&campaign)?);
    Ok(())
}

#[test]
fn prop_no_two_workers_compute_the_same_row() -> Outcome {
    let (campaign, folder) = (sobol(), tempfile::tempdir()?);
    let computed = AtomicU64::new(0);
    thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| computed.fetch_add(run(&campaign, folder.path(), None).unwrap().computed, Ordering::Relaxed));
        }
    });
    assert_eq!(computed.into_inner(), campaign.runs());
    assert_eq!(sha256(&campaign, folder.path())?, undisturbed(&campaign)?);
    Ok(())
}

#[test]
fn prop_rows_that_a_kill_or_a_crash_damaged_are_computed_again() -> Outcome {
    let (campaign, folder) = (sobol(), tempfile::tempdir()?);
    run(&campaign, folder.path(), None)?;
    // A line without its end, a file without rows, a block of zeros, bytes that are not text.
    let torn = fs::read(chunk(folder.path(), 3))?;
    fs::write(chunk(folder.path(), 3), &torn[..torn.len() - 40])?;
    fs::write(chunk(folder.path(), 5), b"")?;
    fs::write(chunk(folder.path(), 6), [0; 4096])?;
    fs::write(chunk(folder.path(), 7), b"\xff\xfe\t\t\n")?;
    fs::remove_file(chunk(folder.path(), 8))?;
    let again = run(&campaign, folder.path(), None)?;
    assert_eq!((again.computed, again.found), (1 + 4 + 4 + 4 + 4, 79));
    assert_eq!(sha256(&campaign, folder.path())?, undisturbed(&campaign)?);
    assert_eq!(run(&campaign, folder.path(), None)?.computed, 0);
    Ok(())
}

#[test]
fn prop_an_interruption_keeps_the_rows_that_are_done() -> Outcome {
    let (campaign, folder) = (sobol(), tempfile::tempdir()?);
    let stop = |done| if done < 10 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
    let worked = work(&campaign, folder.path(), None, NonZero::<usize>::MIN, &stop)?;
    assert!(worked.interrupted && worked.computed == 10 && worked.left() == 86, "{worked:?}");
    let rest = run(&campaign, folder.path(), None)?;
    assert_eq!((rest.found, rest.computed), (10, 86));
    assert_eq!(sha256(&campaign, folder.path())?, undisturbed(&campaign)?);
    Ok(())
}

#[test]
fn prop_rows_of_another_specification_are_not_taken() -> Outcome {
    let folder = tempfile::tempdir()?;
    run(&sobol(), folder.path(), None)?;
    let longer = campaign(
        &format!("{SCENE}method = \"sobol\"\nsamples = 24\nchunk = 4\n{ROD}{PULSE}").replace("until_s = 2", "until_s = 3"),
    )?;
    assert_eq!(merge(&longer, folder.path(), &folder.path().join("table.parquet"))?.rows, 0);
    assert_eq!(run(&longer, folder.path(), None)?.computed, 96);
    assert_eq!(sha256(&longer, folder.path())?, undisturbed(&longer)?);
    // Nor are they lost; and a campaign that grows keeps its rows.
    let grown = campaign(&format!("{SCENE}method = \"sobol\"\nsamples = 25\nchunk = 4\n{ROD}{PULSE}"))?;
    assert_eq!(run(&grown, folder.path(), None)?.computed, 4);
    Ok(())
}

#[test]
fn prop_every_end_is_a_row_with_its_cause() -> Outcome {
    let text = "scene = \"thesis-crank-slider\"\nuntil_s = 22.8\nmethod = \"grid\"\n\
        [[vary]]\nkey = \"solver.weight\"\nvalues = [0.48, 0.55]\n[[vary]]\nkey = \"rod.length_m\"\nvalues = [1.5, -1]\n";
    let (campaign, folder) = (campaign(text)?, tempfile::tempdir()?);
    run(&campaign, folder.path(), None)?;
    let merged = merge(&campaign, folder.path(), &folder.path().join("table.parquet"))?;
    let count = |ending| merged.endings.get(&ending).copied();
    assert_eq!([Ending::Done, Ending::Diverged, Ending::Refused].map(count), [Some(1), Some(1), Some(2)]);
    assert_eq!(
        merged.causes.iter().map(|(ending, (run, _))| (*ending, *run)).collect::<Vec<_>>(),
        [(Ending::Diverged, 0), (Ending::Refused, 1)]
    );
    let rows = fs::read_to_string(folder.path().join("chunks-of-1/0000001.tsv"))?;
    assert!(rows.contains("refused") && rows.contains("rod.length_m = -1"), "{rows}");
    assert!(matches!(sensitivity(&campaign, folder.path(), &[]), Err(NoIndices::Method)));
    Ok(())
}

#[test]
fn prop_a_key_without_influence_has_no_sensitivity() -> Outcome {
    let base = "[[vary]]\nkey = \"commands.torque_limit_nm\"\nmin = 10\nmax = 20\n";
    let campaign = campaign(&format!("{SCENE}method = \"sobol\"\nsamples = 32\n{ROD}{base}"))?;
    let folder = tempfile::tempdir()?;
    run(&campaign, folder.path(), None)?;
    let wanted = "rod_peak_rate_rad_per_s".to_owned();
    let indices = sensitivity(&campaign, folder.path(), &[wanted])?;
    let [rate] = indices.as_slice() else { panic!("{indices:?}") };
    assert!(rate.keys[0].total > 0.9 && rate.keys[1].total == 0.0 && rate.keys[1].first == 0.0, "{rate:?}");
    let misspelt = sensitivity(&campaign, folder.path(), &["rod_peak_rate_rad_per".to_owned()]).unwrap_err().to_string();
    assert!(misspelt.contains("did you mean `rod_peak_rate_rad_per_s`?"), "{misspelt}");
    Ok(())
}

#[test]
fn prop_bad_specifications_are_refused_by_name() {
    let random = "method = \"random\"\nsamples = 4\n";
    for (text, reason) in [
        (format!("{SCENE}{random}"), "missing key `vary`"),
        (format!("{SCENE}methd = \"random\"\n{ROD}"), "did you mean `method`?"),
        (
            format!("{SCENE}method = \"sobl\"\n{ROD}"),
            "test:4: method = \"sobl\": unknown value; did you mean `sobol`? (known here: grid, random,",
        ),
        (format!("{SCENE}{random}{}", ROD.replace("1.2", "\"a\"")), "test:8: min = \"a\": must be a number"),
        (format!("{SCENE}{random}{}", ROD.replace("min", "mn")), "test:8: mn: unknown key"),
        (format!("{SCENE}method = \"random\"\n{ROD}"), "samples: is missing"),
        (format!("{SCENE}method = \"grid\"\nsamples = 3\n{ROD}count = 2\n"), "samples: a grid has as many"),
        (format!("{SCENE}method = \"grid\"\n{ROD}"), "count must be"),
        (format!("{SCENE}method = \"grid\"\n{ROD}count = 4.5\n"), "test:9: count = 4.5: must be a whole number from 2"),
        (format!("{SCENE}method = \"grid\"\n{ROD}count = -4\n"), "test:9: count = -4: must be a whole number from 2"),
        (format!("{SCENE}{random}seed = 1.5\n{ROD}"), "test:6: seed = 1.5: must be a whole number from 0"),
        (format!("{SCENE}{random}{ROD}{ROD}"), "test:10: vary.1 (rod.length_m): varies already"),
        (
            format!("{SCENE}{random}{}", ROD.replace("[[vary]]", "[vary]").repeat(2)),
            "test:10: [vary] is there twice: each entry of a list is a table [[vary]]",
        ),
        (
            format!("{SCENE}{random}{}", ROD.replace("[[vary]]", "[vary]")),
            "test:6: vary: must be a list, each entry in a table [[vary]]",
        ),
        (
            format!("{SCENE}{random}{ROD}{}", PULSE.replace("[[pulse]]", "[pulse]")),
            "test:14: pulse: must be a list, each entry in a table [[pulse]]",
        ),
        (format!("{SCENE}{random}vary = 3\n"), "test:6: vary: must be a list"),
        (
            format!("{SCENE}{random}{}", ROD.replace("1.2", "2")),
            "test:6: vary.0 (rod.length_m): min = 2.0, max = 1.8: min must be a number below max",
        ),
        (format!("{SCENE}{random}{}log = true\n", ROD.replace("1.2", "-1.2")), "log needs a min above 0"),
        (format!("{SCENE}{random}{ROD}values = [1]\n"), "give min and max"),
        (format!("{SCENE}{random}[[vary]]\nkey = \"rod.length_m\"\nvalues = []\n"), "values must not be empty"),
        (
            format!("{SCENE}{random}{}", ROD.replace("length", "lenght")),
            "test: vary.0.key = \"rod.lenght_m\": unknown key; did you mean `length_m`?",
        ),
        (
            format!("{SCENE}{random}{}", ROD.replace("rod", "rodd")),
            "test: vary.0.key = \"rodd.length_m\": unknown key; did you mean `rod`?",
        ),
        (
            format!("{SCENE}{random}{ROD}{}", PULSE.replace("pulse.1", "pulse.4")),
            "test: vary.1.key = \"pulse.4.torque_nm\": `pulse` has entries 0 to 1",
        ),
        (
            format!("{SCENE}{random}{}", ROD.replace("1.2", "-2").replace("1.8", "-1")),
            "test: vary.0.key = \"rod.length_m\": rod.length_m = -1.",
        ),
        (format!("{SCENE}{random}[[vary]]\nkey = \"a=b\"\nvalues = [1]\n"), "key must be a key"),
        (format!("{SCENE}method = \"sobol\"\nsamples = 1000000000\n{ROD}"), "at most 1000000000 runs"),
        (format!("{SCENE}method = \"sobol\"\nsamples = 18446744073709551615\n{ROD}"), ""),
        (SCENE.replace("2\n", "-2\n") + random + ROD, "until_s"),
        (format!("{SCENE}{random}{ROD}[[pulse]]\nstart_s = 1\n"), "missing key `torque_nm`"),
        (
            format!("{SCENE}{random}{ROD}").replace("thesis-crank-slider", "thesis-crank-slidr"),
            "did you mean `thesis-crank-slider`?",
        ),
        (
            format!("{SCENE}{random}{ROD}").replace("thesis-crank-slider", "nosuch.toml"),
            "test: scene = \"nosuch.toml\": not a built-in scene",
        ),
        (
            format!("{SCENE}{random}{ROD}").replace("model=rigid", "model=rigd"),
            "test: set \"solver.model=rigd\": solver.model = \"rigd\": must be one of",
        ),
        (
            format!("{SCENE}{random}{ROD}").replace("solver.model", "solvr.model"),
            "test: set \"solvr.model=rigid\": unknown key; did you mean `solver`?",
        ),
        ("\u{0}".to_owned(), "test"),
    ] {
        match campaign(&text) {
            Ok(_) => panic!("accepted: {text}"),
            Err(error) => assert!(error.to_string().contains(reason), "{text}: {error}"),
        }
    }
}

/// Runs the program in `folder`; returns exit code, standard output and standard error.
fn flexcrank(folder: &Path, words: &[&str]) -> Result<(Option<i32>, String, String), Box<dyn std::error::Error>> {
    let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(folder).output()?;
    Ok((output.status.code(), String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?))
}

#[test]
fn regress_a_folder_without_rows_is_refused_and_not_made() -> Outcome {
    let folder = tempfile::tempdir()?;
    fs::write(folder.path().join("s.toml"), format!("{SCENE}method = \"sobol\"\nsamples = 2\n{ROD}"))?;
    let refused = |rest: &[&str]| -> Outcome {
        let (code, _, said) = flexcrank(folder.path(), &[&["sweep", "s.toml", "-o", "none"][..], rest].concat())?;
        assert!(code == Some(1) && said.contains("no rows of this campaign in none: run the sweep first"), "{rest:?}: {said}");
        Ok(())
    };
    let plot: &[&str] = &["--plot", "plots", "--scalars", "peak_kinetic_j"];
    for rest in [&["--merge"][..], &["--indices"], plot] {
        refused(rest)?;
    }
    assert_eq!(fs::read_dir(folder.path())?.count(), 1);
    fs::create_dir(folder.path().join("none"))?;
    for rest in [&["--merge"][..], &["--indices"], plot] {
        refused(rest)?;
    }
    assert_eq!(fs::read_dir(folder.path().join("none"))?.count(), 0);
    Ok(())
}

#[test]
fn regress_the_ending_of_the_table_chooses_its_format() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("s.toml"), format!("{SCENE}method = \"sobol\"\nsamples = 2\n{ROD}"))?;
    let (code, _, said) = flexcrank(at, &["sweep", "s.toml", "--table", "runs.txt"])?;
    assert!(code == Some(2) && said.contains("a table ends in .csv or .parquet"), "{said}");
    assert_eq!(fs::read_dir(at)?.count(), 1, "refused before any work");
    let (code, printed, said) = flexcrank(at, &["sweep", "s.toml", "--table", "runs.csv"])?;
    assert!(code == Some(0) && printed.contains("runs.csv: 6 rows"), "{printed}{said}");
    let table = Table::read_csv(&at.join("runs.csv"))?;
    assert!(table.rows() == 6 && table.words("ending").is_some_and(|words| words.iter().all(|word| word == "done")));
    assert!(table.column("rod.length_m").is_some_and(|lengths| lengths.iter().all(|length| (1.2..=1.8).contains(length))));
    assert_eq!(flexcrank(at, &["sweep", "s.toml", "--merge", "--table", "runs.parquet"])?.0, Some(0));
    assert!(fs::read(at.join("runs.parquet"))?.starts_with(b"PAR1"));
    Ok(())
}

#[test]
fn regress_runs_that_do_not_end_well_are_warned_of() -> Outcome {
    let folder = tempfile::tempdir()?;
    let text = "scene = \"thesis-crank-slider\"\nset = [\"solver.model=rigid\"]\nuntil_s = 2\nmethod = \"grid\"\n\
        [[vary]]\nkey = \"rod.length_m\"\nvalues = [1.5, -1, -2]\n";
    fs::write(folder.path().join("s.toml"), text)?;
    let (code, printed, said) = flexcrank(folder.path(), &["sweep", "s.toml"])?;
    let warning = "warning: 2 runs ended as refused, such as run 1: vary: rod.length_m = -1: must be a number";
    assert!(code == Some(0) && said.contains(warning), "{said}");
    let seconds = printed.split("computed in ").nth(1).and_then(|rest| rest.split(" s,").next()).unwrap_or_default();
    let digits: String = seconds.split('e').next().unwrap_or_default().chars().filter(char::is_ascii_digit).collect();
    assert!(!digits.is_empty() && digits.trim_matches('0').len() <= 3, "{printed}");
    Ok(())
}

/// Steps of 0.02 s and 0.03 s do not resolve the bending: a single run of them ends with exit code 6.
const STEPS: &str = "scene = \"crank-slider\"\nuntil_s = 2\nmethod = \"grid\"\n\
    [[vary]]\nkey = \"solver.step_s\"\nvalues = [0.002, 0.02, 0.03]\n\
    [[vary]]\nkey = \"slider.mass_kg\"\nvalues = [0.1, 0.2, 0.3]\n";

#[test]
fn regress_runs_that_are_not_to_be_trusted_are_counted_apart_and_not_drawn() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("s.toml"), STEPS)?;
    let (code, printed, said) = flexcrank(at, &["sweep", "s.toml"])?;
    let counts = "\n         3  done\n         6  done, not to be trusted: the energy balance is off\n";
    assert!(code == Some(0) && printed.ends_with(counts), "{printed}");
    let warning = "warning: 6 runs ended unbalanced, such as run 3: not to be trusted: the energy balance was off by ";
    let remedy = "not to be trusted: `flexcrank check SCENE --until TIME` suggests a step; `flexcrank trade SCENE --tolerance ERROR --until TIME` chooses one; SCENE is the \
        campaign's scene with the values of run 3\n";
    assert!(said.starts_with(warning) && said.ends_with(remedy), "{said}");
    let drawn = flexcrank(at, &["sweep", "s.toml", "--plot", "plots", "--scalars", "pivot_peak_force_n"])?;
    assert!(drawn.0 == Some(0) && drawn.2.starts_with("warning: 6 runs not drawn: "), "{drawn:?}");
    let campaign = Campaign::open(&at.join("s.toml"))?;
    let points = points(&campaign, &at.join("s.sweep"), &["pivot_peak_force_n".to_owned()])?;
    assert_eq!((points.keys[0].values.clone(), points.left_out), (vec![0.002; 3], 6));
    Ok(())
}

#[test]
fn regress_runs_out_of_the_models_range_are_counted_apart_and_warned_of() -> Outcome {
    let folder = tempfile::tempdir()?;
    let text = "scene = \"crank-slider\"\nuntil_s = 0.5\nmethod = \"grid\"\n\
        [[vary]]\nkey = \"pulse.0.torque_nm\"\nvalues = [20, 60, 100]\n";
    fs::write(folder.path().join("s.toml"), text)?;
    let (code, printed, said) = flexcrank(folder.path(), &["sweep", "s.toml"])?;
    let counts = "\n         1  done\n         2  done, out of the model's range: a link was bent too far\n";
    assert!(code == Some(0) && printed.ends_with(counts), "{printed}");
    let example = "such as run 1: out of the model's range: a link was bent by 25.0° from its chord\n";
    assert_eq!(said, format!("warning: 2 runs bent a link too far, {example}"));
    Ok(())
}

#[test]
fn regress_samples_of_runs_that_are_not_to_be_trusted_have_no_indices() -> Outcome {
    // The thesis's integrator takes energy away in steps of 0.1 s.
    let two_point = SCENE.replace("runge-kutta", "two-point");
    let (campaign, folder) = (campaign(&format!("{two_point}method = \"sobol\"\nsamples = 2\n{ROD}"))?, tempfile::tempdir()?);
    run(&campaign, folder.path(), None)?;
    let merged = merge(&campaign, folder.path(), &folder.path().join("table.parquet"))?;
    assert_eq!((merged.rows, merged.untrusted.map(|untrusted| untrusted.count)), (6, Some(6)));
    assert!(sensitivity(&campaign, folder.path(), &[])?.is_empty());
    Ok(())
}

#[test]
fn regress_a_listed_value_that_its_key_never_allows_is_warned_of_before() -> Outcome {
    let folder = tempfile::tempdir()?;
    // A rod of 0.4 m is long enough for a crank of 0.3 m.
    let text = "scene = \"crank-slider\"\nset = [\"solver.model=rigid\"]\nuntil_s = 0.01\nmethod = \"grid\"\n\
        [[vary]]\nkey = \"slider.mass_kg\"\nvalues = [0.1, -3]\n[[vary]]\nkey = \"rod.length_m\"\nvalues = [1.5, 0.4]\n\
        [[vary]]\nkey = \"crank.length_m\"\nvalues = [0.5, 0.3]\n";
    fs::write(folder.path().join("s.toml"), text)?;
    let (code, _, said) = flexcrank(folder.path(), &["sweep", "s.toml"])?;
    let warning = "warning: slider.mass_kg = -3: must be a number from 0 to 1e9; its 4 runs will be refused\n";
    assert!(code == Some(0) && said.starts_with(warning) && said.matches("will be refused").count() == 1, "{said}");
    assert!(said.contains("warning: 5 runs ended as refused"), "{said}");
    Ok(())
}

#[test]
fn regress_a_scene_and_a_campaign_are_told_the_command_of_the_other() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    fs::write(at.join("s.toml"), format!("{SCENE}method = \"sobol\"\nsamples = 2\n{ROD}"))?;
    let (_, scene, _) = flexcrank(at, &["scenes", "thesis-beam"])?;
    let (mechanism, _) = scene.split_once("[solver]").ok_or("no [solver]")?;
    fs::write(at.join("mine.toml"), mechanism)?;
    for words in [&["run", "s.toml", "--no-bus"][..], &["check", "s.toml", "--set", "rod.length_m=1"], &["trade", "s.toml"]] {
        let (code, _, said) = flexcrank(at, words)?;
        let hint = "error: s.toml: is a campaign, not a scene: `flexcrank sweep s.toml` runs it\n";
        assert!(code == Some(2) && said == hint, "{words:?}: {said}");
    }
    for name in ["mine.toml", "thesis-beam"] {
        let (code, _, said) = flexcrank(at, &["sweep", name])?;
        let hint = format!("error: {name}: is a scene, not a campaign: `flexcrank run {name}` runs it; ");
        assert!(code == Some(2) && said.starts_with(&hint), "{said}");
    }
    assert_eq!(fs::read_dir(at)?.count(), 2, "nothing is made");
    Ok(())
}
