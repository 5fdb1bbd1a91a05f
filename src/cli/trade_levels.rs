//! Levels of detail, after the table of a study.

use std::io::Write as _;

use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::output::output;
use super::trade::{Args, tables, write_scene};
use crate::scene::level_tables;
use crate::study::trade::{Levels, NoLevels};

/// Prints and writes the chosen levels, or explains why there are none.
pub(super) fn decide_levels(args: &Args, count: usize, levels: Result<Levels, NoLevels>) -> CommandResult {
    let levels = match levels {
        Ok(levels) => levels,
        Err(NoLevels::Scene(error)) => return Err(error.into()),
        Err(refusal) => {
            say!("refused: {refusal}");
            return Ok(ExitStatus::Refused);
        }
    };
    for passed in &levels.passed_over {
        say!("passed over: {}: {}", passed.configuration, passed.why);
    }
    if levels.levels.len() < count {
        say!("warning: {} levels instead of {count}: no other setting is worth a switch", levels.levels.len());
    }
    writeln!(output(), "\n{}\n{}", tables(&levels.keys), level_tables(&levels.tables))?;
    write_scene(args, &levels.source)?;
    Ok(ExitStatus::Success)
}
