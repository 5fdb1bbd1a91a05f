//! `check`: validates a scene, and shows what it would cost.

use std::f64::consts::TAU;
use std::fmt;
use std::io::Write as _;
use std::time::Duration;

use clap_complete::engine::ArgValueCompleter;
use serde::Serialize;

use super::aligned_table::figure;
use super::building::build;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::output::{output, print_json};
use super::progress;
use super::resting_start::RestingStart;
use super::run_conclusion::BENDS_FURTHER;
use super::short_load::ShortLoad;
use super::signals::interruption_leaves_nothing;
use super::step_error::{ROUNDING, StepError};
use super::sudden_start::sudden_start;
use super::suggested_rate::beyond_default;
use super::suggested_step::{OwnRun, slowest_bending, speed_rad_per_s, suggested_step};
use super::suspect_numbers::suspect_numbers;
use super::trial_run::{Distrust, RunLength, Trial};
use super::values::positive_time;
use crate::runtime::{beyond_range, unbalanced};
use crate::scene::{ModelKind, Scene, SceneSource, builtin};
use crate::simulation::{EnergyVerdict, Simulation};
use crate::small_motion::{NoModes, Vibrations};
use crate::study::{MATTERS, NEGLIGIBLE, STROKE_MATTERS, Shortening, shortenings_until, two_turns_s};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank check mine.toml
  flexcrank check mine.toml --until 1min                a step that suffices for so long
  flexcrank check crank-slider --set solver.model=finite-element --set rod.elements=16 --json

Frequencies are those of small undamped vibrations about rest at the start position, bent by weight and constant loads. An unknown \
    that does not vibrate moves freely, or falls away from rest, as a beam does that stands on its end.

The scene is run over 2 s, a second after its last pulse, two turns of its drive after its ramp, or to the last row of drive.table, for \
    at most 2 s of computing. Two turns that take more than 10 s are followed beyond that as far as 1 s of computing goes; \
    where that is not to their end, a line `looked at` says how far. The run shows the cost of a step on this machine and \
    the balance of energies. The step error is the largest difference of the first link's angle from such a run with half the step, without the model's own \
    error; beyond 1 rad, a warning says that the motion is lost. With a [drive], which prescribes the angle, it is that of the \
    deflection in a link's middle, with a warning beyond half its peak; of an oscillator, that of a mass from the exact solution. The suggested step resolves the lowest frequency at which a \
    link bends, or else the lowest of all, and a turn at the speed of the start or the drive, finely enough for about 0.1 % of \
    error in a period, and the shortest load of a resistance_table, which takes 10 steps to pass at half its height. A run of \
    that duration takes at least 100 of these steps, keeps the balance within \
    solver.balance_tolerance, and has a step error of at most 0.01 rad, or of 0.01 of the peak of a deflection or a mass. A longer run may \
    not: see --until. If no step is found with so small an error, as in chaotic motion, the line `suggested` says so; \
    `trade` measures which step suffices.

A line `start` shows where the first link starts, bent by static loads: its angle at the pivot, and how far its end is from the \
    tangent there.

A line `published` names a rate for `run --publish-hz` where the default has fewer than 6 samples in a period of the lowest frequency \
    at which a link bends, or masses vibrate. Where even every step is too rare, it also names a shorter solver.step_s.

`modal` leaves out that a link without `axial` stretches or shortens by N L / (E A). N is the largest mean axial force in such a run, \
    after its start, from 8 places: to half a percent where it varies along the link, as by rotation. `axial = true` is recommended where it is more than 10 % of the largest deflection and more than 1e-7 of the link's length. In \
    a crank-slider, it is also recommended where it is more than 0.05 % of the crank's length. The stroke changes by \
    up to that part, and with friction at the slider, the speed under a given torque by up to twice that part. `trade` measures all outputs.

--json prints one object: scene, finding (the first line of the text), model, integrator, step_s, unknowns, vibrations, falling (unknowns that fall away from \
    rest), lowest_hz, highest_hz, lowest_bending_hz (at which a link bends), balance_error (largest, over the energy in play), \
    step_error_rad (largest change of the first link's angle as the step is halved), \
    half_step_diverges_s (when a run with half the step diverges), step_error_of_deflection (with a [drive]: \
    largest change of the deflection in a link's middle, over its peak in either run), step_error_of_mass (of an oscillator: largest error of a mass, over its largest displacement from the start), out_of_range (largest slope of a link \
    from its chord, rad, if the model does not cover it), step_cost_s, real_time_factor, suggested_step_s, reason, start (of static \
    equilibrium: link, angle_rad, bent_m: positive to the left), looked_at (of a drive whose two turns were not run to the \
    end: until_s, two_turns_s), shortening (a list of: link, \
    force_n (positive in tension), shortening_m (its size), deflection_m, stroke_change (of a crank-slider, relative), recommends_axial); null for what does not exist.

Exit codes: 0 the scene is sound, or a warning says what it is not (a link bends out of the model's range, the result depends \
    on the step); 2 it is refused, 4 it diverges, 6 its energy balance leaves solver.balance_tolerance.";

/// Shortest measurement of the cost.
const MEASURED: Duration = Duration::from_millis(300);
/// Longest measurement of the cost by which it is decided how far a slow drive is followed.
const GAUGED: Duration = Duration::from_millis(20);
/// Part of the longest computing time for which a slow drive is followed: a run shall end before it is cut off.
const FOLLOWED: f64 = 0.5;
/// Fewer steps in a period do not show it.
const LEAST_STEPS: f64 = 2.0;

/// The warning of a run that shows nothing, but for the way on.
const NOTHING_MOVES: &str =
    "nothing moves in this run: its balance, step error and suggested step say nothing of the scene under a load; give it";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A built-in scene or a TOML file.
    #[arg(default_value = builtin::DEFAULT, add = ArgValueCompleter::new(completions::scenes))]
    pub scene: String,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Run the scene to this simulated time, for at most 30 s of computing each time, and judge balance and step by that.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub until: Option<f64>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// The result of a check.
#[derive(Serialize)]
struct Checked {
    scene: String,
    finding: &'static str,
    model: &'static str,
    integrator: &'static str,
    step_s: f64,
    unknowns: Option<usize>,
    vibrations: Option<usize>,
    falling: Option<usize>,
    lowest_hz: Option<f64>,
    highest_hz: Option<f64>,
    lowest_bending_hz: Option<f64>,
    balance_error: Option<f64>,
    step_error_rad: Option<f64>,
    half_step_diverges_s: Option<f64>,
    step_error_of_deflection: Option<f64>,
    step_error_of_mass: Option<f64>,
    out_of_range: Option<f64>,
    step_cost_s: Option<f64>,
    real_time_factor: Option<f64>,
    suggested_step_s: Option<f64>,
    reason: String,
    start: Option<RestingStart>,
    looked_at: Option<PartOfTurns>,
    shortening: Vec<ShorteningLine>,
}

/// The part of a slow drive's two turns that was looked at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct PartOfTurns {
    until_s: f64,
    two_turns_s: f64,
}

/// The change of length that a link's model leaves out.
#[derive(Serialize)]
struct ShorteningLine {
    link: &'static str,
    force_n: f64,
    shortening_m: f64,
    deflection_m: f64,
    stroke_change: Option<f64>,
    recommends_axial: bool,
}

pub(super) fn check(args: &Args) -> CommandResult {
    interruption_leaves_nothing();
    let source = SceneSource::open(&args.scene, &args.overrides)?;
    let scene = &source.scene;
    let warn_of_suspects = || suspect_numbers(&source).iter().for_each(|warning| say!("warning: {warning}"));
    let mut simulation = build(&source).inspect_err(|_| warn_of_suspects())?;
    let start = RestingStart::of(scene, simulation.observation());
    let bar = progress::elapsed("running the scene");
    let found = Vibrations::of_scene(scene);
    let vibrations = found.as_ref().copied().unwrap_or_default();
    let frequencies_hz = vibrations.and_then(|vibrations| vibrations.frequencies_hz);
    let length = args.until.map_or_else(|| unasked_length(scene), RunLength::asked);
    let trial = Trial::of(&mut simulation, length, MEASURED);
    let looked_at_s = trial.cut_off_s.unwrap_or(length.until_s);
    let slowest = slowest_bending(scene, vibrations);
    bar.set_message("running the scene with half the step");
    let step_error = StepError::of(scene, &trial, length);
    bar.set_message("looking for a step that suffices");
    let own = OwnRun { trial: &trial, step_error };
    let (suggested_step_s, reason) = suggested_step(scene, vibrations, own, length);
    bar.set_message("running the scene for its axial forces");
    let known_error = step_error.filter(|error| error.half_diverged_s.is_none());
    let checked = Checked {
        scene: source.origin.clone(),
        finding: finding(&trial, step_error),
        model: scene.solver.model.as_str(),
        integrator: scene.solver.integrator.as_str(),
        step_s: scene.solver.step_s,
        unknowns: simulation.unknowns(),
        vibrations: vibrations.map(|vibrations| vibrations.count),
        falling: vibrations.map(|vibrations| vibrations.falling),
        lowest_hz: frequencies_hz.map(|[lowest_hz, _]| lowest_hz),
        highest_hz: frequencies_hz.map(|[_, highest_hz]| highest_hz),
        lowest_bending_hz: vibrations.and_then(|vibrations| vibrations.lowest_bending_hz),
        // Of a scene at rest, it is of rounding.
        balance_error: trial.balance_error.filter(|_| !trial.stands_still),
        step_error_rad: known_error.and_then(|error| error.angle_rad),
        half_step_diverges_s: step_error.and_then(|error| error.half_diverged_s),
        step_error_of_deflection: known_error.and_then(|error| error.deflection).map(|error| error.of_peak),
        step_error_of_mass: step_error.and_then(|error| error.mass).map(|error| error.of_peak),
        out_of_range: trial.out_of_range,
        step_cost_s: trial.step_cost_s,
        real_time_factor: trial.step_cost_s.map(|cost_s| scene.solver.step_s / cost_s),
        suggested_step_s,
        reason,
        start,
        looked_at: part_of_turns(scene, looked_at_s).filter(|_| args.until.is_none()),
        shortening: if trial.stands_still { Vec::new() } else { shortening(scene, looked_at_s) },
    };
    bar.finish_and_clear();
    if args.json {
        print_json(&checked)?
    } else {
        checked.print(&trial, step_error, found.err())?
    }
    if let Some((period_s, what)) = slowest.filter(|(period_s, _)| scene.solver.step_s > period_s / LEAST_STEPS) {
        let [step, period] = [scene.solver.step_s, period_s].map(figure);
        let wrong_turn = scene.solver.step_s > TAU / speed_rad_per_s(scene) / LEAST_STEPS;
        let outcome = if wrong_turn { "expect wrong motion" } else { "a vibration of that frequency comes out wrong" };
        say!("warning: a step of {step} s does not resolve the {what}, {period} s: {outcome}");
    }
    if let Some(lost) = known_error.and_then(StepError::lost).filter(|_| trial.verdict.is_ok()) {
        say!("warning: {lost}");
    }
    if let Some(time_s) = checked.half_step_diverges_s.filter(|_| trial.verdict.is_ok()) {
        let time = figure(time_s);
        say!(
            "warning: with half the step, the run diverges at t = {time} s: this step hides it, and its motion is not to be trusted"
        );
    }
    if trial.stands_still {
        let loads = match scene.chain() {
            Some(_) => "a pulse, a torque, a start rate or a [drive]",
            None => "start_m or forces_n",
        };
        say!("warning: {NOTHING_MOVES} {loads} like those that it will have");
    }
    let missed = ShortLoad::warning_on(&source, &trial.ways(scene.solver.step_s));
    sudden_start(scene).iter().chain(&missed).for_each(|warning| say!("warning: {warning}"));
    warn_of_suspects();
    let bent = trial.out_of_range.and_then(beyond_range);
    bent.iter().for_each(|bent| say!("warning: {bent}; {BENDS_FURTHER}"));
    if let Some(Distrust { time_s, worst_j, in_play_j }) = trial.distrust {
        let untrusted = unbalanced(worst_j, in_play_j);
        say!("warning: {untrusted}, by t = {} s; later, more is in play. A shorter step keeps it before, too", figure(time_s));
    }
    match trial.verdict {
        Err(diverged) => {
            say!("error: {diverged}");
            Ok(ExitStatus::Diverged)
        }
        Ok(EnergyVerdict::Unbalanced { worst_j, in_play_j }) => {
            say_reason!("warning: {}", unbalanced(worst_j, in_play_j));
            Ok(ExitStatus::Untrusted)
        }
        Ok(EnergyVerdict::Balanced | EnergyVerdict::NotJudged) => Ok(ExitStatus::Success),
    }
}

/// The finding on a scene, in a few words: the first line that `check` prints.
fn finding(trial: &Trial, step_error: Option<StepError>) -> &'static str {
    match trial.verdict {
        Err(_) => "valid, but it diverges",
        Ok(_) if step_error.is_some_and(|error| error.half_diverged_s.is_some()) => "valid, but with half the step it diverges",
        Ok(EnergyVerdict::Unbalanced { .. }) => "valid, but not to be trusted at its step",
        Ok(_) if trial.out_of_range.is_some() => "valid, but a link bends out of the model's range",
        Ok(_) if trial.stands_still => "valid; nothing moves in it",
        Ok(_) if step_error.and_then(StepError::lost).is_some() => "valid, but its result depends on the step",
        Ok(EnergyVerdict::Balanced | EnergyVerdict::NotJudged) => "sound",
    }
}

/// The length of a run that is not asked for: the usual one, or two turns of a slower drive, as far as computing time allows.
fn unasked_length(scene: &Scene) -> RunLength {
    let usual = RunLength::usual(scene);
    let Some(two_turns_s) = two_turns_s(scene).filter(|two_turns_s| *two_turns_s > usual.until_s) else { return usual };
    let Ok(mut simulation) = Simulation::new(scene) else { return usual };
    let trial = Trial::of(&mut simulation, RunLength { longest: GAUGED, ..usual }, Duration::ZERO);
    let followed_s = |cost_s: f64| FOLLOWED * usual.longest.as_secs_f64() / cost_s * scene.solver.step_s;
    RunLength { until_s: two_turns_s.min(trial.step_cost_s.map_or(0.0, followed_s)).max(usual.until_s), ..usual }
}

/// The part of a drive's two turns that a run until this time looked at; `None` if it is the whole.
fn part_of_turns(scene: &Scene, until_s: f64) -> Option<PartOfTurns> {
    two_turns_s(scene).filter(|two_turns_s| until_s < *two_turns_s).map(|two_turns_s| PartOfTurns { until_s, two_turns_s })
}

/// The shortening that `modal` leaves out; empty for other models. A run that diverges is reported by the measurement of its cost.
fn shortening(scene: &Scene, until_s: f64) -> Vec<ShorteningLine> {
    let left_out = match scene.solver.model {
        ModelKind::Modal => shortenings_until(scene, until_s).unwrap_or_default(),
        _ => Vec::new(),
    };
    let line = |left_out: Shortening| ShorteningLine {
        link: left_out.link.as_str(),
        force_n: left_out.force_n,
        shortening_m: left_out.shortening_m,
        deflection_m: if left_out.deflection_m > ROUNDING * left_out.length_m { left_out.deflection_m } else { 0.0 },
        stroke_change: left_out.stroke_change(),
        recommends_axial: left_out.matters(),
    };
    left_out.into_iter().filter(|left_out| left_out.force_n != 0.0).map(line).collect()
}

impl Checked {
    fn print(&self, trial: &Trial, step_error: Option<StepError>, no_modes: Option<NoModes>) -> std::io::Result<()> {
        let mut out = output();
        let Checked { scene, finding, model, integrator, step_s, unknowns, vibrations, reason, .. } = self;
        writeln!(out, "{scene}: {finding}")?;
        writeln!(out, "  model        {model}, {integrator}, step {step_s} s")?;
        if let Some(part) = self.looked_at {
            writeln!(out, "  looked at    {part}")?;
        }
        if let Some(start) = self.start {
            writeln!(out, "  start        {start}")?;
        }
        let others = match (*unknowns, *vibrations, self.falling) {
            (Some(unknowns), Some(vibrations), Some(falling)) => not_vibrating(unknowns, vibrations, falling),
            _ => String::new(),
        };
        let unknowns = unknowns.map_or("not counted for this model".to_owned(), |count| format!("{count} (degrees of freedom)"));
        writeln!(out, "  unknowns     {unknowns}")?;
        let frequencies = match (self.lowest_hz, self.highest_hz, vibrations) {
            (Some(lowest_hz), Some(highest_hz), Some(count)) => {
                format!("{} Hz to {} Hz, {count} in all{others}", figure(lowest_hz), figure(highest_hz))
            }
            (_, _, Some(_)) => format!("nothing vibrates{others}"),
            _ => match no_modes {
                Some(NoModes::NotSuited(_)) => "not computed for this model".to_owned(),
                Some(none) => format!("not computed: {none}"),
                None => "not computed for so many unknowns".to_owned(),
            },
        };
        writeln!(out, "  frequencies  {frequencies}")?;
        let balance =
            self.balance_error.map_or("not judged".to_owned(), |error| format!("within {error:.1e} of the energy in play"));
        let part = trial.cut_off_s.map_or(String::new(), |time_s| format!("; of the first {} s alone", figure(time_s)));
        writeln!(out, "  balance      {balance}{part}")?;
        if let Some(step_error) = step_error {
            writeln!(out, "  step error   {step_error}")?;
        }
        if let (Some(cost_s), Some(factor)) = (self.step_cost_s, self.real_time_factor) {
            writeln!(out, "  cost         {:.1} µs a step, {} times real time", 1e6 * cost_s, figure(factor))?;
        }
        let suggested = self.suggested_step_s.map_or("none".to_owned(), |step_s| format!("{step_s} s"));
        writeln!(out, "  suggested    {suggested}: {reason}")?;
        let of_masses = || self.lowest_hz.filter(|_| *model == ModelKind::MassSpring.as_str()).map(|hz| ("vibration", hz));
        let slowest = self.lowest_bending_hz.map(|hz| ("bending", hz)).or_else(of_masses);
        if let Some(remark) = slowest.and_then(|(what, hz)| beyond_default(what, hz, *step_s)) {
            writeln!(out, "  published    {remark}")?;
        }
        self.shortening.iter().try_for_each(|line| writeln!(out, "  shortening   {line}{part}"))
    }
}

/// The unknowns that do not vibrate, as a remark behind the frequencies.
fn not_vibrating(unknowns: usize, vibrations: usize, falling: usize) -> String {
    let free = match unknowns.saturating_sub(vibrations + falling) {
        0 => String::new(),
        1 => "; 1 unknown moves freely".to_owned(),
        free => format!("; {free} unknowns move freely, or nearly so"),
    };
    match falling {
        0 => free,
        1 => format!("{free}; 1 unknown falls away from rest"),
        falling => format!("{free}; {falling} unknowns fall away from rest"),
    }
}

impl fmt::Display for PartOfTurns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [until, two_turns] = [self.until_s, self.two_turns_s].map(figure);
        write!(f, "{until} s; two turns are done at {two_turns} s: --until {two_turns} looks further, ")?;
        write!(f, "for at most 30 s of computing")
    }
}

impl fmt::Display for ShorteningLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ShorteningLine { link, force_n, shortening_m, deflection_m, stroke_change, recommends_axial } = *self;
        write!(
            f,
            "{link}: {} by {} m under {} N, which is left out; bends by {} m",
            if force_n > 0.0 { "stretches" } else { "shortens" },
            figure(shortening_m),
            figure(force_n.abs()),
            figure(deflection_m)
        )?;
        if deflection_m > 0.0 {
            write!(f, " (ratio {})", figure(shortening_m / deflection_m))?;
        }
        if let Some(change) = stroke_change.filter(|change| *change > STROKE_MATTERS) {
            write!(f, "; the stroke changes by up to {:.2} %", 100.0 * change)?;
        }
        match recommends_axial {
            true => write!(f, ": set {link}.axial = true"),
            false if shortening_m > MATTERS * deflection_m => {
                write!(f, ": too small to matter, not above {NEGLIGIBLE:.0e} of the length")
            }
            false => Ok(()),
        }
    }
}
