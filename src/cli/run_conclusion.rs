//! The lines that end a run, and its exit status.

use super::exit_status::ExitStatus;
use super::formatting::counted;
use super::short_load::warning_of_run;
use super::status_line::DISTRUST_LIFTED;
use crate::recording::{RecordingError, Written};
use crate::runtime::{Ending, beyond_range, is_distrust, unbalanced};
use crate::scene::{ModelKind, Scene};
use crate::service::LiveReport;
use crate::shown::shown_s;
use crate::simulation::EnergyVerdict;
use crate::wire::{LinkAngle, NodeState};

/// The fate of samples that found a queue full.
const LOST: &str = "dropped because bus or disk could not keep up";

/// The way to a model in whose range links bend further.
pub(super) const BENDS_FURTHER: &str = "links may bend further with `--set solver.model=finite-element`";

/// The way to a better step, as far as it suits all scenes: no step is suggested for the incremental model, and `trade` takes no
/// oscillator.
pub(super) fn step_remedy<'a>(mut scenes: impl Iterator<Item = &'a Scene> + Clone) -> Option<&'static str> {
    let has_suggestion = scenes.clone().all(|scene| scene.solver.model != ModelKind::Incremental);
    match (has_suggestion, scenes.all(|scene| scene.chain().is_some())) {
        (true, true) => Some(
            "`flexcrank check SCENE --until TIME` suggests a step; `flexcrank trade SCENE --tolerance ERROR --until TIME` chooses one",
        ),
        (true, false) => Some("`flexcrank check SCENE --until TIME` suggests a step"),
        (false, true) => Some("`flexcrank trade SCENE --tolerance ERROR --until TIME` chooses model and step"),
        (false, false) => None,
    }
}

/// Prints how each service ended and what it recorded; for several, only what is out of the ordinary. `warned` is the warning of each
/// that was printed before. `remedy` is printed after a run that diverged or is not to be trusted. `is_rated` says whether
/// `--fixed-cost` chose the corrections of steps.
pub(super) fn conclude(reports: &[LiveReport], warned: &[String], remedy: Option<&str>, is_rated: bool) -> ExitStatus {
    let many = reports.len() > 1;
    let done = reports.iter().zip(warned).map(|(report, warned)| conclude_one(report, (many, is_rated), warned));
    let done = done.max_by_key(|done| severity(*done)).unwrap_or(ExitStatus::Success);
    if many {
        let written: Vec<&Written> = reports.iter().flat_map(|report| report.recordings.iter().flatten()).collect();
        let messages: u64 = written.iter().map(|written| written.messages).sum();
        let recorded =
            if written.is_empty() { String::new() } else { format!("; recorded {messages} messages to {} files", written.len()) };
        say!("{} runs ended{recorded}", reports.len());
        warn_of_losses(reports);
    }
    if reports.iter().any(|report| report.worst_out_of_range > 0.0) {
        say!("{BENDS_FURTHER}");
    }
    match (done, remedy) {
        (ExitStatus::Diverged, Some(remedy)) => say!("{remedy}"),
        (ExitStatus::Untrusted, Some(remedy)) => say!("not to be trusted: {remedy}"),
        _ => return done,
    }
    if is_rated {
        say!("{}", with_steps_of_fixed_cost(remedy.unwrap_or_default()));
    }
    if reports.iter().any(accepted_commands) {
        say!("that holds for the scene as it began, without the commands that this session accepted");
    }
    done
}

/// Whether commands were accepted before the stop that ended the run, which is counted even if it is that of a signal.
fn accepted_commands(report: &LiveReport) -> bool {
    report.commands_accepted > u64::from(report.ending == Ending::Stopped)
}

/// One warning for all services.
fn warn_of_losses(reports: &[LiveReport]) {
    let dropped: Vec<u64> = reports.iter().map(|report| report.dropped).filter(|dropped| *dropped > 0).collect();
    if !dropped.is_empty() {
        let (samples, services) = (dropped.iter().sum::<u64>(), dropped.len());
        say_reason!("warning: {} {LOST}, of {services} services", counted(samples, "sample"));
    }
}

fn severity(done: ExitStatus) -> u8 {
    match done {
        ExitStatus::Success | ExitStatus::Interrupted | ExitStatus::OfService(_) => 0,
        ExitStatus::Lossy => 1,
        ExitStatus::Untrusted => 2,
        ExitStatus::Refused => 3,
        ExitStatus::Late => 4,
        ExitStatus::Diverged => 5,
    }
}

/// The options with which the commands of a remedy judge steps of fixed cost.
fn with_steps_of_fixed_cost(remedy: &str) -> String {
    let with = [
        ("check", "`check` takes `--set solver.corrections=N`, N being the number that --fixed-cost found"),
        ("trade", "`trade` takes `--fixed-cost`"),
    ];
    let with: Vec<&str> = with.into_iter().filter(|(command, _)| remedy.contains(command)).map(|(_, with)| with).collect();
    format!("to judge steps of fixed cost, {}", with.join(", and "))
}

/// The warning of steps of fixed cost that left more than the tolerance, with the way to fewer of them.
fn unconverged(steps: u64, is_rated: bool) -> String {
    let what = match is_rated {
        true => "they are less exact than rated; more solver.corrections in place of --fixed-cost, or a shorter step, leave less",
        false => "more solver.corrections, or a shorter solver.step_s, leave less",
    };
    format!("{} of fixed cost left more than solver.tolerance: {what}", counted(steps, "step"))
}

/// The time that a run has reached, with the angles of its links, or the positions of its masses.
fn reached(report: &LiveReport) -> Option<String> {
    let of_link = |link: &LinkAngle| format!("{} at {:.9} rad", link.link, link.chord_rad);
    let of_mass = |mass: &NodeState| format!("mass {} at {:.9} m", mass.index + 1, mass.x_m);
    let (stamp, places): (_, Vec<String>) = match (&report.angles, &report.displacements) {
        (Some(angles), _) => (angles.stamp?, angles.links.iter().map(of_link).collect()),
        (None, Some(displacements)) => (displacements.stamp?, displacements.nodes.iter().map(of_mass).collect()),
        (None, None) => return None,
    };
    Some(format!("t = {} s: {}", shown_s(stamp.sim_time_s), places.join(", ")))
}

fn conclude_one(report: &LiveReport, (many, is_rated): (bool, bool), warned: &str) -> ExitStatus {
    if let (Some(reached), false) = (reached(report), many) {
        say!("{reached}");
    }
    let whose = if many { format!("{}: ", report.name) } else { String::new() };
    let mut done = match &report.ending {
        Ending::Finished | Ending::Stopped => ExitStatus::Success,
        Ending::Diverged(diverged) => {
            say!("error: {whose}{diverged}");
            ExitStatus::Diverged
        }
        Ending::Late { step, late } => {
            say!("error: {whose}step {step} missed its deadline by {late:.1?}, and --overrun is stop");
            ExitStatus::Late
        }
    };
    let mut lossy = report.dropped > 0;
    if lossy && !many {
        say_reason!("warning: {} {LOST}", counted(report.dropped, "sample"));
    }
    if let Some(passed) = report.passed_load {
        say!("warning: {whose}{}", warning_of_run(passed));
    }
    if report.unconverged > 0 {
        say!("warning: {whose}{}", unconverged(report.unconverged, is_rated));
    }
    for recording in &report.recordings {
        let is_part = recording.as_ref().map_or(true, |written| written.limited);
        lossy |= is_part;
        if !many || is_part {
            report_recording(recording, &whose);
        }
    }
    if lossy && done == ExitStatus::Success {
        done = ExitStatus::Lossy;
    }
    if let Some(warning) = beyond_range(report.worst_out_of_range).filter(|warning| warning != warned) {
        say!("warning: {whose}{warning}");
    }
    if let (EnergyVerdict::Unbalanced { worst_j, in_play_j }, ExitStatus::Success | ExitStatus::Lossy) = (report.verdict, done) {
        let warning = unbalanced(worst_j, in_play_j);
        // The same words may stand there since they were first true.
        if warning != warned {
            say_reason!("warning: {whose}{warning}");
        }
        done = ExitStatus::Untrusted;
    }
    if is_distrust(warned) && report.verdict == EnergyVerdict::Balanced {
        say!("{whose}{DISTRUST_LIFTED}");
    }
    done
}

fn report_recording(recording: &Result<Written, RecordingError>, whose: &str) {
    match recording {
        Ok(Written { path, messages, limited: true }) => {
            say_reason!("recorded {messages} messages to {}, and then stopped: --max-recording-size", path.display());
        }
        Ok(Written { path, messages, .. }) => say!("recorded {messages} messages to {}", path.display()),
        Err(error) => say!("error: {whose}recording: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Angles, Displacements, Stamp};

    fn report(ending: Ending, commands_accepted: u64) -> Result<LiveReport, Box<dyn std::error::Error>> {
        Ok(LiveReport {
            name: "crank".parse()?,
            ending,
            angles: None,
            displacements: None,
            recordings: Vec::new(),
            verdict: EnergyVerdict::Balanced,
            unconverged: 0,
            worst_out_of_range: 0.0,
            passed_load: None,
            dropped: 0,
            commands_accepted,
            encoded: 0,
        })
    }

    #[test]
    fn regress_a_stop_by_a_signal_is_no_command_of_a_client() -> Result<(), Box<dyn std::error::Error>> {
        for (ending, accepted, is_told) in [
            (Ending::Stopped, 1, false),
            (Ending::Stopped, 3, true),
            (Ending::Finished, 1, true),
            (Ending::Finished, 0, false),
            // The output was lost: nobody has asked for the stop.
            (Ending::Stopped, 0, false),
        ] {
            let report = report(ending, accepted)?;
            assert_eq!(accepted_commands(&report), is_told, "{report:?}");
        }
        Ok(())
    }

    /// The run of an oscillator ended without a word on it.
    #[test]
    fn regress_a_run_of_an_oscillator_says_where_its_masses_are() -> Result<(), Box<dyn std::error::Error>> {
        let stamp = Some(Stamp { sim_time_s: 2.0, ..Stamp::default() });
        let mass = |index: u32, x_m: f64| NodeState { index, x_m, ..NodeState::default() };
        let displacements = Displacements { stamp, nodes: vec![mass(0, 0.01), mass(1, -0.5)] };
        let oscillator = LiveReport { displacements: Some(displacements), ..report(Ending::Finished, 0)? };
        let said = "t = 2 s: mass 1 at 0.010000000 m, mass 2 at -0.500000000 m";
        assert_eq!(reached(&oscillator).as_deref(), Some(said));
        let chain = LiveReport { angles: Some(Angles { stamp, ..Angles::default() }), ..oscillator };
        assert!(reached(&chain).is_some_and(|said| !said.contains("mass")));
        Ok(())
    }
}
