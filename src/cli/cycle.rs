//! `cycle`: one turn of a rigid crank-slider, its counterweights, and a sweep over its ratio.

use std::io::Write as _;
use std::path::PathBuf;

use clap_complete::engine::ArgValueCompleter;

use super::aligned_table::{figure, print};
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::must_be_targets;
use super::output::output;
use super::short_load::ShortLoad;
use super::values::number;
use super::written::write_table;
use crate::scene::SceneSource;
use crate::study::Table;
use crate::study::cycle::{
    self, Arms, Extreme, Extremes, Options, balance, extremes, ratios_between, speed_rad_per_s, sweep, words,
};

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank cycle                                             the thesis's compressor, at ratio 0.25
  flexcrank cycle --ratio 0.1,0.25,0.5 --dimensionless --csv cycle.csv
  flexcrank cycle crank-slider --speed 30 --acceleration 5 --set slider.mass_kg=1
  flexcrank cycle --set 'slider.resistance_table=[[0, 0], [3.1, 500], [6.2, 900]]'
  flexcrank cycle --balance --r4 0.03 --r5 0.06 --ratio 0.1,0.25,0.5
  flexcrank cycle --sweep-ratio 0.1:0.6:51 --csv sweep.csv

Forces: of the ground on the crank (O), of the crank on the rod (A), of the rod on the slider (E).
Extremes, peaks and means are those on the grid of angles. The CSV of a turn has one row an angle,
ratio after ratio; units are in its column names.";

/// Largest number of rows of a sweep in the terminal.
const SHOWN: usize = 11;
/// Part of the largest values below which a value is the rounding of sums of these.
const NOISE: f64 = 1e-12;
/// Columns that the summary omits; `--csv` writes them all.
const LEFT_OUT: [&str; 5] =
    ["crank rate", "centre of mass velocity", "centre of mass acceleration", "resistance", "kinetic energy"];

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A built-in scene or a TOML file.
    #[arg(default_value = "thesis-compressor", add = ArgValueCompleter::new(completions::scenes))]
    scene: String,
    /// Crank-to-rod ratios: the crank's length changes, the rod stays. Default: the scene's ratio.
    #[arg(long, value_name = "L,L,…", value_delimiter = ',', value_parser = ratio)]
    ratio: Vec<f64>,
    /// Crank rate at the beginning of the turn, rad/s. Default: the rate the scene's [drive] reaches, of a table that after its
    /// last row, or else its mean; without a [drive] the start rate; 1 where the scene's is 0.
    #[arg(long, value_name = "RAD_PER_S", value_parser = any)]
    speed: Option<f64>,
    /// Crank acceleration, constant over the turn, rad/s².
    #[arg(long, value_name = "RAD_PER_S2", default_value = "0", value_parser = any)]
    acceleration: f64,
    /// Constant resistance on the slider along −x, N. Default: the scene's.
    #[arg(long, value_name = "N", value_parser = any)]
    resistance: Option<f64>,
    /// Number of angles over the turn, both ends included.
    #[arg(long, value_name = "N", default_value_t = Options::default().points, value_parser = points)]
    points: usize,
    /// Print dimensionless values: lengths over l2, velocities over l2 ω, accelerations over l2 ω², forces over m3 l2 ω². l2 is
    /// the rod's length, ω the crank's rate, m3 the slider's mass.
    #[arg(long)]
    dimensionless: bool,
    /// Write the complete table to this file. One of the same name is replaced.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Compute the two counterweights that keep the centre of mass fixed, and their cost.
    #[arg(long, requires_all = ["r4", "r5"], conflicts_with_all = ["dimensionless", "sweep_ratio"])]
    balance: bool,
    /// Distance of counterweight m4 from the pivot, on the crank's extension, m.
    #[arg(long, value_name = "M", requires = "balance", conflicts_with_all = ["dimensionless", "sweep_ratio"], value_parser = arm)]
    r4: Option<f64>,
    /// Distance of counterweight m5 from the crank pin, on the rod's extension, m.
    #[arg(long, value_name = "M", requires = "balance", conflicts_with_all = ["dimensionless", "sweep_ratio"], value_parser = arm)]
    r5: Option<f64>,
    /// Sweep a range of ratios: peaks, and the swept volume relative to the machine's size.
    #[arg(long, value_name = "FROM:TO:N", num_args = 0..=1, default_missing_value = "0.1:0.6:51", conflicts_with = "ratio", value_parser = range)]
    sweep_ratio: Option<Range>,
}

/// A range of ratios.
#[derive(Debug, Clone, Copy)]
struct Range {
    from: f64,
    to: f64,
    count: usize,
}

pub(super) fn cycle(args: &Args) -> CommandResult {
    must_be_targets(&args.scene, &[("--csv", args.csv.as_deref())])?;
    let source = SceneSource::open(&args.scene, &args.overrides)?;
    let options = args.options();
    let (table, show): (Table, fn(&Table) -> std::io::Result<()>) = match (args.sweep_ratio, args.balance, args.r4, args.r5) {
        (Some(_), ..) => (sweep(&source, &options)?, show_sweep),
        (None, true, Some(r4_m), Some(r5_m)) => (balance(&source, &options, Arms { r4_m, r5_m })?, show_balance),
        _ => (cycle::cycle(&source, &options)?, show_extremes),
    };
    let mut out = output();
    let speed = figure(speed_rad_per_s(&source.scene, &options));
    let begun = writeln!(out, "{}, one turn at {speed} rad/s{}", args.scene, args.changing());
    let shown = begun.and_then(|()| show(&table)).and_then(|()| if args.csv.is_some() { writeln!(out) } else { Ok(()) });
    // The table is written though printing fails.
    let written = args.csv.as_deref().map_or(Ok(()), |path| write_table(path, &table, true));
    let too_few = args.resistance.is_none().then(|| ShortLoad::warning_of_grid(&source.scene, args.points)).flatten();
    too_few.iter().for_each(|warning| say!("warning: {warning}"));
    shown.map_err(Failure::from).and(written)?;
    Ok(ExitStatus::Success)
}

impl Args {
    fn options(&self) -> Options {
        let swept = self.sweep_ratio.map(|Range { from, to, count }| ratios_between(from, to, count));
        Options {
            ratios: swept.unwrap_or_else(|| self.ratio.clone()),
            speed_rad_per_s: self.speed,
            acceleration_rad_per_s2: self.acceleration,
            resistance_n: self.resistance,
            points: self.points,
            dimensionless: self.dimensionless,
        }
    }

    /// The acceleration in words, if there is one.
    fn changing(&self) -> String {
        match self.acceleration {
            0.0 => String::new(),
            acceleration => format!(" and then {} rad/s²", figure(acceleration)),
        }
    }
}

fn show_extremes(table: &Table) -> std::io::Result<()> {
    for of in extremes(table) {
        writeln!(output(), "\nratio {}", figure(of.ratio))?;
        let shown = of.of.iter().filter(|extreme| !LEFT_OUT.iter().any(|left| extreme.quantity.starts_with(left)));
        let mut rows = vec![["", "", "least", "at", "greatest", "at"].map(str::to_owned).to_vec()];
        rows.extend(shown.map(extreme_row));
        print(&rows, 2)?;
        if let (Some(mean_nm), Some(work_j)) = (of.mean_torque_nm, of.work_j) {
            let [mean, work] = [mean_nm, work_j].map(|value| figure(without_noise(value, largest_torque_nm(&of))));
            writeln!(output(), "  mean driving torque {mean} N·m: {work} J a turn")?;
        }
    }
    Ok(())
}

/// Magnitude of the largest driving torque, N·m.
fn largest_torque_nm(of: &Extremes) -> f64 {
    let torque = of.of.iter().find(|extreme| extreme.column == "driving_torque_nm");
    torque.map_or(0.0, |torque| torque.least.value.abs().max(torque.greatest.value.abs()))
}

/// A value, or zero where it is the rounding of values of this size.
fn without_noise(value: f64, of: f64) -> f64 {
    if value.abs() < NOISE * of { 0.0 } else { value }
}

fn extreme_row(extreme: &Extreme) -> Vec<String> {
    let size = extreme.least.value.abs().max(extreme.greatest.value.abs());
    let value = |value: f64| figure(without_noise(value, size));
    let degrees = |angle_rad: f64| format!("{:.1}°", angle_rad.to_degrees());
    let unit = extreme.unit.to_owned();
    let ends = [extreme.least, extreme.greatest].map(|end| [value(end.value), degrees(end.crank_angle_rad)]);
    [extreme.quantity.clone(), unit].into_iter().chain(ends.into_iter().flatten()).collect()
}

fn show_balance(table: &Table) -> std::io::Result<()> {
    let cell = |name: &str, row: usize| figure(table.column(name).map_or(f64::NAN, |values| values[row]));
    for row in 0..table.rows() {
        let of = |name: &str| cell(name, row);
        writeln!(
            output(),
            "\nratio {}: m4 = {} kg at r4 = {} m, m5 = {} kg at r5 = {} m",
            of("ratio"),
            of("m4_kg"),
            of("r4_m"),
            of("m5_kg"),
            of("r5_m")
        )?;
        let mut rows = vec![["", "", "before", "after"].map(str::to_owned).to_vec()];
        for (before, _) in table.columns().filter(|(name, _)| name.contains("_before_")) {
            let (quantity, unit) = words(before);
            let after = before.replacen("_before_", "_after_", 1);
            rows.push(vec![quantity.replacen(" before", "", 1), unit.to_owned(), of(before), of(&after)]);
        }
        print(&rows, 2)?;
    }
    Ok(())
}

fn show_sweep(table: &Table) -> std::io::Result<()> {
    let (count, every) = (table.rows(), table.rows().saturating_sub(1).div_ceil(SHOWN - 1).max(1));
    let (quantities, units) = table.columns().map(|(name, _)| words(name)).map(|(what, unit)| (what, unit.to_owned())).unzip();
    let mut rows: Vec<Vec<String>> = vec![quantities, units];
    for row in (0..count).filter(|row| row % every == 0 || row + 1 == count) {
        rows.push(table.columns().map(|(_, values)| figure(values[row])).collect());
    }
    writeln!(output())?;
    print(&rows, 0)?;
    if every > 1 {
        writeln!(output(), "  ({} of {count} ratios; --csv FILE writes all)", rows.len() - 2)?;
    }
    Ok(())
}

fn any(text: &str) -> Result<f64, String> {
    number(text, -1e12, 1e12)
}

fn arm(text: &str) -> Result<f64, String> {
    number(text, 1e-9, 1e6)
}

fn ratio(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|ratio| *ratio > 0.0 && *ratio < 1.0).ok_or_else(|| "a number above 0 and below 1".to_owned())
}

fn points(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|count| (3..=1_000_000).contains(count)).ok_or_else(|| "a number from 3 to 1000000".to_owned())
}

fn range(text: &str) -> Result<Range, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let problem =
        || "FROM:TO:N, as in 0.1:0.6:51, with 0 < FROM < TO < 1 and N from 2 to 10000 (a scene goes before it)".to_owned();
    let [from, to, count] = parts.as_slice() else { return Err(problem()) };
    let (from, to) = (ratio(from).map_err(|_| problem())?, ratio(to).map_err(|_| problem())?);
    let count = count.parse().ok().filter(|count| (2..=10_000).contains(count)).ok_or_else(problem)?;
    if from < to { Ok(Range { from, to, count }) } else { Err(problem()) }
}
