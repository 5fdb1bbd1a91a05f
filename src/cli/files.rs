//! `scenes` and `completions`.

use std::io::Write as _;

use clap::CommandFactory as _;

use super::args::Cli;
use super::exit_status::ExitStatus;
use crate::scene::builtin;

pub(super) fn scenes(name: Option<&str>) -> anyhow::Result<ExitStatus> {
    match name {
        None => {
            for scene in builtin::BUILTIN {
                writeln!(std::io::stdout(), "{:<24} {}", scene.name, scene.summary())?;
            }
        }
        Some(name) => write!(std::io::stdout(), "{}", builtin::find(name)?.text)?,
    }
    Ok(ExitStatus::Success)
}

/// Prints the completion script for a shell.
pub(super) fn completions(shell: clap_complete::Shell) -> anyhow::Result<ExitStatus> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "flexcrank", &mut script);
    std::io::stdout().write_all(&script)?;
    Ok(ExitStatus::Success)
}
