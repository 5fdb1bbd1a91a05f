//! `scenes`, `guide` and `files`: what the program has to print.

use std::io::Write as _;
use std::path::Path;

use super::aligned_table;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
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
        Some(name) => write!(output(), "{}", builtin::find(name)?.text)?,
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
        Some(name) => write!(out, "{}", guide::find(name)?.readable())?,
    }
    Ok(ExitStatus::Success)
}

/// Prints a file for another program, or the list of files.
pub(super) fn files(name: Option<&str>) -> CommandResult {
    let mut out = output();
    match name {
        None => files::FILES.iter().try_for_each(|file| writeln!(out, "{:<22} {}", file.name, file.summary))?,
        Some(name) => write!(out, "{}", files::find(name)?.text)?,
    }
    Ok(ExitStatus::Success)
}
