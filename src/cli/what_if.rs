//! `what-if`: re-simulates a recorded session with a change.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap_complete::engine::ArgValueCompleter;

use super::command_line::command_line;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::folders::{must_have_folder, must_hold_recordings, must_suit_recording};
use super::formatting::counted;
use super::output::output;
use super::progress::over_file;
use super::run_conclusion::{BENDS_FURTHER, step_remedy};
use super::suspect_numbers::newly_suspect;
use super::values::{GivenDuration, pulse_duration, time, torque};
use crate::decimal_comma::decimal_comma_hint;
use crate::recording::{Overview, Written, paths};
use crate::resimulation::{
    AddedPulse, Change, Deviation, LargestDifference, RecordedSession, SampleTimes, UnlikeMeshes, WhatIfOutcome,
    what_if as compute,
};
use crate::runtime::{beyond_range, unbalanced};
use crate::scene::Scene;
use crate::shown::{shown_s, shown_sentence};
use crate::simulation::EnergyVerdict;

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank what-if recordings/crank.mcap --add-pulse 3.0:5:0.1
  flexcrank what-if recordings/crank.mcap --set rod.density_kg_per_m3=2700 --record aluminium.mcap

The changed session is computed, and recorded, from the last checkpoint before the first added pulse on; with --set, from the \
    session's start. A recording has a checkpoint at its start and every 10 s, and more where something asked for one, as \
    `modes --live` does.

Exit codes: 0 done, 1 failed, 2 usage, or the change is refused, 3 done, but the recording is damaged or ends early, 4 the changed \
    session diverged, 6 its energy balance was off, 130 interrupted: nothing was written.";

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("change").args(["add_pulse", "overrides"]).required(true).multiple(true))]
pub(super) struct Args {
    /// The recording.
    #[arg(add = ArgValueCompleter::new(completions::recordings))]
    pub file: PathBuf,
    /// Add a pulse; START in simulated time since the session began, TORQUE in N·m, DURATION: 3:5:100ms.
    #[arg(long, value_name = "START:TORQUE:DURATION", allow_hyphen_values = true, value_parser = given_pulse)]
    pub add_pulse: Vec<GivenPulse>,
    /// Override a key of the scene.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Record the result to this file instead of recordings/NAME-what-if-TIME.mcap.
    #[arg(long, value_name = "PATH")]
    pub record: Option<PathBuf>,
}

/// A pulse to add, as it was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GivenPulse {
    start_s: f64,
    torque_nm: f64,
    duration: GivenDuration,
}

impl GivenPulse {
    fn added(self) -> AddedPulse {
        AddedPulse { start_s: self.start_s, torque_nm: self.torque_nm, duration_s: self.duration.duration_s }
    }
}

fn given_pulse(text: &str) -> Result<GivenPulse, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let [start, given, duration] = parts[..] else {
        return Err("three numbers START:TORQUE:DURATION, such as 3.0:5:100ms".to_owned());
    };
    let refused = |part: &str, text: &str, problem: String| {
        let hint = decimal_comma_hint(text).map_or(String::new(), |hint| format!("; {hint}"));
        format!("{part} must be {problem}{hint}")
    };
    Ok(GivenPulse {
        // The tip behind a refused option tells of a comma that comes first.
        start_s: time(start).map_err(|problem| format!("START must be {problem}"))?,
        torque_nm: torque(given).map_err(|problem| refused("TORQUE", given, problem))?,
        duration: pulse_duration(duration).map_err(|problem| refused("DURATION", duration, problem))?,
    })
}

pub(super) fn what_if(args: Args) -> CommandResult {
    let Args { file, add_pulse, overrides, record } = args;
    match &record {
        Some(path) => {
            must_suit_recording(path)?;
            must_have_folder(path)?;
        }
        None => must_hold_recordings(Path::new(paths::FOLDER), "record elsewhere with --record FILE")?,
    }
    let source = RecordedSession::open(&file)?;
    let suspects = add_pulse.iter().filter_map(|pulse| pulse.duration.suspect_pulse("--add-pulse: DURATION"));
    suspects.for_each(|warning| say!("warning: {warning}"));
    let pulses = add_pulse.into_iter().map(GivenPulse::added).collect();
    let change = Change { pulses, overrides, command_line: command_line() };
    // A refusal may come of such a number: the warning goes first.
    let brought_in = change.scene(&source).map_or(Vec::new(), |changed| newly_suspect(&source.scene.scene, &changed.scene));
    brought_in.iter().for_each(|warning| say!("warning: {warning}"));
    let fresh = || paths::fresh(Path::new(paths::FOLDER), &format!("{}-what-if", source.name), SystemTime::now());
    let bar = over_file(&file, 1);
    let outcome = compute(&source, &change, &record.unwrap_or_else(fresh), &|position| bar.set_position(position));
    bar.finish_and_clear();
    let outcome = outcome?;
    cut_short(&change.pulses, &outcome).iter().for_each(|warning| say!("warning: {warning}"));
    report(&source.path, &source.scene.scene, &outcome)
}

/// A warning of the first added pulse that lasts beyond the end of the recording.
fn cut_short(pulses: &[AddedPulse], WhatIfOutcome { from_s, deviation, diverged, .. }: &WhatIfOutcome) -> Option<String> {
    let end_s = shown_s(deviation.until_s);
    let ended = |pulse: AddedPulse| shown_s(pulse.start_s + pulse.duration_s);
    let is_compared = diverged.is_none() && deviation.until_s > *from_s;
    let cut = pulses.iter().find(|pulse| is_compared && ended(**pulse) > end_s)?;
    let [start_s, pulse_end_s] = [shown_s(cut.start_s), ended(*cut)];
    Some(format!("the pulse added at t = {start_s} s lasts until t = {pulse_end_s} s, and the recording ends at t = {end_s} s"))
}

/// Says how much of a recording that ends early was re-simulated: only its whole chunks are.
fn of_cut_off(file: &Path, until_s: f64) -> String {
    match Overview::read(file).map_or(0, |overview| overview.unchecked) {
        0 => "everything before was re-simulated".to_owned(),
        left => format!(
            "its whole chunks, up to t = {until_s} s, were re-simulated: `flexcrank recover` saves {} more, of the chunk that was cut off",
            counted(left, "message")
        ),
    }
}

fn report(file: &Path, recorded: &Scene, outcome: &WhatIfOutcome) -> CommandResult {
    let WhatIfOutcome { from_s, deviation, diverged, verdict, worst_out_of_range, samples, written, source, .. } = outcome;
    let mut out = output();
    writeln!(out, "re-simulated and recorded from t = {} s", shown_s(*from_s))?;
    for Written { path, messages, .. } in written {
        writeln!(out, "recorded {messages} messages to {}", path.display())?;
    }
    let until_s = shown_s(deviation.until_s);
    match (&deviation.first, diverged) {
        (Some(first), _) => writeln!(out, "first deviation: {}", shown_sentence(&first.to_string()))?,
        (None, None) if deviation.until_s > *from_s => writeln!(out, "no deviation")?,
        (None, None) if samples.left_out == 0 => {
            writeln!(out, "only the beginning was compared: the recording has no later sample")?;
        }
        (None, None) => writeln!(out, "only the beginning was compared: the changed session's steps reach no later sample")?,
        (None, Some(_)) if deviation.until_s > *from_s => writeln!(out, "no deviation up to t = {until_s} s")?,
        (None, Some(_)) => writeln!(out, "only the beginning was compared: the changed session diverged")?,
    }
    report_quantities(deviation, &mut out)?;
    samples_left_out(recorded, outcome).filter(|_| diverged.is_none()).iter().for_each(|warning| say!("warning: {warning}"));
    if let Some(first) = source.damage.first() {
        let places = counted(source.damage.len() as u64, "place");
        let first = format!("byte {}: {}", first.offset, first.what);
        say_reason!("warning: the recording is damaged in {places}, and the result lacks what is lost there: {first}");
    }
    if source.cut_off.is_some() {
        say_reason!("warning: the recording ends early (still being recorded, or cut off); {}", of_cut_off(file, until_s));
    }
    beyond_range(*worst_out_of_range).iter().for_each(|bent| say!("warning: {bent}; {BENDS_FURTHER}"));
    if let Some(diverged) = diverged {
        say!("error: {diverged}");
        remedy(outcome).iter().for_each(|remedy| say!("{remedy}"));
        return Ok(ExitStatus::Diverged);
    }
    if let EnergyVerdict::Unbalanced { worst_j, in_play_j } = *verdict {
        say_reason!("warning: {}", unbalanced(worst_j, in_play_j));
        remedy(outcome).iter().for_each(|remedy| say!("not to be trusted: {remedy}"));
        return Ok(ExitStatus::Untrusted);
    }
    let lossy = source.cut_off.is_some() || !source.damage.is_empty();
    Ok(if lossy { ExitStatus::Lossy } else { ExitStatus::Success })
}

/// A warning of samples of the recording that the changed session's steps do not reach.
fn samples_left_out(recorded: &Scene, WhatIfOutcome { samples, scene, .. }: &WhatIfOutcome) -> Option<String> {
    let SampleTimes { all, left_out, .. } = *samples;
    let step_s = scene.scene.solver.step_s;
    let reached = match samples.interval_s() {
        Some(interval_s) => format!("{} s, the time between samples,", shown_s(interval_s)),
        None => format!("the recording's own, {} s,", recorded.solver.step_s),
    };
    let lie = if left_out == 1 { "lies" } else { "lie" };
    (left_out > 0).then(|| {
        format!("{left_out} of {all} samples {lie} between steps of {step_s} s, and are left out: a step that divides {reached} reaches all")
    })
}

/// Reports which meshes are unlike, and how far each quantity differs, if any does.
fn report_quantities(deviation: &Deviation, out: &mut impl Write) -> std::io::Result<()> {
    for UnlikeMeshes { link, recorded, computed } in &deviation.unlike_meshes {
        let recorded = counted(*recorded, "element");
        let deflections = if deviation.compares_deflection_of(link) { "" } else { ", none of which deflects" };
        writeln!(out, "  {link}: {recorded} recorded, {computed} computed: compared at the nodes that both have{deflections}")?;
    }
    if deviation.first.is_some() {
        for (name, LargestDifference { value, at_s }) in &deviation.largest {
            match value {
                0.0 => writeln!(out, "  {name:<24} is the same")?,
                _ => writeln!(out, "  {name:<24} differs by at most {value:.6e}, at t = {} s", shown_s(*at_s))?,
            }
        }
    }
    for name in &deviation.not_compared {
        writeln!(out, "  {name:<24} was not compared: samples are missing before every recorded value")?;
    }
    Ok(())
}

/// The way to a better step of the changed scene, if there is one.
fn remedy(outcome: &WhatIfOutcome) -> Option<String> {
    let remedy = step_remedy(std::iter::once(&outcome.scene.scene))?;
    Some(format!("{remedy}; SCENE is the recorded scene with the change; --set solver.step_s=STEP tries a step here"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_the_wrong_part_of_an_added_pulse_is_named() {
        let added = given_pulse("3:-5:100ms").map(GivenPulse::added);
        assert_eq!(added, Ok(AddedPulse { start_s: 3.0, torque_nm: -5.0, duration_s: 0.1 }));
        for (text, problem) in [
            ("-1:5:0.1", "START must be a time from 0 to 1e9 s"),
            ("3:5Nm:0.1", "TORQUE must be a number in N·m without its unit"),
            ("3:5:100mm", "DURATION must be a time from 1ns to 1h"),
            ("3:5", "three numbers START:TORQUE:DURATION"),
            (
                "1:0,5:0.1",
                "TORQUE must be a number in N·m without its unit, such as -2.5; a number has a decimal point, not a comma: 0.5",
            ),
        ] {
            let refused = given_pulse(text).err().unwrap_or_default();
            assert!(refused.starts_with(problem), "{text}: {refused}");
        }
    }
}
