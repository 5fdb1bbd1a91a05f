//! `verify`: whether recordings are intact, physical, and equal to what their scene and commands compute.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap_complete::engine::ArgValueCompleter;

use super::aligned_table::figure;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::formatting::counted;
use super::output::output;
use super::progress::over_file;
use super::signals::interruption_leaves_nothing;
use crate::recording::RecordingError;
use crate::resimulation::{Finding, Recomputed, RecordedSession, Verification, verify as verify_source};
use crate::runtime::unbalanced;
use crate::shown::{shown_name, shown_sentence};
use crate::simulation::EnergyVerdict;

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank verify recordings/crank.mcap
  flexcrank verify recordings/*.mcap
  flexcrank verify recordings/*.mcap --json > verified.jsonl

The guide (flexcrank guide recordings) lists the fields that cannot be proved.
Exit codes: 0 intact and equal to the bit, 1 unreadable, damaged or different, 3 intact but lossy (cut off, or a queue was \
    full). Of several files, each is verified, and the gravest code counts: 1 before 3.";

/// Largest number of findings printed.
const SHOWN: usize = 20;
/// Energy in play that is rounding, J.
const ROUNDING_J: f64 = 1e-30;
/// A time that is shorter is shown with its own digits, s.
const SHORT_S: f64 = 0.01;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The recordings.
    #[arg(required = true, value_name = "FILE", add = ArgValueCompleter::new(completions::recordings))]
    files: Vec<PathBuf>,
    /// Print one line of JSON per file.
    #[arg(long)]
    json: bool,
}

/// The result for a file, as `--json` prints it.
#[derive(serde::Serialize)]
struct VerifiedFile<'a> {
    file: &'a Path,
    /// "equal", "lossy" or "different".
    verdict: &'static str,
    span_s: f64,
    messages: u64,
    compared_messages: u64,
    skipped_messages: u64,
    steps: u64,
    joint_gap_m: f64,
    balance_error_j: f64,
    energy_in_play_j: f64,
    /// "balanced", "unbalanced" or "not judged"; `None` if no message has energies.
    energy_verdict: Option<&'static str>,
    /// Whether another build recorded it, so that last bits may differ.
    other_build: bool,
    findings: Vec<FindingLine>,
    /// Number of further findings.
    unlisted_findings: u64,
}

/// A finding, as `--json` prints it.
#[derive(serde::Serialize)]
struct FindingLine {
    /// "lost" or "wrong".
    kind: &'static str,
    text: String,
}

pub(super) fn verify(args: &Args) -> CommandResult {
    interruption_leaves_nothing();
    let mut gravest = ExitStatus::Success;
    for file in &args.files {
        let status = match VerifiedSession::of(file) {
            Ok(verified) => verified.print(args.json)?,
            Err(failure) => failure.report_file(),
        };
        gravest = gravest.graver(status);
    }
    Ok(gravest)
}

/// A recorded session, and the result of its verification.
struct VerifiedSession {
    source: RecordedSession,
    found: Verification,
    took: Duration,
}

impl VerifiedSession {
    fn of(file: &Path) -> CommandResult<Self> {
        let source = RecordedSession::open(file)?;
        let begun = Instant::now();
        let bar = over_file(file, 2);
        let found = verify_source(&source, &|reading, position| {
            let bytes = bar.length().unwrap_or(0) / 2;
            bar.set_position(u64::from(reading) * bytes + position);
        });
        bar.finish_and_clear();
        Ok(VerifiedSession { source, found: found?, took: begun.elapsed() })
    }

    fn print(&self, json: bool) -> io::Result<ExitStatus> {
        let VerifiedSession { source, found, took } = self;
        let (status, verdict) = match (found.findings.is_empty(), found.is_wrong()) {
            (true, false) => (ExitStatus::Success, "equal"),
            (_, true) => (ExitStatus::Refused, "different"),
            (false, false) => (ExitStatus::Lossy, "lossy"),
        };
        match json {
            true => writeln!(output(), "{}", json_line(source, found, verdict)?)?,
            false => report(source, found, *took)?,
        }
        Ok(status)
    }
}

fn json_line(source: &RecordedSession, found: &Verification, verdict: &'static str) -> std::io::Result<String> {
    let Verification { structure, physics, recomputed, span_s, findings, unlisted } = found;
    let file = VerifiedFile {
        file: &source.path,
        verdict,
        span_s: *span_s,
        messages: structure.messages,
        compared_messages: recomputed.messages,
        skipped_messages: recomputed.skipped,
        steps: recomputed.steps,
        joint_gap_m: physics.joint_gap_m,
        balance_error_j: recomputed.balance_error_j,
        energy_in_play_j: recomputed.energy_j,
        energy_verdict: recomputed.verdict.map(|verdict| match verdict {
            EnergyVerdict::Balanced => "balanced",
            EnergyVerdict::Unbalanced { .. } => "unbalanced",
            EnergyVerdict::NotJudged => "not judged",
        }),
        other_build: !source.metadata.other_build().is_empty(),
        findings: findings.iter().map(|finding| FindingLine { kind: kind(finding), text: finding.to_string() }).collect(),
        unlisted_findings: *unlisted,
    };
    serde_json::to_string(&file).map_err(std::io::Error::from)
}

fn kind(finding: &Finding) -> &'static str {
    if finding.is_loss() { "lost" } else { "wrong" }
}

/// The largest balance error, relative to the energy in play, and the verdict.
fn balance(&Recomputed { balance_error_j, energy_j, verdict, .. }: &Recomputed) -> String {
    match verdict {
        None => "no message has energies".to_owned(),
        Some(EnergyVerdict::NotJudged) => "energy balance not checked: the method does not compute all energies".to_owned(),
        Some(EnergyVerdict::Unbalanced { worst_j, in_play_j }) => unbalanced(worst_j, in_play_j),
        Some(EnergyVerdict::Balanced) if energy_j < ROUNDING_J => "no energy was in play".to_owned(),
        Some(EnergyVerdict::Balanced) => {
            let part = balance_error_j / energy_j;
            format!("energy balance to {balance_error_j:.0e} J, {part:.0e} of the {energy_j:.1e} J in play")
        }
    }
}

fn report(source: &RecordedSession, found: &Verification, took: Duration) -> std::io::Result<()> {
    let mut out = output();
    let Verification { structure, physics, recomputed, span_s, findings, unlisted } = found;
    let span = if *span_s < SHORT_S { figure(*span_s) } else { format!("{span_s:.3}") };
    writeln!(out, "{}: {span} s of {}", source.path.display(), shown_name(&source.name))?;
    let other = source.metadata.other_build();
    if !other.is_empty() {
        writeln!(out, "  recorded by another build ({}): last bits may differ", shown_sentence(&other.join("; ")))?;
    }
    writeln!(out, "  structure: {} in {}", counted(structure.messages, "message"), counted(structure.chunks, "chunk"))?;
    writeln!(out, "  physics: joints closed to {:.0e} m, {}", physics.joint_gap_m, balance(recomputed))?;
    let further = |count: u64, noun: &str| if count == 0 { String::new() } else { format!(", {}", counted(count, noun)) };
    let (setpoints, advances) = (further(recomputed.setpoints, "setpoint"), further(recomputed.advances, "advance"));
    let changes = further(recomputed.changes, "change");
    let speed = span_s / took.as_secs_f64().max(1e-9);
    writeln!(
        out,
        "  re-simulated: {} from {} with {}{setpoints}{advances}{changes}, {} compared, in {:.2} s ({} times real time)",
        counted(recomputed.steps, "step"),
        counted(recomputed.checkpoints, "checkpoint"),
        counted(recomputed.pulses, "pulse"),
        counted(recomputed.messages, "message"),
        took.as_secs_f64(),
        if speed < 10.0 { format!("{speed:.2}") } else { format!("{speed:.0}") }
    )?;
    for finding in findings.iter().take(SHOWN) {
        writeln!(out, "  {}: {}", kind(finding), shown_sentence(&finding.to_string()))?;
    }
    if findings.len() > SHOWN {
        writeln!(out, "  and {} more", (findings.len() - SHOWN) as u64 + unlisted)?;
    }
    if structure.messages == 0
        && let Some(way) = RecordingError::cut_chunk_hint(&source.path)
    {
        writeln!(out, "  {way}")?;
    }
    let verdict = match (findings.is_empty(), found.is_wrong()) {
        (true, false) => "intact, and equal to the bit",
        (false, false) if structure.messages == 0 => "nothing to verify",
        (false, false) => "the rest is intact, and equal to the bit",
        (_, true) => "NOT as recorded",
    };
    writeln!(out, "  {verdict}")
}
