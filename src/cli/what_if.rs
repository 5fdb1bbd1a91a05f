//! `replay --what-if`: a recorded session re-simulated with a change.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::exit_status::ExitStatus;
use super::progress::over_file;
use crate::recording::{Written, paths};
use crate::resimulation::{AddedPulse, Change, LargestDifference, RecordedSession, WhatIfOutcome, what_if as compute};

/// Options of a replay that do not apply to a what-if, which publishes nothing.
const REPLAY_ONLY_OPTIONS: [&str; 16] = [
    "rate",
    "looped",
    "start_offset",
    "duration",
    "start_paused",
    "delay",
    "topics",
    "remap",
    "name",
    "commands",
    "wait_for",
    "wait_timeout",
    "force",
    "listen",
    "connect",
    "zenoh_config",
];

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("change").args(["add_pulse", "overrides"]).multiple(true))]
pub(super) struct Args {
    /// Re-simulate the session with a change instead of replaying it; record the result, and report where both deviate.
    #[arg(long, requires = "change", conflicts_with_all = REPLAY_ONLY_OPTIONS)]
    what_if: bool,
    /// Add a pulse; START in simulated s since the session began, TORQUE in N·m, DURATION in s.
    #[arg(long, value_name = "START:TORQUE:DURATION", requires = "what_if", value_parser = added_pulse)]
    add_pulse: Vec<AddedPulse>,
    /// Override a key of the scene.
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "what_if")]
    overrides: Vec<String>,
    /// Record the result to this file instead of recordings/NAME-what-if-TIME.mcap.
    #[arg(long, value_name = "PATH", requires = "what_if")]
    record: Option<PathBuf>,
}

impl Args {
    pub(super) fn is_asked(&self) -> bool {
        self.what_if
    }
}

fn added_pulse(text: &str) -> Result<AddedPulse, String> {
    let wrong = || "three numbers START:TORQUE:DURATION, such as 3.0:5:0.1; START from 0".to_owned();
    let numbers: Vec<f64> = text.split(':').map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
    match numbers[..] {
        [start_s, torque_nm, duration_s] if start_s >= 0.0 => Ok(AddedPulse { start_s, torque_nm, duration_s }),
        _ => Err(wrong()),
    }
}

pub(super) fn what_if(file: &Path, args: &Args) -> anyhow::Result<ExitStatus> {
    let source = RecordedSession::open(file)?;
    let change = Change {
        pulses: args.add_pulse.clone(),
        overrides: args.overrides.clone(),
        command_line: std::env::args().collect::<Vec<_>>().join(" "),
    };
    let fresh = || paths::fresh(Path::new(paths::FOLDER), &format!("{}-what-if", source.name), SystemTime::now());
    let bar = over_file(file, 1);
    let outcome = compute(&source, &change, &args.record.clone().unwrap_or_else(fresh), &|position| bar.set_position(position));
    bar.finish_and_clear();
    report(&outcome?)
}

fn report(outcome: &WhatIfOutcome) -> anyhow::Result<ExitStatus> {
    let WhatIfOutcome { from_s, deviation, diverged, written } = outcome;
    let mut out = std::io::stdout();
    writeln!(out, "re-simulated from t = {from_s} s")?;
    for Written { path, messages, .. } in written {
        writeln!(out, "recorded {messages} messages to {}", path.display())?;
    }
    match &deviation.first {
        None => writeln!(out, "no deviation")?,
        Some(first) => writeln!(out, "first deviation: {first}")?,
    }
    for (name, LargestDifference { value, at_s }) in &deviation.largest {
        match value {
            0.0 => writeln!(out, "  {name:<24} is the same")?,
            _ => writeln!(out, "  {name:<24} differs by at most {value:.6e}, at t = {at_s:.3} s")?,
        }
    }
    if let Some(diverged) = diverged {
        say!("error: {diverged}");
        return Ok(ExitStatus::Diverged);
    }
    Ok(ExitStatus::Success)
}
