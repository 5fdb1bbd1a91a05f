//! `response`: small motion under one input, over frequency and after a step.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use indexmap::IndexSet;

use super::after_step::{AfterStep, largest};
use super::aligned_table::{figure, print};
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::{make_folder, must_be_targets};
use super::linear_args::{Linear, LinearArgs};
use super::mode_figures::rounded;
use super::output::output;
use super::over_frequency::OverFrequency;
use super::peaks::{UNDAMPED, natural_hz, unmet};
use super::phases::within_half_a_turn;
use super::values::{positive, positive_time};
use super::written::{draw, write_table};
use crate::plot::{self, Axis, Figure, Named};
use crate::small_motion::{FreeMotions, Mode, StateSpace, modes};
use crate::study::Table;

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank response                                        torque on the default scene at its start
  flexcrank response crank-slider --angle 57 --output slider_m --plot responses
  flexcrank response crank-slider --angle 57 --input slider_force_n --from 1 --to 1e4 --csv bode.csv
  flexcrank response ref-r5 --crank held --set beam.damping_s=1e-5      a force across the tip of a clamped beam
  flexcrank response thesis-two-masses --output mass_2_m --until 2 --step-csv step.csv

Frequency response: magnitude and phase of each output under the input e^(iωt), as differences from the state; phases in the table are from −180° to 180°, and those of --csv and --plot go on without jumps. Step response: each \
    output after the input has gone from 0 to 1, exact at every sample. `linearise` writes the names of all inputs and outputs. A vibration without damping, or with less than 1e-8 of \
    the critical one, has no largest response: the one printed is that of the frequencies computed.

Exit codes: 0 done, 1 failed, 2 usage, bad scene, or a state that cannot be linearised.";

/// Frequencies, at equal ratios.
const FREQUENCIES: usize = 600;
/// More of them about each natural frequency, and how far they reach, in widths of its peak.
const ABOUT_PEAK: i32 = 20;
const WIDTHS: f64 = 4.0;
/// Angles beyond this are no small motion, rad.
const SMALL_RAD: f64 = 1.0;
/// Motion grows by itself where an eigenvalue has more than this part of itself in its positive real part; less is rounding.
const GROWS: f64 = 1e-6;
/// Modes that decide which frequencies are of interest.
const MODES: usize = 10;
/// Most modes whose peaks are looked at: of a mesh, more take many seconds.
const MOST_MODES: usize = 20;
/// Without modes, Hz and s.
const OTHERWISE: ([f64; 2], f64) = ([0.1, 100.0], 1.0);

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    pub linear: LinearArgs,
    /// The input. Default: torque on a free crank; else the force on the slider, the force on the tip that is more across the last link,
    /// or the force on the first mass.
    #[arg(long, value_name = "NAME")]
    pub input: Option<String>,
    /// Outputs. Default: angle, slider or tip, and deflections; the masses of an oscillator.
    #[arg(long = "output", value_name = "NAME", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Lowest frequency, Hz. Default: a tenth of the lowest natural frequency.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub from: Option<f64>,
    /// Highest frequency, Hz. Default: twice that of the tenth mode, a turning of the chain by itself counted among them.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub to: Option<f64>,
    /// Length of the step response. Default: ten periods of the lowest natural frequency.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub until: Option<f64>,
    /// Draw both responses into this folder, as SVG and PNG.
    #[arg(long, value_name = "DIR")]
    pub plot: Option<PathBuf>,
    /// Write the frequency response to this file. One of the same name is replaced.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write the step response to this file. One of the same name is replaced.
    #[arg(long, value_name = "FILE")]
    pub step_csv: Option<PathBuf>,
}

/// The place of the largest value of an output that does not move.
const NOWHERE: &str = "–";

/// Both responses of the outputs chosen.
struct Responses {
    input: String,
    outputs: Vec<String>,
    over_frequency: OverFrequency,
    after_step: AfterStep,
    /// Whether the mechanism moves without a force that brings it back.
    is_free: bool,
    /// The outputs that then grow without bound, if the input turns the chain.
    unbounded: Vec<String>,
    /// Whether an angle, chosen or not, is larger than small motion is, under an input of 1.
    is_beyond_small: bool,
}

pub(super) fn response(args: &Args) -> CommandResult {
    let targets = [("--csv", args.csv.as_deref()), ("--step-csv", args.step_csv.as_deref())];
    must_be_targets(&args.linear.subject.target, &targets)?;
    let linear = args.linear.linearise()?;
    let found = modes(&linear.chosen.subject, &linear.point, MODES)?;
    let range_hz = args.range_hz(&natural_hz(&found))?;
    let (natural, beyond_hz) = natural_below(range_hz[1], &linear, &found);
    let responses = args.respond(&linear, &found, (range_hz, &natural))?;
    linear.warn_of_rounding(&found, "the step response");
    args.plot.as_deref().map_or(Ok(()), make_folder)?;
    let shown = responses.show(&linear.title).and_then(|()| responses.show_caveats());
    let beyond = beyond_hz.map(|hz| {
        let most_hz = figure(hz);
        format!("  above {most_hz} Hz, peaks that are narrow beside the {FREQUENCIES} frequencies of the range may be missed")
    });
    let remarks = found.iter().filter_map(|mode| rounded(&mode.into()));
    let remarks = remarks.chain(unmet(&natural, &responses.over_frequency.frequencies_hz)).chain(beyond);
    let shown = shown.and_then(|()| remarks.into_iter().try_for_each(|remark| Ok(writeln!(output(), "{remark}")?)));
    // All that can be written is, though an earlier part of it, or printing, fails.
    shown
        .and(args.csv.as_deref().map_or(Ok(()), |path| write_table(path, &responses.table_over_frequency(), true)))
        .and(args.step_csv.as_deref().map_or(Ok(()), |path| write_table(path, &responses.over_time(), true)))
        .and(args.plot.as_deref().map_or(Ok(()), |folder| responses.draw(folder, &linear.title)))?;
    if let Some(rate) = growth_per_s(&found) {
        say!(
            "warning: the motion grows by itself as e^({} t), so the step response grows, too, and the frequency response is not \
             what a test would measure",
            figure(rate)
        );
    }
    Ok(ExitStatus::Success)
}

/// The largest rate at which motion grows by itself, 1/s.
fn growth_per_s(found: &[Mode]) -> Option<f64> {
    let growing = found.iter().filter(|mode| mode.eigenvalue.re > GROWS * mode.eigenvalue.norm());
    growing.map(|mode| mode.eigenvalue.re).max_by(f64::total_cmp)
}

impl Args {
    fn respond(&self, linear: &Linear, found: &[Mode], (range_hz, natural): ([f64; 2], &[[f64; 2]])) -> CommandResult<Responses> {
        let space = &linear.space;
        let input = match &self.input {
            Some(name) if name == "torque_nm" && linear.chosen.subject.is_held() => {
                return Err(Failure::Usage("no input \"torque_nm\": the crank is held; --crank free has it".to_owned()));
            }
            Some(name) => place(name, &space.inputs, "input")?,
            None => usual_input(space),
        };
        let outputs: Vec<usize> = match self.outputs.as_slice() {
            [] => usual(&space.outputs),
            names => names.iter().map(|name| place(name, &space.outputs, "output")).collect::<CommandResult<_>>()?,
        };
        let angles: Vec<usize> = (0..space.outputs.len()).filter(|&output| space.outputs[output].ends_with("_rad")).collect();
        let length_m = linear.chosen.subject.chain().map(|chain| chain.links.iter().map(|link| link.length_m).sum());
        let frequencies_hz = frequencies_hz(range_hz, natural);
        let over_frequency = OverFrequency::new(space, (input, &outputs), frequencies_hz, (natural, length_m));
        let lowest_hz = natural.first().map(|[hz, _]| *hz);
        let until_s = self.until.or_else(|| lowest_hz.map(|hz| 10.0 / hz)).unwrap_or(OTHERWISE.1);
        let fastest_per_s = found.iter().map(|mode| mode.eigenvalue.norm()).fold(0.0, f64::max);
        let mut after_step = AfterStep::new(space, input, &[&outputs[..], &angles].concat(), (until_s, fastest_per_s))?;
        after_step.samples.truncate(outputs.len());
        let after_rad = after_step.peaks.drain(outputs.len()..).map(|(_, peak)| peak.abs());
        let is_beyond_small = after_rad.fold(over_frequency.largest_rad, f64::max) > SMALL_RAD;
        let free = FreeMotions::new(space, found);
        let is_unbounded = |output: &&usize| free.let_grow(space, [input, **output]);
        let moved = outputs.iter().zip(&over_frequency.moves).filter(|(_, moves)| **moves).map(|(output, _)| output);
        let unbounded = moved.filter(is_unbounded).map(|output| space.outputs[*output].clone()).collect();
        Ok(Responses {
            is_free: found.iter().any(|mode| mode.eigenvalue.norm() == 0.0),
            unbounded,
            input: space.inputs[input].clone(),
            outputs: outputs.iter().map(|output| space.outputs[*output].clone()).collect(),
            over_frequency,
            after_step,
            is_beyond_small,
        })
    }

    /// Lowest and highest frequency, Hz, by the natural ones if not given.
    fn range_hz(&self, natural: &[[f64; 2]]) -> CommandResult<[f64; 2]> {
        let ends = natural.first().zip(natural.last()).map(|([low, _], [high, _])| [0.1 * low, 2.0 * high]);
        let [low, high] = ends.unwrap_or(OTHERWISE.0);
        let (low, high) = (self.from.unwrap_or(low), self.to.unwrap_or(high));
        if low >= high {
            return Err(Failure::Usage(self.empty_range([low, high])));
        }
        Ok([low, high])
    }

    /// Why there are no frequencies from `low` to `high`, Hz: only options that were given are at fault.
    fn empty_range(&self, [low, high]: [f64; 2]) -> String {
        match (self.from, self.to) {
            (Some(from), None) => {
                format!("--from {from} is above the default of --to, {} Hz: give --to as well", figure(high))
            }
            (None, Some(to)) => format!("--to {to} is below the default of --from, {} Hz: give --from as well", figure(low)),
            _ => format!("--from {low} must be less than --to {high}"),
        }
    }
}

/// Natural frequencies and damping ratios of the modes found, and of further ones if the range, up to a frequency, Hz, has more. And the
/// highest of them, Hz, if the range may have modes beyond that are not looked at.
fn natural_below(high_hz: f64, linear: &Linear, found: &[Mode]) -> (Vec<[f64; 2]>, Option<f64>) {
    let below = |natural: &[[f64; 2]]| natural.last().map(|[hz, _]| *hz).filter(|hz| *hz < high_hz);
    let natural = natural_hz(found);
    if found.len() < MODES || below(&natural).is_none() {
        return (natural, None);
    }
    let Ok(further) = modes(&linear.chosen.subject, &linear.point, MOST_MODES) else {
        let beyond_hz = below(&natural);
        return (natural, beyond_hz);
    };
    let natural = natural_hz(&further);
    let beyond_hz = below(&natural).filter(|_| further.len() == MOST_MODES);
    (natural, beyond_hz)
}

/// Frequencies at equal ratios, and close ones about each natural frequency.
fn frequencies_hz([low, high]: [f64; 2], natural: &[[f64; 2]]) -> Vec<f64> {
    let ratio = |k: usize| low * (high / low).powf(k as f64 / (FREQUENCIES - 1) as f64);
    let mut all: Vec<f64> = (0..FREQUENCIES).map(ratio).collect();
    for [hz, damping] in natural.iter().filter(|[_, damping]| *damping > UNDAMPED) {
        let about = |k: i32| hz * (1.0 + damping * WIDTHS * f64::from(k) / f64::from(ABOUT_PEAK));
        all.extend((-ABOUT_PEAK..=ABOUT_PEAK).map(about).filter(|hz| (low..=high).contains(hz)));
    }
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

fn place(name: &str, names: &[String], what: &str) -> CommandResult<usize> {
    let found = names.iter().position(|other| other == name);
    found.ok_or_else(|| Failure::Usage(format!("no {what} {name:?}; there are {}", names.join(", "))))
}

/// The input that users look at first: the first one, or that of two forces on the tip which is more across the last link.
fn usual_input(space: &StateSpace) -> usize {
    let chord = space.outputs.iter().rposition(|name| name.ends_with("_chord_rad"));
    let lies_along_x = chord.is_some_and(|chord| space.at[chord].cos().abs() > space.at[chord].sin().abs());
    usize::from(lies_along_x && space.inputs.first().is_some_and(|name| name == "tip_force_x_n"))
}

/// The outputs that users look at first.
fn usual(names: &[String]) -> Vec<usize> {
    let first = |name: &str| {
        name.ends_with("angle_rad") || name.ends_with("deflection_m") || ["slider_m", "tip_x_m", "tip_y_m"].contains(&name)
    };
    let masses = |name: &str| name.starts_with("mass_") && name.ends_with("_m");
    let chosen: Vec<usize> = (0..names.len()).filter(|&k| first(&names[k]) || masses(&names[k])).collect();
    if chosen.is_empty() { vec![0] } else { chosen }
}

impl Responses {
    fn show(&self, title: &str) -> CommandResult<()> {
        writeln!(output(), "{title}: response to {}", self.input)?;
        let mut rows =
            vec![["output", "largest", "at Hz", "phase", "step: largest", "at s", "at its end"].map(str::to_owned).to_vec()];
        for (k, name) in self.outputs.iter().enumerate() {
            let (at, peak) = largest(&self.over_frequency.magnitudes[k]);
            let (step_at_s, step) = self.after_step.peaks[k];
            let phase =
                format!("{}°", within_half_a_turn(self.over_frequency.phases_deg[k].get(at).copied().unwrap_or(f64::NAN)));
            let end = self.after_step.samples[k].last().copied().unwrap_or(f64::NAN);
            let at_hz = figure(self.over_frequency.frequencies_hz[at]);
            let [at_hz, phase, at_s] =
                [at_hz, phase, figure(step_at_s)].map(|at| if self.over_frequency.moves[k] { at } else { NOWHERE.to_owned() });
            rows.push(vec![name.clone(), figure(peak), at_hz, phase, figure(step), at_s, figure(end)]);
        }
        Ok(print(&rows, 1)?)
    }

    /// Prints which of the largest values are no resonance, or between samples, and whether they are beyond small motion.
    fn show_caveats(&self) -> CommandResult<()> {
        let mut out = output();
        let unmoved = self.outputs.iter().zip(&self.over_frequency.moves).filter(|(_, moves)| !**moves);
        let unmoved: Vec<&str> = unmoved.map(|(name, _)| name.as_str()).collect();
        if !unmoved.is_empty() {
            writeln!(out, "  {}: not moved by {} in small motion about this state", unmoved.join(", "), self.input)?;
        }
        self.show_missed()?;
        for (end, place) in [("lower", 0), ("upper", self.over_frequency.frequencies_hz.len().saturating_sub(1))] {
            let names = self.largest_at(place).join(", ");
            if !names.is_empty() {
                writeln!(out, "  {names}: largest at the {end} end of the range, which is no resonance")?;
            }
        }
        let is_unbounded = !self.unbounded.is_empty() && self.after_step.ends_largest();
        let names = self.unbounded.join(", ");
        let grow = if self.unbounded.len() == 1 { "grows" } else { "grow" };
        // Of what nothing holds, angles always grow beyond it.
        let has_angle = !self.is_free || self.outputs.iter().any(|name| name.ends_with("_rad"));
        let sentence = match (is_unbounded, self.is_beyond_small && has_angle) {
            (true, true) => {
                format!("no stiffness holds the mechanism: {names} {grow} without bound, beyond small motion (1 rad)")
            }
            (true, false) => {
                format!("no stiffness holds the mechanism: {names} {grow} without bound towards 0 Hz and after a step")
            }
            (false, true) => "angles over 1 rad are beyond small motion: the response holds for smaller inputs".to_owned(),
            (false, false) => return Ok(()),
        };
        Ok(writeln!(out, "  {sentence}")?)
    }

    /// The outputs that are largest at this frequency, of those that move.
    fn largest_at(&self, place: usize) -> Vec<&str> {
        let is_there = |k: &usize| self.over_frequency.moves[*k] && largest(&self.over_frequency.magnitudes[*k]).0 == place;
        (0..self.outputs.len()).filter(is_there).map(|k| self.outputs[k].as_str()).collect()
    }

    /// Prints which of the largest values after the step are between samples, of which tables and pictures are made.
    fn show_missed(&self) -> CommandResult<()> {
        let moved = self.outputs.iter().enumerate().filter(|(k, _)| self.over_frequency.moves[*k]);
        let missed = moved.filter_map(|(k, name)| Some((name.as_str(), self.after_step.missed_s(k)?)));
        let (names, missed_s): (Vec<&str>, Vec<f64>) = missed.unzip();
        let Some(interval_s) = self.after_step.times_s.get(1).filter(|_| !names.is_empty()) else { return Ok(()) };
        let (names, interval) = (names.join(", "), figure(*interval_s));
        let until = self.after_step.until_s(&missed_s).map(|until_s| format!(": `--until {}` shows it", figure(until_s)));
        let until = until.unwrap_or_default();
        Ok(writeln!(output(), "  {names}: largest between samples, which are {interval} s apart{until}")?)
    }

    fn draw(&self, folder: &Path, title: &str) -> CommandResult<()> {
        let after_step = self.after_step(title)?;
        draw(folder, "frequency-response", &self.bode(title), true).and(draw(folder, "step-response", &after_step, true))
    }

    fn table_over_frequency(&self) -> Table {
        let mut table = Table::default();
        table.push("frequency_hz", self.over_frequency.frequencies_hz.clone());
        for ((name, magnitudes), phases) in
            self.outputs.iter().zip(&self.over_frequency.magnitudes).zip(&self.over_frequency.phases_deg)
        {
            table.push(format!("{name}_per_{}", self.input), magnitudes.clone());
            table.push(format!("{name}_phase_deg"), phases.clone());
        }
        table
    }

    fn over_time(&self) -> Table {
        let mut table = Table::default();
        table.push("time_s", self.after_step.times_s.clone());
        self.outputs.iter().zip(&self.after_step.samples).for_each(|(name, step)| table.push(name, step.clone()));
        table
    }

    fn bode(&self, title: &str) -> Figure {
        let input = plot::quantity(&self.input);
        let title = format!("{title}: response to {}", input.label);
        let x = Axis::log("frequency", "Hz");
        let mut figure = Figure { title, x, ..Figure::default() };
        let outputs: Vec<Axis> = self.outputs.iter().map(|name| plot::quantity(name)).collect();
        let units: IndexSet<&str> = outputs.iter().map(|output| output.unit.as_str()).collect();
        // Magnitudes of different units have no common axis.
        for unit in units {
            let own: Vec<(&Axis, &Vec<f64>)> =
                outputs.iter().zip(&self.over_frequency.magnitudes).filter(|(output, _)| output.unit == unit).collect();
            let label = of_one("magnitude", own.iter().map(|(output, _)| *output));
            figure = figure.panel(Axis::log(label, format!("{unit} per {}", input.unit)));
            for (output, magnitudes) in own {
                figure = figure.line(&output.label, &self.over_frequency.frequencies_hz, magnitudes);
            }
        }
        figure = figure.panel(Axis::new(of_one("phase", outputs.iter()), "°"));
        for (output, phases) in outputs.iter().zip(&self.over_frequency.phases_deg) {
            figure = figure.line(&output.label, &self.over_frequency.frequencies_hz, phases);
        }
        figure
    }

    /// A panel for each unit.
    fn after_step(&self, title: &str) -> CommandResult<Figure> {
        let input = plot::quantity(&self.input);
        let title = format!("{title}: after a step of {} by 1 {}", input.label, input.unit);
        let tables = [Named { table: self.over_time(), ..Named::default() }];
        Ok(Figure { title, ..plot::figure(&tables, Some("time_s"), &self.outputs)? })
    }
}

/// A quantity of several outputs, or of the only one by its name: a curve alone has no legend.
fn of_one<'a>(quantity: &str, mut outputs: impl Iterator<Item = &'a Axis>) -> String {
    match (outputs.next(), outputs.next()) {
        (Some(only), None) => format!("{quantity} of {}", only.label),
        _ => quantity.to_owned(),
    }
}
