//! `scenes`, `guide` and `files`: what the program has to print.

use std::io::Write as _;
use std::path::Path;

use clap::CommandFactory as _;

use super::aligned_table;
use super::args::Cli;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::output::output;
use crate::recording::begins_as_mcap;
use crate::resimulation::RecordedSession;
use crate::scene::{self, KeyRow, builtin};
use crate::{files, guide};

pub(super) fn scenes(name: Option<&str>) -> CommandResult {
    match name {
        None => {
            for scene in builtin::BUILTIN {
                writeln!(output(), "{:<24} {}", scene.name, scene.summary())?;
            }
        }
        Some(name) if begins_as_mcap(Path::new(name)) => {
            write!(output(), "{}", RecordedSession::open(Path::new(name))?.scene.text)?;
        }
        Some(name) => write!(output(), "{}", builtin::find(name).map_err(|error| elsewhere(name, error))?.text)?,
    }
    Ok(ExitStatus::Success)
}

/// Prints the scene reference.
pub(super) fn keys(markdown: bool) -> CommandResult {
    if markdown {
        write!(output(), "{}", scene::reference_markdown())?;
        return Ok(ExitStatus::Success);
    }
    let head = ["table", "key", "type", "unit", "default", "range", "meaning"].map(str::to_owned).to_vec();
    let row = |row: KeyRow| {
        let KeyRow { table, key, kind, unit, default, range, meaning } = row;
        [table, key, &kind, unit, &default, &range, meaning].map(|cell| cell.replace('`', "")).to_vec()
    };
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(scene::reference().into_iter().map(row)).collect();
    aligned_table::print(&rows, usize::MAX)?;
    Ok(ExitStatus::Success)
}

/// Prints a chapter, or the list of chapters.
pub(super) fn guide(chapter: Option<&str>) -> CommandResult {
    let mut out = output();
    match chapter {
        None => guide::CHAPTERS.iter().try_for_each(|chapter| writeln!(out, "{:<14} {}", chapter.name, chapter.summary))?,
        Some(name) => write!(out, "{}", guide::find(name).map_err(|error| elsewhere(name, error))?.readable())?,
    }
    Ok(ExitStatus::Success)
}

/// Prints a file for another program, or the list of files.
pub(super) fn files(name: Option<&str>) -> CommandResult {
    let mut out = output();
    match name {
        None => files::FILES.iter().try_for_each(|file| writeln!(out, "{:<22} {}", file.name, file.summary))?,
        Some(name) => write!(out, "{}", files::find(name).map_err(|error| elsewhere(name, error))?.text)?,
    }
    Ok(ExitStatus::Success)
}

/// The refusal of a name that this command does not know, with the command that prints what has this name.
fn elsewhere(name: &str, unknown: impl Into<Failure>) -> Failure {
    let is_command = || Cli::command().get_subcommands().any(|command| command.get_name() == name && !command.is_hide_set());
    let way = if builtin::find(name).is_ok() {
        format!("a built-in scene: `flexcrank scenes {name}` prints it")
    } else if files::find(name).is_ok() {
        format!("a file of the program: `flexcrank files {name}` prints it")
    } else if guide::find(name).is_ok() {
        format!("a chapter of the guide: `flexcrank guide {name}` prints it")
    } else if is_command() {
        format!("a command: `flexcrank {name} --help` prints its help")
    } else {
        return unknown.into();
    };
    Failure::Usage(format!("{name}: is {way}"))
}

#[cfg(test)]
mod tests {
    use super::{files, guide, scenes};
    use crate::cli::failure::Failure;

    /// `files crank-slider` said that the program has no such file, and `files` lists no scene.
    #[test]
    fn regress_a_name_that_another_command_prints_leads_there() {
        let refused = |ended: super::CommandResult| match ended {
            Err(Failure::Usage(text)) => text,
            _ => String::new(),
        };
        for (ended, expected) in [
            (files(Some("crank-slider")), "crank-slider: is a built-in scene: `flexcrank scenes crank-slider` prints it"),
            (scenes(Some("sweep.toml")), "sweep.toml: is a file of the program: `flexcrank files sweep.toml` prints it"),
            (scenes(Some("campaigns")), "campaigns: is a chapter of the guide: `flexcrank guide campaigns` prints it"),
            (guide(Some("sweep")), "sweep: is a command: `flexcrank sweep --help` prints its help"),
        ] {
            assert_eq!(refused(ended), expected);
        }
        assert!(refused(files(Some("nosuch"))).contains("no such file in the program"));
    }
}
