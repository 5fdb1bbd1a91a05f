//! `check`: validates a scene, and shows what it would cost.

use std::f64::consts::TAU;
use std::fmt;
use std::io::Write as _;
use std::time::{Duration, Instant};

use clap_complete::engine::ArgValueCompleter;
use serde::Serialize;

use super::aligned_table::figure;
use super::building::build;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::output::{output, print_json};
use super::progress;
use super::suspect_numbers::suspect_numbers;
use crate::runtime::{beyond_range, unbalanced};
use crate::scene::{Drive, IntegratorKind, ModelKind, Motion, Scene, SceneSource, builtin};
use crate::simulation::{Diverged, EnergyVerdict, Simulation};
use crate::small_motion::{NoModes, Vibrations};
use crate::study::{Shortening, shortenings, usual_until_s};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank check mine.toml
  flexcrank check crank-slider --set solver.model=finite-element --set rod.elements=16 --json

Frequencies are those of small undamped vibrations about rest at the start position, bent by weight and constant loads. An unknown \
    that does not vibrate moves freely, or falls away from rest, as a beam does that stands on its end.

The scene is run over 2 s, a second after its last pulse, or two turns of its drive, for at most 20,000 steps or 2 s of computing: \
    that shows the cost of a step on this machine, and the balance of energies. The suggested step resolves the lowest frequency, and \
    a turn at the speed of the start or the drive, finely enough for about 0.1 % of error, and such a run with it keeps the balance \
    within solver.balance_tolerance; `trade` measures which step suffices.

`modal` leaves out the shortening N L / (E A) of a link without `axial`. It is that of the largest axial force in such a run. \
    `axial = true` is recommended from 10 % of the largest deflection on.

--json prints one object: scene, model, integrator, step_s, unknowns, vibrations, falling (unknowns that fall away from rest), \
    lowest_hz, highest_hz, balance_error (largest, over the energy in play), out_of_range (largest deflection over length, if the \
    model does not cover it), step_cost_s, real_time_factor, suggested_step_s, reason, shortening (link, force_n, shortening_m, \
    deflection_m, recommends_axial); null for what does not exist.

Exit codes: 0 the scene is sound, or a link bends out of the model's range, which is a warning as in `run`; 2 it is refused, 4 it \
    diverges, 6 its energy balance leaves solver.balance_tolerance.";

/// Shortest measurement of the cost.
const MEASURED: Duration = Duration::from_millis(300);
/// Longest run of the scene, computing time.
const LONGEST: Duration = Duration::from_secs(2);
/// Fewer steps in a period do not show it.
const LEAST_STEPS: f64 = 2.0;
/// Most steps of the run.
const MOST_STEPS: u32 = 20_000;
/// Fewer steps of a run show nothing of it.
const LEAST_STEPS_OF_RUN: f64 = 100.0;
/// Looks at how far links are bent in a run.
const LOOKS: f64 = 200.0;
/// Most times that a suggested step is halved.
const HALVINGS: u32 = 7;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A built-in scene or a TOML file.
    #[arg(default_value = builtin::DEFAULT, add = ArgValueCompleter::new(completions::scenes))]
    pub scene: String,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// The result of a check.
#[derive(Serialize)]
struct Checked {
    scene: String,
    model: &'static str,
    integrator: &'static str,
    step_s: f64,
    unknowns: Option<usize>,
    vibrations: Option<usize>,
    falling: Option<usize>,
    lowest_hz: Option<f64>,
    highest_hz: Option<f64>,
    balance_error: Option<f64>,
    out_of_range: Option<f64>,
    step_cost_s: Option<f64>,
    real_time_factor: Option<f64>,
    suggested_step_s: Option<f64>,
    reason: String,
    shortening: Vec<ShorteningLine>,
}

/// The shortening that a link's model leaves out.
#[derive(Serialize)]
struct ShorteningLine {
    link: &'static str,
    force_n: f64,
    shortening_m: f64,
    deflection_m: f64,
    recommends_axial: bool,
}

pub(super) fn check(args: &Args) -> CommandResult {
    let source = SceneSource::open(&args.scene, &args.overrides)?;
    let scene = &source.scene;
    let mut simulation = build(&source)?;
    let bar = progress::elapsed("running the scene");
    let found = Vibrations::of_scene(scene);
    let vibrations = found.as_ref().copied().unwrap_or_default();
    let frequencies_hz = vibrations.and_then(|vibrations| vibrations.frequencies_hz);
    let trial = Trial::of(&mut simulation, usual_until_s(scene), MEASURED);
    let slowest = slowest_motion(scene, frequencies_hz.map(|[lowest_hz, _]| lowest_hz));
    bar.set_message("looking for a step that suffices");
    let (suggested_step_s, reason) = kept_balance(scene, &trial, suggestion(scene, slowest));
    let checked = Checked {
        scene: source.origin.clone(),
        model: scene.solver.model.as_str(),
        integrator: scene.solver.integrator.as_str(),
        step_s: scene.solver.step_s,
        unknowns: simulation.unknowns(),
        vibrations: vibrations.map(|vibrations| vibrations.count),
        falling: vibrations.map(|vibrations| vibrations.falling),
        lowest_hz: frequencies_hz.map(|[lowest_hz, _]| lowest_hz),
        highest_hz: frequencies_hz.map(|[_, highest_hz]| highest_hz),
        balance_error: trial.balance_error,
        out_of_range: trial.out_of_range,
        step_cost_s: trial.step_cost_s,
        real_time_factor: trial.step_cost_s.map(|cost_s| scene.solver.step_s / cost_s),
        suggested_step_s,
        reason,
        shortening: shortening(scene),
    };
    bar.finish_and_clear();
    if args.json {
        print_json(&checked)?
    } else {
        checked.print(&trial, found.err())?
    }
    if let Some((period_s, what)) = slowest.filter(|(period_s, _)| scene.solver.step_s > period_s / LEAST_STEPS) {
        let [step, period] = [scene.solver.step_s, period_s].map(figure);
        say!("warning: a step of {step} s does not resolve the {what}, {period} s: expect wrong motion");
    }
    suspect_numbers(scene).iter().for_each(|warning| say!("warning: {warning}"));
    let bent = trial.out_of_range.and_then(beyond_range);
    bent.iter().for_each(|bent| say!("warning: {bent}"));
    match trial.verdict {
        Err(diverged) => {
            say!("error: {diverged}");
            Ok(ExitStatus::Diverged)
        }
        Ok(EnergyVerdict::Unbalanced { worst_j, in_play_j }) => {
            say!("warning: {}", unbalanced(worst_j, in_play_j));
            Ok(ExitStatus::Untrusted)
        }
        Ok(EnergyVerdict::Balanced | EnergyVerdict::NotJudged) => Ok(ExitStatus::Success),
    }
}

/// A run of the scene.
struct Trial {
    /// Mean wall time of a step, s; `None` if it diverged.
    step_cost_s: Option<f64>,
    /// Largest error of the energy balance, over the energy in play; `None` if it is not judged.
    balance_error: Option<f64>,
    /// Largest deflection over length that was out of the model's range; `None` if none was.
    out_of_range: Option<f64>,
    /// Simulated time at which a run that took too long was ended, s.
    cut_off_s: Option<f64>,
    verdict: Result<EnergyVerdict, Diverged>,
}

impl Trial {
    /// Runs to `until_s`, and on until `shortest` is over; within the limits of steps and time.
    fn of(simulation: &mut Simulation, until_s: f64, shortest: Duration) -> Self {
        let begun = Instant::now();
        let (mut judged, mut steps, mut taken) = (None, 0_u32, Ok(()));
        let (mut cost, mut out_of_range) = (Duration::ZERO, None);
        let seldom = (until_s / simulation.step_s() / LOOKS).max(1.0) as u32;
        while taken.is_ok() && steps < MOST_STEPS {
            let (elapsed, is_whole) = (begun.elapsed(), simulation.time_s() >= until_s);
            if is_whole && judged.is_none() {
                judged = Some((simulation.energy_verdict(), simulation.ledger()));
            }
            if steps > 0 && (is_whole && elapsed >= shortest || elapsed >= LONGEST) {
                break;
            }
            let stepping = Instant::now();
            taken = simulation.step();
            cost += stepping.elapsed();
            steps += 1;
            if is_whole && taken.is_err() {
                // After the run that is judged.
                taken = Ok(());
                break;
            }
            if steps.is_multiple_of(seldom) && !is_whole {
                let bent = simulation.observe().ok().and_then(|seen| seen.out_of_range);
                out_of_range = [out_of_range, bent].into_iter().flatten().reduce(f64::max);
            }
        }
        let cut_off_s = (taken.is_ok() && simulation.time_s() < until_s).then(|| simulation.time_s());
        let (verdict, ledger) = judged.unwrap_or_else(|| (simulation.energy_verdict(), simulation.ledger()));
        let is_judged = verdict != EnergyVerdict::NotJudged && ledger.in_play_j > 0.0;
        Trial {
            step_cost_s: taken.is_ok().then(|| cost.as_secs_f64() / f64::from(steps.max(1))),
            out_of_range,
            cut_off_s,
            balance_error: is_judged.then(|| ledger.worst_balance_j / ledger.in_play_j),
            verdict: taken.map(|()| verdict),
        }
    }
}

/// The suggestion, with a step halved until a run of the scene keeps its energy balance.
fn kept_balance(scene: &Scene, own: &Trial, (suggested_s, reason): (Option<f64>, String)) -> (Option<f64>, String) {
    let until_s = usual_until_s(scene);
    let (first_s, reason) = match suggested_s {
        Some(step_s) if step_s * LEAST_STEPS_OF_RUN <= until_s => (step_s, reason),
        None if scene.solver.model == ModelKind::Incremental => return (None, reason),
        _ => (one_digit(until_s / LEAST_STEPS_OF_RUN), format!("{LEAST_STEPS_OF_RUN} steps over {} s", figure(until_s))),
    };
    let (begun, mut step_s, mut tried_s) = (Instant::now(), first_s, first_s);
    for _ in 0..HALVINGS {
        tried_s = step_s;
        let mut shorter = scene.clone();
        shorter.solver.step_s = step_s;
        let trial = Simulation::new(&shorter).map(|mut run| Trial::of(&mut run, until_s, Duration::ZERO).verdict);
        if trial.is_ok_and(|verdict| is_kept(&verdict)) {
            let longer = format!("{} s would suffice for {reason}, but does not keep the energy balance", figure(first_s));
            return (Some(step_s), if step_s == first_s { reason } else { longer });
        }
        if begun.elapsed() >= LONGEST {
            break;
        }
        step_s = one_digit(0.5 * step_s);
    }
    let none = format!("no step from {} s down to {} s keeps the energy balance", figure(first_s), figure(tried_s));
    match is_kept(&own.verdict) {
        true => (Some(scene.solver.step_s), format!("the scene's own: {none}")),
        false => (None, none),
    }
}

/// Whether a run kept its energy balance, or is not judged by it.
fn is_kept(verdict: &Result<EnergyVerdict, Diverged>) -> bool {
    matches!(verdict, Ok(EnergyVerdict::Balanced | EnergyVerdict::NotJudged))
}

/// The shortening that `modal` leaves out; empty for other models. A run that diverges is reported by the measurement of its cost.
fn shortening(scene: &Scene) -> Vec<ShorteningLine> {
    let left_out = if scene.solver.model == ModelKind::Modal { shortenings(scene).unwrap_or_default() } else { Vec::new() };
    let line = |left_out: Shortening| ShorteningLine {
        link: left_out.link.as_str(),
        force_n: left_out.force_n,
        shortening_m: left_out.shortening_m,
        deflection_m: left_out.deflection_m,
        recommends_axial: left_out.matters(),
    };
    left_out.into_iter().filter(|left_out| left_out.force_n > 0.0).map(line).collect()
}

/// A step for about 0.1 % of error, s, with its reason.
///
/// A method of second order with a step h stretches the period of a vibration by about (ω h)²/12: 0.1 % at 2π/(ω h) = 57 steps. A
/// method of fourth order errs by about (ω h)⁴/120 and less: 0.1 % at 11 steps. Both are rounded up, to 60 and 12.
fn suggestion(scene: &Scene, slowest: Option<(f64, &str)>) -> (Option<f64>, String) {
    if scene.solver.model == ModelKind::Incremental {
        return (None, "the incremental model is of first order, so that its error only falls with the step itself".to_owned());
    }
    let steps = if scene.solver.integrator.order() >= 4 { 12.0 } else { 60.0 };
    let Some((period_s, what)) = slowest else {
        return (None, "nothing is known to vibrate or turn at the start".to_owned());
    };
    let explicit = scene.solver.integrator == IntegratorKind::RungeKutta;
    let limit = if explicit { "; runge-kutta also has a stability limit, which refuses longer steps" } else { "" };
    (Some(one_digit(period_s / steps)), format!("at least {steps} steps per {what} ({} s){limit}", figure(period_s)))
}

/// Period of the lowest frequency, or of a turn if that is shorter, s, with its name.
fn slowest_motion(scene: &Scene, lowest_hz: Option<f64>) -> Option<(f64, &'static str)> {
    let vibration = lowest_hz.map(|hz| (1.0 / hz, "period of the lowest frequency"));
    let turn = Some(speed_rad_per_s(scene)).filter(|speed| *speed > 0.0).map(|speed| (TAU / speed, "turn"));
    vibration.into_iter().chain(turn).min_by(|one, other| one.0.total_cmp(&other.0))
}

/// The largest angular speed that the scene prescribes or starts with, rad/s.
fn speed_rad_per_s(scene: &Scene) -> f64 {
    let start = scene.chain().map_or(0.0, |chain| chain.start.rate_rad_per_s.abs());
    match &scene.drive {
        Drive::Motion(Motion::Speed(rad_per_s)) => start.max(rad_per_s.abs()),
        Drive::Motion(Motion::Ramp { to_rad_per_s, .. }) => start.max(to_rad_per_s.abs()),
        Drive::Motion(Motion::Table(_)) | Drive::Torque { .. } => start,
    }
}

/// The next smaller number with one digit: 0.0037 becomes 0.003.
fn one_digit(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let text = format!("{:e}", (value / power).floor() * power);
    // Parsing back removes what the multiplication added.
    let (digit, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digit = digit.parse::<f64>().unwrap_or(1.0).round();
    format!("{digit}e{exponent}").parse().unwrap_or(value)
}

impl Checked {
    fn print(&self, trial: &Trial, no_modes: Option<NoModes>) -> std::io::Result<()> {
        let mut out = output();
        let Checked { scene, model, integrator, step_s, unknowns, vibrations, reason, .. } = self;
        let finding = match trial.verdict {
            Err(_) => "valid, but it diverges",
            Ok(EnergyVerdict::Unbalanced { .. }) => "valid, but not to be trusted at its step",
            Ok(EnergyVerdict::Balanced | EnergyVerdict::NotJudged) if trial.out_of_range.is_some() => {
                "valid, but a link bends out of the model's range"
            }
            Ok(EnergyVerdict::Balanced | EnergyVerdict::NotJudged) => "sound",
        };
        writeln!(out, "{scene}: {finding}")?;
        writeln!(out, "  model        {model}, {integrator}, step {step_s} s")?;
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
        if let (Some(cost_s), Some(factor)) = (self.step_cost_s, self.real_time_factor) {
            writeln!(out, "  cost         {:.1} µs a step, {} times real time", 1e6 * cost_s, figure(factor))?;
        }
        let suggested = self.suggested_step_s.map_or("none".to_owned(), |step_s| format!("{step_s} s"));
        writeln!(out, "  suggested    {suggested}: {reason}")?;
        self.shortening.iter().try_for_each(|line| writeln!(out, "  shortening   {line}"))
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

impl fmt::Display for ShorteningLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ShorteningLine { link, force_n, shortening_m, deflection_m, recommends_axial } = *self;
        write!(
            f,
            "{link}: shortens by {} m under {} N, which is left out; bends by {} m",
            figure(shortening_m),
            figure(force_n),
            figure(deflection_m)
        )?;
        if deflection_m > 0.0 {
            write!(f, " (ratio {})", figure(shortening_m / deflection_m))?;
        }
        if recommends_axial { write!(f, ": set {link}.axial = true") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::one_digit;

    #[test]
    fn val_a_suggested_step_has_one_digit() {
        for (value, digit) in [(0.0037, 0.003), (9.99e-5, 9e-5), (0.001, 0.001), (2.5, 2.0)] {
            assert_eq!(one_digit(value), digit);
        }
    }
}
