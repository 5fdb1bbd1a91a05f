//! The command line: parse, validate, run, exit code.

/// Prints a line to standard error, and ignores failure: if the terminal is gone, the command still runs to its end.
macro_rules! say {
    ($($said:tt)*) => {
        std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("{}\n", format_args!($($said)*))).unwrap_or(())
    };
}

mod aligned_table;
mod args;
mod clients;
mod cycle;
mod files;
mod keyboard;
mod live;
mod log;
mod plot;
mod progress;
mod recover;
mod replay;
mod resume;
mod sequence;
mod signals;
mod stability;
mod status_line;
mod trade;
mod verify;
mod watch;
mod what_if;

use std::path::Path;
use std::process::ExitCode;

use anyhow::Context as _;

use crate::bus::{BadName, BusError};
use crate::guide::UnknownChapter;
use crate::plot::PlotError;
use crate::recording::RecordingError;
use crate::resimulation::ResimulationError;
use crate::scene::SceneError;
use crate::service::ServiceError;
use crate::simulation::BuildError;
use crate::study::cycle::CycleError;
use crate::study::stability::{NoMap, NotSuited};
use crate::study::trade::TradeError;
use args::{Cli, Command};

/// How a command ended, by exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ExitStatus {
    /// Success: 0.
    Success,
    /// A service refused the command: 1.
    Refused,
    /// Finished with losses: 3.
    Lossy,
    /// The simulation diverged: 4.
    Diverged,
    /// A deadline was missed with `--overrun stop`: 5.
    Late,
    /// Finished, but the energy balance was off: 6.
    Untrusted,
}

/// Runs the program on the process's arguments.
///
/// Exit codes: 0 done, 1 failed, 2 usage or bad scene, 3 finished but lossy, 4 diverged, 5 too late, 6 finished, not to be
/// trusted (energy).
pub fn main() -> ExitCode {
    let cli = Cli::of_process();
    log::begin(cli.log_format);
    match dispatch(cli) {
        Ok(ExitStatus::Success) => ExitCode::SUCCESS,
        Ok(ExitStatus::Refused) => ExitCode::from(1),
        Ok(ExitStatus::Lossy) => ExitCode::from(3),
        Ok(ExitStatus::Diverged) => ExitCode::from(4),
        Ok(ExitStatus::Late) => ExitCode::from(5),
        Ok(ExitStatus::Untrusted) => ExitCode::from(6),
        // The reader of the output has closed it.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            say!("error: {error:#}");
            ExitCode::from(if is_usage(&error) { 2 } else { 1 })
        }
    }
}

/// Rounds simulated time for display: n·h, which is published to the last bit, may be 1.5010000000000001.
fn shown_s(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}

/// A count with its noun, singular or plural.
fn counted(count: u64, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

fn may_be_folder(path: &Path) -> anyhow::Result<()> {
    anyhow::ensure!(!path.is_file(), "{}: is a file, and a folder is needed", path.display());
    Ok(())
}

/// Creates an output folder, unless it exists.
fn make_folder(path: &Path) -> anyhow::Result<()> {
    may_be_folder(path)?;
    std::fs::create_dir_all(path).with_context(|| path.display().to_string())
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
}

fn is_usage(error: &anyhow::Error) -> bool {
    error.is::<SceneError>()
        || error.is::<UnknownChapter>()
        || error.is::<BuildError>()
        || error.is::<BadName>()
        || error.is::<plot::BadPlot>()
        || error.is::<sequence::BadSequence>()
        || error.downcast_ref::<PlotError>().is_some_and(PlotError::is_usage)
        || error.downcast_ref::<ResimulationError>().is_some_and(ResimulationError::is_usage)
        || error.is::<NotSuited>()
        || error.is::<NoMap>()
        || error.is::<CycleError>()
        || error.downcast_ref::<TradeError>().is_some_and(|error| !matches!(error, TradeError::NoReference(_)))
        || error
            .downcast_ref::<RecordingError>()
            .is_some_and(|error| matches!(error, RecordingError::Column { .. } | RecordingError::Outside { .. }))
        || error
            .downcast_ref::<ServiceError>()
            .is_some_and(|error| matches!(error, ServiceError::NoTopic { .. } | ServiceError::PastTheEnd { .. }))
        || error.downcast_ref::<BusError>().is_some_and(|error| matches!(error, BusError::Config(_) | BusError::File { .. }))
}

fn dispatch(cli: Cli) -> anyhow::Result<ExitStatus> {
    match cli.command.unwrap_or_default() {
        Command::Run(run) => live::run(*run),
        Command::Replay(args) if args.what_if.is_asked() => what_if::what_if(&args.file, &args.what_if),
        Command::Replay(args) => replay::replay(*args),
        Command::List(bus) => clients::list(&bus),
        Command::Pulse(pulse) => clients::pulse(pulse),
        Command::Control(control) => clients::control(control),
        Command::Watch(target) => watch::watch(&target),
        Command::Verify(args) => verify::verify(&args),
        Command::Recover(args) => recover::recover(&args),
        Command::Export(export) => files::export(export),
        Command::Plot(args) => plot::plot(&args),
        Command::Stability(args) => stability::stability(&args),
        Command::Cycle(args) => cycle::cycle(&args),
        Command::Trade(args) => trade::trade(&args),
        Command::Scenes { keys: true, markdown, .. } => files::keys(markdown),
        Command::Scenes { name, .. } => files::scenes(name.as_deref()),
        Command::Guide { chapter } => files::guide(chapter.as_deref()),
        Command::Completions { shell } => files::completions(shell),
    }
}
