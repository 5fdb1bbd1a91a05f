//! Ends of runs and of recordings, and what is not in them.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

type Outcome = Result<(), Box<dyn Error>>;

fn flexcrank(at: &Path, words: &str) -> Result<Output, Box<dyn Error>> {
    Ok(Command::new(env!("CARGO_BIN_EXE_flexcrank")).current_dir(at).args(words.split(' ')).output()?)
}

fn said(output: &Output) -> Result<String, Box<dyn Error>> {
    Ok(String::from_utf8(output.stderr.clone())?)
}

/// `--until 1` ended at 0.99999 s, and an instant of 1 s was refused, as the recording "ends at 1.000 s"; a campaign of the same scene
/// ended a step later.
#[test]
fn regress_a_run_ends_with_the_first_step_at_its_end_or_behind_it() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    for (step, until, end) in
        [("3e-4", "0.1", "0.1002"), ("3e-4", "0.03", "0.03"), ("1e-4", "0.1", "0.1"), ("7e-4", "0.0008", "0.0014")]
    {
        let run = format!("run crank-slider --set solver.step_s={step} --no-bus --pace max --publish-hz all");
        let ran = flexcrank(at, &format!("{run} --until {until} --record {step}-{until}.mcap"))?;
        assert_eq!(ran.status.code(), Some(0), "{ran:?}");
        let added = format!("what-if {step}-{until}.mcap --add-pulse {end}:0.1:0.1");
        let (refused, later) = (said(&flexcrank(at, &added)?)?, format!("what-if {step}-{until}.mcap --add-pulse 9:1:0.1"));
        assert!(refused.contains(&format!("nothing is recorded after t = {end} s")), "{refused}");
        let refused = said(&flexcrank(at, &later)?)?;
        assert!(refused.contains(&format!("t = 9 s is not in the recording, which ends at {end} s")), "{refused}");
    }
    Ok(())
}

/// `info` counts the samples of the chunk that was cut off, which no checksum covers: an instant among them was denied, with no way to it.
#[test]
fn regress_an_instant_in_a_cut_chunk_is_led_to_recover() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    flexcrank(at, "run crank-slider --no-bus --pace max --publish-hz all --until 1 --record whole.mcap")?;
    let whole = fs::read(at.join("whole.mcap"))?;
    fs::write(at.join("cut.mcap"), &whole[..whole.len() * 3 / 5])?;
    for words in ["what-if cut.mcap --add-pulse 0.9:1:0.05", "modes cut.mcap@0.9"] {
        let refused = flexcrank(at, words)?;
        let said = said(&refused)?;
        let told = said.contains("t = 0.9 s is not in the whole chunks of the recording, which end at ");
        assert!(refused.status.code() == Some(2) && told && said.contains("`flexcrank recover` saves what"), "{said}");
    }
    Ok(())
}

/// All runs of the campaign are too coarse: that was told as "no run that ended well knows these scalars".
#[test]
fn regress_a_plot_of_runs_that_are_not_to_be_trusted_says_so() -> Outcome {
    let folder = tempfile::tempdir()?;
    let at = folder.path();
    let coarse = "set = ['solver.model=finite-element', 'solver.integrator=two-point', 'solver.step_s=0.02']";
    let campaign = format!(
        "scene = 'ref-r2s'\n{coarse}\nuntil_s = 1.0\nmethod = 'grid'\n[[vary]]\nkey = 'slider.mass_kg'\nvalues = [0.1, 0.2, 0.3]\n"
    );
    fs::write(at.join("s.toml"), campaign)?;
    let swept = flexcrank(at, "sweep s.toml")?;
    assert!(said(&swept)?.contains("not to be trusted") || said(&swept)?.contains("diverged"), "{swept:?}");
    let drawn = flexcrank(at, "sweep s.toml --plot plots --scalars driving_peak_torque_nm")?;
    let told = "nothing to draw: no run ended well and can be trusted (3 runs); see the columns `ending`, `cause` and `verdict`";
    assert!(drawn.status.code() == Some(1) && said(&drawn)?.contains(told), "{drawn:?}");
    Ok(())
}
