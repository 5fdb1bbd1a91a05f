//! Shell completions: the shell asks the program itself, so that they know scenes, services and recordings.

use std::ffi::OsStr;
use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

use clap_complete::engine::{CompletionCandidate, PathCompleter, ValueCompleter as _};
use clap_complete::env::{CompleteEnv, Shells};

use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::output::output;
use crate::bus::{self, BusOptions, client};
use crate::scene::{INTEGRATORS, MODELS, ModelKind, builtin};

/// Environment variable by which the shell asks for completions.
const VARIABLE: &str = "FLEXCRANK_COMPLETE";
/// Time to look for services.
const PATIENCE: Duration = Duration::from_millis(300);

/// Answers the shell from the command line's definition and ends the process, if the shell has asked.
pub(super) fn answer_shell(definition: fn() -> clap::Command) {
    CompleteEnv::with_factory(definition).var(VARIABLE).complete();
}

/// Prints the script that makes a shell ask for completions.
pub(super) fn completions(shell: clap_complete::Shell) -> CommandResult {
    let shell = shell.to_string();
    let known = Shells::builtins();
    let completer = known.completer(&shell).ok_or_else(|| Failure::Failed(format!("no completions for {shell}")))?;
    let mut script = Vec::new();
    completer.write_registration(VARIABLE, "flexcrank", "flexcrank", "flexcrank", &mut script)?;
    output().write_all(&script)?;
    Ok(ExitStatus::Success)
}

/// Built-in scenes, and TOML files.
pub(super) fn scenes(current: &OsStr) -> Vec<CompletionCandidate> {
    let scenes = builtin::BUILTIN.iter().map(|scene| CompletionCandidate::new(scene.name).help(Some(scene.summary().into())));
    let named = scenes.filter(|scene| starts_with(scene, current));
    named.chain(files(current, "toml")).collect()
}

/// Recordings.
pub(super) fn recordings(current: &OsStr) -> Vec<CompletionCandidate> {
    files(current, "mcap")
}

/// The services on this machine.
pub(super) fn services() -> Vec<CompletionCandidate> {
    let Ok(session) = BusOptions::default().open_client() else { return Vec::new() };
    let found = client::services(&session, PATIENCE, |found| !found.is_empty()).unwrap_or_default();
    // The process ends at once.
    let _ = bus::close(&session);
    found.iter().map(|name| CompletionCandidate::new(name.to_string())).collect()
}

pub(super) fn models() -> Vec<CompletionCandidate> {
    MODELS.iter().filter(|(_, model)| *model != ModelKind::MassSpring).map(|(word, _)| CompletionCandidate::new(word)).collect()
}

pub(super) fn integrators() -> Vec<CompletionCandidate> {
    INTEGRATORS.iter().map(|(word, _)| CompletionCandidate::new(word)).collect()
}

fn files(current: &OsStr, extension: &'static str) -> Vec<CompletionCandidate> {
    let wanted = move |path: &Path| path.extension().is_some_and(|found| found == extension);
    PathCompleter::any().filter(wanted).complete(current)
}

fn starts_with(candidate: &CompletionCandidate, current: &OsStr) -> bool {
    candidate.get_value().to_string_lossy().starts_with(&*current.to_string_lossy())
}
