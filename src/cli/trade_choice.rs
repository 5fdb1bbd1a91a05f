//! The choice of `trade`: printed, and written as a scene.

use std::io::Write as _;
use std::path::Path;

use toml_edit::{DocumentMut, Item};

use super::command_line::command_line;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::output::output;
use super::short_load::ShortLoad;
use crate::scene::{SceneSource, level_tables};
use crate::study::trade::{Choice, Chosen, Corrections, Levels, NoLevels};
use crate::whole_file::write_new;

/// Prints and writes the chosen settings, or returns why none were found.
pub(super) fn decide(
    write: Option<&Path>,
    source: &SceneSource,
    choice: &Choice,
    lost: impl FnOnce(&Chosen) -> Option<String>,
) -> CommandResult {
    let chosen = choice.as_ref().map_err(|refusal| Failure::Failed(refusal.to_string()))?;
    let keys = chosen.row.configuration.keys(&source.scene);
    let copy = source.with(&keys)?;
    let measured = measured(chosen, lost(chosen));
    let shown = writeln!(output(), "\n{measured}{}", tables(&keys));
    write_scene(write, &copy, &measured)?;
    shown?;
    warn(ShortLoad::warning_of_step(&copy.scene));
    if let Some(measured) = chosen.row.outcome.as_ref().ok().filter(|measured| !measured.balance_kept) {
        let (run, balance, remedy) = match measured.corrections {
            Corrections::NotAsked => ("run", "their energy balance", "with energy among the --outputs, more are tried"),
            _ => ("run --fixed-cost", "the energy balance of steps of fixed cost", "shorter --steps may"),
        };
        say!(
            "warning: `{run}` calls these settings not to be trusted, as {balance} is off: none that keeps it holds the demands; {remedy}"
        );
    }
    Ok(ExitStatus::Success)
}

/// Prints and writes the chosen levels, or returns why there are none.
pub(super) fn decide_levels(write: Option<&Path>, count: usize, levels: Result<Levels, NoLevels>) -> CommandResult {
    let levels = levels.map_err(|none| match none {
        NoLevels::Scene(refused) => Failure::from(refused),
        refusal => Failure::Failed(refusal.to_string()),
    })?;
    for passed in &levels.passed_over {
        say!("passed over: {}: {}", passed.configuration, passed.why);
    }
    if levels.levels.len() < count {
        say!("warning: {} levels instead of {count}: no other setting is worth a switch", levels.levels.len());
    }
    let shown = writeln!(output(), "\n{}\n{}", tables(&levels.keys), level_tables(&levels.tables));
    write_scene(write, &levels.source, "")?;
    shown?;
    warn(ShortLoad::warning_of(&levels.source));
    Ok(ExitStatus::Success)
}

/// Warns of a chosen step that is too long for a load of the slider: runs are not compared between steps.
fn warn(of_short_loads: Option<String>) {
    if let Some(warning) = of_short_loads {
        say!("warning: {warning}");
    }
}

/// Writes the scene to `--write`, with comments on its solver.
fn write_scene(write: Option<&Path>, scene: &SceneSource, comments: &str) -> CommandResult<()> {
    if let Some(path) = write {
        write_new(path, commented(scene, comments).as_bytes()).map_err(Failure::file(path))?;
        say!("wrote {}", path.display());
    }
    Ok(())
}

/// The scene with comments on its solver that name this choice, in place of what was said of an earlier one. They come last if there
/// is no `[solver]`, as of one that is written in a line.
fn commented(scene: &SceneSource, comments: &str) -> String {
    let Ok(mut document) = scene.text.parse::<DocumentMut>() else { return scene.text.clone() };
    let comments = format!("\n# Chosen by `{}`.\n{comments}", command_line());
    match document.get_mut("solver").and_then(Item::as_table_mut).filter(|solver| !solver.is_dotted()) {
        Some(solver) => solver.decor_mut().set_prefix(comments),
        None => return format!("{document}{comments}"),
    }
    document.to_string()
}

/// Measured errors and speed of the chosen settings, and the vibrations that they lose, as comments in TOML.
fn measured(chosen: &Chosen, lost: Option<String>) -> String {
    let (mark, error) = chosen.row.outcome.as_ref().map_or(("", f64::NAN), |measured| (measured.mark, measured.error));
    let trial = &chosen.trial;
    let mut text = lost.map_or(String::new(), |lost| format!("# {lost}\n"));
    text += &format!(
        "# error {mark}{error:.2e} at {:.4} times real time by its slowest repeat; {} {:.2e} at {:.4}\n",
        chosen.real_time_factor, trial.variation, trial.error, trial.real_time_factor
    );
    if let Some(error) = trial.long_energy {
        text += &format!("# energy balance over ten minutes: {error:.2e}\n");
    }
    text += &match chosen.passed_over {
        0 => String::new(),
        1 => "# (1 cheaper one held at first, but not when it was verified)\n".to_owned(),
        several => format!("# ({several} cheaper ones held at first, but not when they were verified)\n"),
    };
    text
}

/// `TABLE.KEY=VALUE` as TOML.
fn tables(keys: &[String]) -> String {
    let (mut text, mut table) = (String::new(), "");
    for (name, rest) in keys.iter().filter_map(|key| key.split_once('.')) {
        if name != table {
            text += &format!("[{name}]\n");
            table = name;
        }
        text += &format!("{}\n", rest.replacen('=', " = ", 1));
    }
    text
}
